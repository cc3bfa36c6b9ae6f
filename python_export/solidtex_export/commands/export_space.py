"""solidtex-export-space: writes a trained texture space as one file.

The result of an Alanov preset becomes a model of one code, or a space that is its encoder alone.
"""

from __future__ import annotations

import argparse
import math
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from solidtex_export.commands import cli
from solidtex_export.losses.descriptor.weights import WeightsError
from solidtex_export.settings import SettingsError
from solidtex_export.spaces.space_file import SUFFIX, write_space
from solidtex_export.spaces.space_reader import SpaceError
from solidtex_export.spaces.start_file import SUFFIX as START_SUFFIX
from solidtex_export.spaces.start_file import write_start
from solidtex_export.training.result import ResultError

if TYPE_CHECKING:
    from solidtex_export.spaces.alanov.result import AlanovResult

MODEL_SUFFIX = ".solidtex"

EXAMPLES = """  solidtex-export-space results/stones -o stones.solidtex-space
  solidtex-export-space results/woods --license CC0-1.0 -o woods.solidtex-space
  solidtex-export-space results/start -o stones.solidtex-start
  solidtex-export-space results/rocks --material berea -o berea.solidtex
  solidtex-export-space results/beach -o beach.solidtex-space

Then: solidtex-encode photo.jpg --space stones.solidtex-space -o mine.solidtex"""


def parser() -> argparse.ArgumentParser:
    p = cli.parser("solidtex-export-space", "Write a trained texture space as one file.", EXAMPLES)
    p.add_argument("result", metavar="RESULT", type=Path, help="folder of solidtex-train-space")
    cli.add_output_arguments(p, "SPACE", SUFFIX)
    p.set_defaults(piped_suffix="")  # -o - writes what the result is
    p.add_argument("--name", help="name of the space (default: that of SPACE)")
    p.add_argument("--license", default="", help="licence of the space, an SPDX expression")
    p.add_argument("--material", metavar="NAME",
                   help="the material of an Alanov preset whose model is written")  # fmt: skip
    p.add_argument("--code", metavar="N,N,...", type=_numbers,
                   help="write the model of this code in place of a material's")  # fmt: skip
    p.add_argument("--phases", type=int, default=0, metavar="S",
                   help="random seed of the phases of periodic patterns (default: 0)"
                   )  # fmt: skip
    return p


def _numbers(text: str) -> list[float]:
    try:
        numbers = [float(part) for part in text.split(",")]
    except ValueError:
        numbers = [math.nan]
    if not all(map(math.isfinite, numbers)):
        raise argparse.ArgumentTypeError(f"found {text}, expected numbers with commas between them")
    return numbers


def export(args: argparse.Namespace) -> cli.Document:
    from solidtex_export.spaces.alanov.result import read_alanov
    from solidtex_export.spaces.result import read_config, read_space, read_start

    kind = read_config(args.result / "config.json")["kind"]
    suffixes = {"space": [SUFFIX], "start": [START_SUFFIX], "alanov": [MODEL_SUFFIX, SUFFIX]}[kind]
    if args.is_piped and not args.output.suffix:
        args.output = args.output.with_suffix(suffixes[0])
    if args.output.suffix not in suffixes:
        expected = " or ".join(f"*{suffix}" for suffix in suffixes)
        raise ResultError(f"-o: found {args.output}, expected a file named {expected}")
    if args.output.exists() and not args.force:
        raise ResultError(f"{args.output}: found an existing file, expected none (or use --force)")
    name = args.name or args.output.stem
    if args.output.suffix == MODEL_SUFFIX:
        _export_model(read_alanov(args.result), args, name)
        return cli.files(args.output)
    if args.material or args.code:
        remedy = f"; write a model to -o NAME{MODEL_SUFFIX}" if MODEL_SUFFIX in suffixes else ""
        raise ResultError(
            f"{args.result}: found --material or --code, which choose a model, for a {kind} in"
            f" {cli.output_name(args)}, expected neither{remedy}"
        )
    then_name = args.output.name if args.is_piped else args.output
    if kind == "alanov":
        result = read_alanov(args.result)
        with cli.optional_packages("solidtex-export-space", "onnx"):
            write_space(args.output, *result.encoder_space(name, args.license))
        count = len(result.photographs)
        then = f"solidtex-detect {then_name} photo.jpg --patch X,Y,W,H -o heat.png"
    elif kind == "space":
        space = read_space(args.result, name, args.license)
        with cli.optional_packages("solidtex-export-space", "onnx"):
            write_space(args.output, space.document(), space.tensors())
        count = len(space.photographs)
        then = f"solidtex-encode photo.jpg --space {then_name} -o mine.solidtex"
    else:
        start = read_start(args.result, name, args.license)
        write_start(args.output, start)
        count = len(start.document.photographs)
        then = f"solidtex-train photo.jpg --start {then_name} -o results/mine"
    size = args.output.stat().st_size / 2**20
    print(f"{cli.output_name(args)}: {count} photographs, {size:.1f} MiB")
    cli.say(f"next: {then}")
    return cli.files(args.output)


def _export_model(result: AlanovResult, args: argparse.Namespace, name: str) -> None:
    """Write the model of one code, verified against the network."""
    import torch

    from solidtex_export.export.verification.model_output import summary, write_verified

    if args.code:
        code = torch.tensor(args.code)
        if len(code) != result.recipe.code:
            raise ResultError(f"--code: found {len(code)} numbers, expected {result.recipe.code}")
    else:
        code = result.codes[result.index_of(args.material)]
    model, network = result.verifiable_model(name, args.license, code, args.phases)
    found = write_verified(args.output, model, network)
    print(f"{cli.output_name(args)}: {summary(args.output, model, found)}")


def main(arguments: list[str] | None = None) -> int:
    failures = (*cli.FAILURES, ResultError, SpaceError, SettingsError, WeightsError)
    return cli.run(parser(), arguments, export, failures)


if __name__ == "__main__":
    sys.exit(main())
