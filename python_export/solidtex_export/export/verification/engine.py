"""The C++ engine, by the Python module solidtex, which checks files and evaluates models.

The module is imported when it is first needed: training goes without.
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
    """There is no engine."""


def open_model(model: str | os.PathLike[str], seed: int = 0, precision: str = "full") -> Texture:
    """An open model, a path or the bare name of a shipped one; to be used in a `with` statement."""
    return _module().Texture(model, seed, precision)


def open_bytes(data: bytes) -> Texture:
    """The same of the bytes of a file."""
    return _module().Texture.from_bytes(data)


@contextmanager
def checking(error: type[Exception]) -> Iterator[None]:
    """Around calls of the engine: what it refuses is raised as `error`, with its message."""
    module = _module()
    try:
        yield
    except module.Error as refused:
        raise error(str(refused)) from refused


def errors() -> tuple[type[Exception], ...]:
    """What an engine that has been used can have raised: each has a message for the user."""
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
