"""Writes the solid of docs/porous-media.md of three phases, and the section that is learned.

benchmarks/three_phases.py -o FOLDER

FOLDER/original.tif is 256^3 voxels of 0 (pore), 1 (binder) and 2 (particle) that PoreSpy makes,
FOLDER/section.tif its middle slice across z.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
import porespy
import tifffile

SHAPE = [256, 256, 256]


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("-o", dest="folder", type=Path, metavar="FOLDER", required=True)
    args = parser.parse_args()
    args.folder.mkdir(parents=True, exist_ok=True)
    pore = porespy.generators.blobs(SHAPE, porosity=0.36, blobiness=2.0, seed=1)
    binder = porespy.generators.blobs(SHAPE, porosity=0.27, blobiness=3.0, seed=2) & ~pore
    solid = np.where(pore, 0, np.where(binder, 1, 2)).astype(np.uint8)
    tifffile.imwrite(args.folder / "original.tif", solid, photometric="minisblack")
    tifffile.imwrite(args.folder / "section.tif", solid[128], photometric="minisblack")


if __name__ == "__main__":
    main()
