"""The programs of the wheel: starts the one that this process is named for."""

import os
import sys
from pathlib import Path


def main() -> None:
    name = Path(sys.argv[0]).name
    program = Path(__file__).parent / "bin" / name
    if not program.is_file():
        sys.exit(
            f"{name}: found no such program in this installation of the Python package solidtex,"
            " which was built without it; expected one of a wheel with programs"
        )
    os.execv(program, [name, *sys.argv[1:]])
