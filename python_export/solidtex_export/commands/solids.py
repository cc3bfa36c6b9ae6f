"""solidtex-solids: writes exemplars cut from analytic solids."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np

from solidtex_export.commands import cli
from solidtex_export.images.channels import COLOR
from solidtex_export.research.solids.materials import SOLIDS
from solidtex_export.research.solids.solid import Solid, end_section, exemplar, write_picture

PROGRAM = "solidtex-solids"
EXAMPLES = f"""  {PROGRAM} marble -o exemplars
  {PROGRAM} all --size 320,240 --seed 3 -o exemplars

A solid with maps gives one image per map: grains.png, grains-roughness.png, grains-height.png.
solidtex-train exemplars/grains.png --map roughness=exemplars/grains-roughness.png ...
One that looks different along z gives a section normal to z too: wood.png, wood-z.png.
solidtex-train exemplars/wood.png exemplars/wood.png exemplars/wood-z.png ..."""


def main(arguments: list[str] | None = None) -> int:
    p = cli.parser(PROGRAM, "Cut exemplars from analytic solids.", EXAMPLES)
    p.add_argument("solid", choices=[*SOLIDS, "all"])
    p.add_argument("-o", dest="folder", metavar="FOLDER", type=Path, required=True,
                   help="folder for the exemplars")  # fmt: skip
    p.add_argument("--size", type=size, default=(256, 256), metavar="N|WIDTH,HEIGHT",
                   help="size in pixels; one pixel is one texel (default: 256)")  # fmt: skip
    p.add_argument("--seed", type=int, default=0, metavar="S", help="random seed (default: 0)")
    p.add_argument("--force", action="store_true", help="replace images that exist")
    return cli.run(p, arguments, cut)


def size(text: str) -> tuple[int, int]:
    width, _, height = text.partition(",")
    values = int(width), int(height or width)
    if min(values) < 1:
        raise argparse.ArgumentTypeError(f"found {text}, expected pixels, such as 256 or 320,240")
    return values


def cut(args: argparse.Namespace) -> cli.Document:
    names = list(SOLIDS) if args.solid == "all" else [args.solid]
    args.folder.mkdir(parents=True, exist_ok=True)
    written = []
    for name in names:
        for stem, values in pictures(name, SOLIDS[name](args.seed), args.size).items():
            written.append(args.folder / f"{stem}.png")
            write_picture(written[-1], values, args.force)
    return cli.files(*written)


def pictures(name: str, solid: Solid, size: tuple[int, int]) -> dict[str, np.ndarray]:
    """Images by the stems of their files."""
    width, height = size
    picture = exemplar(solid, height, width)
    found = {name: picture[..., : len(COLOR)]}
    for index, channel in enumerate(solid.channels[len(COLOR) :], len(COLOR)):
        found[f"{name}-{channel}"] = picture[..., index]
    if solid.directions == "xy":
        found[f"{name}-z"] = end_section(solid, height, width)[..., : len(COLOR)]
    return found


if __name__ == "__main__":
    sys.exit(main())
