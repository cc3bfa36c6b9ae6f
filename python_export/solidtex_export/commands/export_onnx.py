"""solidtex-export-onnx: converts a `.solidtex` model to an ONNX graph."""

from __future__ import annotations

import argparse
import sys

from solidtex_export.commands import cli
from solidtex_export.export.file_format import model_file
from solidtex_export.export.file_format.model_file import ModelFile
from solidtex_export.export.places import check_box
from solidtex_export.export.verification.model_output import OutputError, check_output
from solidtex_export.generators.lattice import Box
from solidtex_export.whole_file import write_whole

PROGRAM = "solidtex-export-onnx"
MAX_SIZE = 4096
DEFAULT_SIZE = (64, 64, 64)
DEFAULT_ORIGIN = (0, 0, 0)

Triple = tuple[int, int, int]

EXAMPLES = f"""  {PROGRAM} granite.solidtex --size 64 -o granite.onnx
  {PROGRAM} granite.solidtex --size 128,128,32 --origin=-5,0,7 -o slab.onnx
  {PROGRAM} wood.solidtex -o wood.onnx
docs/onnx.md describes the inputs."""


def main(arguments: list[str] | None = None) -> int:
    return cli.run(make_parser(), arguments, export)


def make_parser() -> argparse.ArgumentParser:
    p = cli.parser(
        PROGRAM,
        "Export a model as ONNX. A lattice becomes a graph from noise to the voxels of one block,"
        " with fixed sizes. A sampler becomes the bare network from octave noise to colors, for any"
        " number of points.",
        EXAMPLES,
    )
    cli.add_model_argument(p)
    p.add_argument("--size", metavar="N|X,Y,Z", type=size,
                   help="lattice family: voxels along each axis (default 64)")  # fmt: skip
    p.add_argument("--origin", metavar="X,Y,Z", type=triple,
                   help="lattice family: first voxel (default 0,0,0); the graph also serves origins"
                   " that differ by multiples of the coarsest voxel, usually 32")  # fmt: skip
    cli.add_output_arguments(p, "ONNX", ".onnx")
    return p


def export(args: argparse.Namespace) -> cli.Document:
    check_output(args.output, args.force, ".onnx")
    model = model_file.read(args.model)
    box = block(args, model)
    try:
        from solidtex_export.export.onnx.model import onnx_model
    except ModuleNotFoundError as error:
        raise OutputError(
            f"{args.output}: found no Python package {error.name!r}, expected it (pip install onnx)"
        ) from error
    data = onnx_model(model, box).SerializeToString()
    write_whole(args.output, data)
    print(f"{cli.output_name(args)}: {len(data)} bytes, {describe(box)}")
    return cli.files(args.output)


def block(args: argparse.Namespace, model: ModelFile) -> Box | None:
    """Box of voxels to compute; None for the sampler family, which computes points."""
    if model.document["family"] == "field":
        lo, extent = args.origin or DEFAULT_ORIGIN, args.size or DEFAULT_SIZE
        try:
            check_box(lo, extent)
        except ValueError as error:
            raise OutputError(f"--{error}") from error
        return Box(lo, tuple(l + e for l, e in zip(lo, extent, strict=True)))
    for option in ("size", "origin"):
        if getattr(args, option) is not None:
            raise OutputError(
                f"--{option}: found it with {args.model}, expected a model of the lattice family;"
                " the sampler family takes any number of points"
            )
    return None


def describe(box: Box | None) -> str:
    return f"voxels {box.lo} to {box.hi}" if box else "any number of points"


def size(text: str) -> Triple:
    values = triple(text if "," in text else ",".join([text] * 3))
    if not all(1 <= value <= MAX_SIZE for value in values):
        raise argparse.ArgumentTypeError(f"found {text}, expected 1 to {MAX_SIZE} along each axis")
    return values


def triple(text: str) -> Triple:
    try:
        x, y, z = map(int, text.split(","))
    except ValueError as error:
        raise argparse.ArgumentTypeError(f"found {text}, expected integers X,Y,Z") from error
    return x, y, z


if __name__ == "__main__":
    sys.exit(main())
