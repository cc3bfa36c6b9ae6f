"""Replaces files atomically."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Yield a temporary file beside `path` with its suffix, and rename it to `path` at the end.

    After an exception `path` is unchanged, and the temporary file is removed.
    """
    descriptor, name = tempfile.mkstemp(f"{path.suffix}", f".{path.stem}.", path.parent)
    os.fchmod(descriptor, 0o644)  # mkstemp's 0600 is for secrets
    os.close(descriptor)
    temporary = Path(name)
    try:
        yield temporary
        os.replace(temporary, path)
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise


def write_whole(path: Path, data: bytes) -> None:
    with replacing(path) as temporary:
        temporary.write_bytes(data)
