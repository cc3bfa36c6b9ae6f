"""Writes volumes of porous media for alanov-porous: two micro-CT rocks, three of PoreSpy.

benchmarks/porous_volumes.py POROUS -o FOLDER [--reduce N]

POROUS holds berea.zip and ketton.zip. The three media of PoreSpy stand for the rocks of Alanov et
al. 2019 that are not there. Their porosities are nominal ones of those rocks. Label 0 is pore.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path

import numpy as np
import porespy
import tifffile
from permeability import read_pores

SIZE = 256
ROCKS = ("berea", "ketton")


def bentheimer(seed: int) -> np.ndarray:
    return porespy.generators.blobs([SIZE] * 3, porosity=0.22, blobiness=2.0, seed=seed)


def doddington(seed: int) -> np.ndarray:
    """Grains are spheres that overlap."""
    return porespy.generators.overlapping_spheres([SIZE] * 3, r=14, porosity=0.20, seed=seed)


def estaillades(seed: int) -> np.ndarray:
    """Large pores and small ones."""
    large = porespy.generators.blobs([SIZE] * 3, porosity=0.09, blobiness=1.2, seed=seed)
    small = porespy.generators.blobs([SIZE] * 3, porosity=0.045, blobiness=4.0, seed=seed + 1)
    return large | small


SYNTHETIC: dict[str, Callable[[int], np.ndarray]] = {
    "bentheimer-blobs": bentheimer,
    "doddington-spheres": doddington,
    "estaillades-blobs": estaillades,
}


def reduced(pore: np.ndarray, factor: int) -> np.ndarray:
    """Cubes of `factor`^3 voxels become one: those with most grain are grain, at equal porosity."""
    sides = [extent // factor for extent in pore.shape]
    grain = ~pore[tuple(slice(factor * side) for side in sides)]
    shares = grain.reshape([n for side in sides for n in (side, factor)]).mean((1, 3, 5))
    shares += np.random.default_rng(0).uniform(-0.01, 0.01, shares.shape)  # there are ties
    return shares <= np.quantile(shares, 1 - grain.mean())


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("porous", type=Path, metavar="POROUS")
    parser.add_argument("-o", dest="folder", type=Path, metavar="FOLDER", required=True)
    parser.add_argument("--reduce", type=int, default=1, metavar="N",
                        help="make one voxel of N^3 (default: 1)")  # fmt: skip
    args = parser.parse_args()
    args.folder.mkdir(parents=True, exist_ok=True)
    pores = {name: read_pores(args.porous / f"{name}.zip").T for name in ROCKS}
    pores |= {name: make(seed=10 + i) for i, (name, make) in enumerate(SYNTHETIC.items())}
    for name, whole in pores.items():
        pore = reduced(whole, args.reduce) if args.reduce > 1 else whole
        path = args.folder / f"{name}.tif"
        tifffile.imwrite(path, np.where(pore, 0, 255).astype(np.uint8), photometric="minisblack")
        print(f"{path}: {pore.shape}, porosity {pore.mean():.4f}")


if __name__ == "__main__":
    main()
