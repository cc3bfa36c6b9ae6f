"""Access to the C++ engine through the Python module solidtex.

The module is imported on first use: training works without it.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from types import ModuleType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from solidtex import Texture


class EngineError(RuntimeError):
    """The engine module cannot be imported."""


def open_model(model: str | os.PathLike[str], seed: int = 0, precision: str = "full") -> Texture:
    """Open a model by path or by the bare name of a shipped one, for a `with` statement."""
    return _module().Texture(model, seed, precision)


def open_bytes(data: bytes, seed: int = 0) -> Texture:
    """Open a model from the bytes of a file."""
    return _module().Texture.from_bytes(data, seed)


@contextmanager
def checking(error: type[Exception]) -> Iterator[None]:
    """Raise errors of the engine as `error`, with the engine's message."""
    module = _module()
    try:
        yield
    except module.Error as refused:
        raise error(str(refused)) from refused


def errors() -> tuple[type[Exception], ...]:
    """Exceptions with a message for the user that a used engine can have raised."""
    module = sys.modules.get("solidtex")
    return (EngineError,) if module is None else (EngineError, module.Error)


def _module() -> ModuleType:
    try:
        import solidtex
    except ImportError as error:
        raise EngineError(
            f"the Python module solidtex: cannot be imported ({error}); ./test.sh builds it into"
            " build/python and .venv finds it there, or run: pip install REPOSITORY"
        ) from error
    return solidtex
