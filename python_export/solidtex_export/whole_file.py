"""Writes a whole file or leaves what was there."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A temporary file beside `path`, with its suffix; it takes the place of `path` at the end.

    After an exception `path` is what it was, and the temporary file is gone.
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
