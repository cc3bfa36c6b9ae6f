"""Runs Python programs of solidtex in forked processes: torch is loaded once.

Reads requests from standard input, one JSON list a line: program, arguments, folder, file for its
messages, environment. Prints the process's number at once, and its exit code when it has ended,
negative for a signal.
"""

from __future__ import annotations

import importlib
import json
import os
import sys
import tomllib
from pathlib import Path

PROJECT = Path(__file__).resolve().parents[1] / "python_export/pyproject.toml"


def run(program: str, arguments: list[str], folder: str, messages: str, more: dict) -> None:
    """Run the program in this process, and end it."""
    os.chdir(folder)
    for at, name in ((0, os.devnull), (1, os.devnull), (2, messages)):
        os.dup2(os.open(name, os.O_RDWR | os.O_CREAT | os.O_TRUNC, 0o644), at)
    os.environ.update(more)
    sys.argv = [program, *arguments]
    from solidtex_export.training.trainer import Trainer

    Trainer.checkpoint_seconds = float(os.environ.get("SOLIDTEX_CHECKPOINT_SECONDS", "60"))
    module, _, function = scripts()[program].partition(":")
    sys.exit(getattr(importlib.import_module(module), function)(arguments))


def scripts() -> dict[str, str]:
    return tomllib.loads(PROJECT.read_text())["project"]["scripts"]


def main() -> None:
    for entry in scripts().values():
        importlib.import_module(entry.partition(":")[0])
    for line in iter(sys.stdin.buffer.readline, b""):
        request = json.loads(line)
        child = os.fork()
        if child == 0:
            run(*request)
        print(child, flush=True)
        print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), flush=True)


if __name__ == "__main__":
    main()
