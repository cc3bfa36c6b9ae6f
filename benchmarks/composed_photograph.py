"""One photograph of several materials with known borders, for detection and for algorithm 1.

benchmarks/composed_photograph.py A.jpg B.jpg C.jpg D.jpg --cell 256 -o composed.png

A square number of photographs become the cells of a square, row by row, each reduced to the size of
a cell and cut to its upper left part.
"""

from __future__ import annotations

import argparse
import math
from pathlib import Path

import numpy as np
from PIL import Image


def cell(path: Path, side: int) -> np.ndarray:
    image = Image.open(path).convert("RGB")
    scale = side / min(image.size)
    size = [max(side, round(scale * length)) for length in image.size]
    return np.asarray(image.resize(size, Image.Resampling.LANCZOS))[:side, :side]


def main() -> None:
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    p.add_argument("photos", nargs="+", type=Path)
    p.add_argument("-o", dest="output", type=Path, required=True)
    p.add_argument("--cell", type=int, default=256, help="side of a cell in pixels (default: 256)")
    args = p.parse_args()
    columns = math.isqrt(len(args.photos))
    if columns**2 != len(args.photos):
        p.error(f"found {len(args.photos)} photographs, expected a square number")
    cells = [cell(photo, args.cell) for photo in args.photos]
    rows = [np.hstack(cells[i : i + columns]) for i in range(0, len(cells), columns)]
    Image.fromarray(np.vstack(rows)).save(args.output)


if __name__ == "__main__":
    main()
