"""Replaces files atomically."""

from __future__ import annotations

import glob
import os
import socket
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path


@contextmanager
def naming(path: Path, temporary: Path | None = None) -> Iterator[None]:
    """Let errors of the system name `path`, in place of the temporary file or of none."""
    try:
        yield
    except OSError as error:
        if error.filename not in (None, str(temporary)):
            raise
        raise OSError(error.errno, error.strerror or str(error), str(path)) from error


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Yield a temporary file beside `path` with its suffix, and rename it to `path` at the end.

    After an exception `path` is unchanged, and the temporary file is removed. What a killed process
    has left is removed too.
    """
    prefix, suffix = f".{path.stem}.{socket.gethostname()}-", f".tmp{path.suffix}"
    own = f"{os.getpid()}-{_start_time(os.getpid())}"
    temporary = path.with_name(f"{prefix}{own}{suffix}")
    for abandoned in path.parent.glob(f"{glob.escape(prefix)}*{glob.escape(suffix)}"):
        if not _is_alive(abandoned.name[len(prefix) : -len(suffix)]):
            abandoned.unlink(missing_ok=True)
    with naming(path, temporary):
        try:
            temporary.write_bytes(b"")
            yield temporary
            os.replace(temporary, path)
        except BaseException:
            with suppress(OSError):
                temporary.unlink(missing_ok=True)
            raise


def _is_alive(process: str) -> bool:
    """Whether the process "NUMBER-START" runs; another one may have its number by now."""
    number, _, start = process.partition("-")
    try:
        os.kill(int(number), 0)
    except ProcessLookupError:
        return False
    except (OSError, ValueError, OverflowError):
        return True
    return not start or start == _start_time(int(number))


def _start_time(process: int) -> str:
    """Start of a process in clock ticks since the machine's; empty where /proc does not tell."""
    try:
        text = Path(f"/proc/{process}/stat").read_text()
    except OSError:
        return ""
    return text.rpartition(")")[2].split()[19]


def write_whole(path: Path, data: bytes) -> None:
    with replacing(path) as temporary:
        temporary.write_bytes(data)
