"""solidtex-export-space: writes a trained texture space as one file."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from solidtex_export.commands import cli
from solidtex_export.losses.descriptor.weights import WeightsError
from solidtex_export.settings import SettingsError
from solidtex_export.spaces.space_file import SUFFIX, write_space
from solidtex_export.training.result import ResultError

EXAMPLES = """  solidtex-export-space results/stones -o stones.solidtex-space
  solidtex-export-space results/woods --license CC0-1.0 -o woods.solidtex-space

Then: solidtex-encode photo.jpg --space stones.solidtex-space -o mine.solidtex"""


def parser() -> argparse.ArgumentParser:
    p = cli.parser("solidtex-export-space", "Write a trained texture space as one file.", EXAMPLES)
    p.add_argument("result", metavar="RESULT", type=Path, help="folder of solidtex-train-space")
    cli.add_output_arguments(p, "SPACE", SUFFIX)
    p.add_argument("--name", help="name of the space (default: that of SPACE)")
    p.add_argument("--license", default="", help="licence of the space, an SPDX expression")
    return p


def export(args: argparse.Namespace) -> None:
    from solidtex_export.spaces.result import read_space

    if args.output.suffix != SUFFIX:
        raise ResultError(f"-o: found {args.output}, expected a file named *{SUFFIX}")
    if args.output.exists() and not args.force:
        raise ResultError(f"{args.output}: found an existing file, expected none (or use --force)")
    space = read_space(args.result, args.name or args.output.stem, args.license)
    write_space(args.output, space)
    size = args.output.stat().st_size / 2**20
    print(f"{args.output}: {len(space.photographs)} photographs, {size:.1f} MiB")
    print(f"next: solidtex-encode photo.jpg --space {args.output} -o mine.solidtex")


def main(arguments: list[str] | None = None) -> int:
    failures = (*cli.FAILURES, ResultError, SettingsError, WeightsError)
    return cli.run(parser(), arguments, export, failures)


if __name__ == "__main__":
    sys.exit(main())
