"""How far do boundaries move the permeability of a cube that is cut from a larger medium?

benchmarks/permeability_boundaries.py [--media N] [--size N] [--threads N]

Every medium is periodic: blobs, the pores of a smoothed noise. So the permeability of one period
with the boundary "periodic" has no error of a boundary. Its eight octants are measured with either
boundary, as volumes from a scanner are; rows are the means over their values, relative to that of
the period.
"""

from __future__ import annotations

import argparse
import itertools

import numpy as np
from scipy import ndimage

from solidtex import transport

POROSITIES = (0.2, 0.25, 0.35)
WIDTH = 2.5  # deviation of the filter, in voxels: mean chords of pores have 6 to 8


def blobs(size: int, porosity: float, seed: int) -> np.ndarray:
    noise = np.random.default_rng(seed).standard_normal((size, size, size), np.float32)
    smooth = ndimage.gaussian_filter(noise, WIDTH, mode="wrap")
    return smooth < np.quantile(smooth, porosity)


def octants(pores: np.ndarray) -> list[np.ndarray]:
    half = len(pores) // 2
    parts = (slice(half), slice(half, None))
    return [np.ascontiguousarray(pores[at]) for at in itertools.product(parts, repeat=3)]


def compared(pores: np.ndarray, threads: int) -> tuple[float, float, float]:
    """The permeability of the period along x, and the means of its octants relative to it."""

    def of(part: np.ndarray, boundary: transport.Boundary) -> float:
        return transport.permeability(part, 0, boundary, threads=threads).value

    whole = of(pores, "periodic")
    parts = octants(pores)
    means = [np.mean([of(part, b) for part in parts]) / whole for b in ("open", "periodic")]
    return whole, float(means[0]), float(means[1])


def main() -> None:
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    p.add_argument("--media", type=int, default=3, help="of each porosity (default: 3)")
    p.add_argument("--size", type=int, default=160, help="voxels of a period (default: 160)")
    p.add_argument("--threads", type=int, default=0, help="0: one per core (default)")
    args = p.parse_args()
    print("| porosity | medium | period, voxels² | octants, open | octants, periodic |")
    print("|---|---|---|---|---|")
    for porosity, seed in itertools.product(POROSITIES, range(args.media)):
        whole, opened, repeated = compared(blobs(args.size, porosity, seed), args.threads)
        print(f"| {porosity} | {seed} | {whole:.4g} | {opened:.2f} | {repeated:.2f} |", flush=True)


if __name__ == "__main__":
    main()
