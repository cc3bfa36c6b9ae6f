"""solidtex-export-space: writes a trained texture space as one file."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from solidtex_export.commands import cli
from solidtex_export.losses.descriptor.weights import WeightsError
from solidtex_export.settings import SettingsError
from solidtex_export.spaces.space_file import SUFFIX, write_space
from solidtex_export.spaces.space_reader import SpaceError
from solidtex_export.spaces.start_file import SUFFIX as START_SUFFIX
from solidtex_export.spaces.start_file import write_start
from solidtex_export.training.result import ResultError

EXAMPLES = """  solidtex-export-space results/stones -o stones.solidtex-space
  solidtex-export-space results/woods --license CC0-1.0 -o woods.solidtex-space
  solidtex-export-space results/start -o stones.solidtex-start

Then: solidtex-encode photo.jpg --space stones.solidtex-space -o mine.solidtex"""


def parser() -> argparse.ArgumentParser:
    p = cli.parser("solidtex-export-space", "Write a trained texture space as one file.", EXAMPLES)
    p.add_argument("result", metavar="RESULT", type=Path, help="folder of solidtex-train-space")
    cli.add_output_arguments(p, "SPACE", SUFFIX)
    p.add_argument("--name", help="name of the space (default: that of SPACE)")
    p.add_argument("--license", default="", help="licence of the space, an SPDX expression")
    return p


def export(args: argparse.Namespace) -> None:
    from solidtex_export.spaces.result import read_config, read_space, read_start

    kind = read_config(args.result / "config.json")["kind"]
    suffix = SUFFIX if kind == "space" else START_SUFFIX
    if args.output.suffix != suffix:
        raise ResultError(f"-o: found {args.output}, expected a file named *{suffix}")
    if args.output.exists() and not args.force:
        raise ResultError(f"{args.output}: found an existing file, expected none (or use --force)")
    name = args.name or args.output.stem
    if kind == "space":
        space = read_space(args.result, name, args.license)
        write_space(args.output, space)
        count = len(space.photographs)
        then = f"solidtex-encode photo.jpg --space {args.output} -o mine.solidtex"
    else:
        start = read_start(args.result, name, args.license)
        write_start(args.output, start)
        count = len(start.document.photographs)
        then = f"solidtex-train photo.jpg --start {args.output} -o results/mine"
    size = args.output.stat().st_size / 2**20
    print(f"{args.output}: {count} photographs, {size:.1f} MiB")
    print(f"next: {then}")


def main(arguments: list[str] | None = None) -> int:
    failures = (*cli.FAILURES, ResultError, SpaceError, SettingsError, WeightsError)
    return cli.run(parser(), arguments, export, failures)


if __name__ == "__main__":
    sys.exit(main())
