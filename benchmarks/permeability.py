"""Prints the tables of docs/porous-media.md: solidtex.transport beside known permeabilities.

    python benchmarks/permeability.py                                    # seconds
    python benchmarks/permeability.py --volume berea-200.npz --axes xyz  # minutes
    python benchmarks/permeability.py --volume berea.tif --axes x        # tens of minutes

Without a volume: slits, ducts and tubes beside exact laws. Seconds are processor time. The
volume is Berea sandstone: a TIFF stack, or a .zip of it, that is 0 where there is a pore, or an NPZ
archive whose array "im" is true there.
"""

import argparse
import math
import time
import zipfile
from pathlib import Path

import numpy as np

from solidtex import transport
from solidtex_export.measuring.transport import SQUARE_METERS_PER_DARCY

# Whole Berea of 400^3 voxels of 5.345 um (Imperial College London), as OpenPNM's tests state them.
# x is the last axis of the stored array, as in a TIFF stack: the formation factors tell.
BEREA = {
    "permeability": dict(zip("xyz", (1360, 1304, 1193), strict=True)),
    "formation factor": dict(zip("xyz", (23.12, 23.99, 25.22), strict=True)),
}


def row(*cells: object) -> None:
    print("| " + " | ".join(f"{c:.5g}" if isinstance(c, float) else str(c) for c in cells) + " |",
          flush=True)  # fmt: skip


def compare(name: str, found: float, exact: float, steps: int) -> None:
    row(name, found, exact, f"{100 * (found / exact - 1):+.2f} %", steps)


def analytic_rows() -> None:
    row("channel", "solver", "exact", "difference", "steps")
    row(*["---"] * 5)
    for width in (1, 2, 5, 10, 20):
        section = np.zeros((width + 2, 1), bool)
        section[1:-1] = True
        flow(f"slit, {width} voxels", section, width**3 / 12 / (width + 2))
    for period, width in ((12, 2), (12, 3), (12, 4), (16, 6), (24, 12)):
        x, y = np.ogrid[:period, :period]
        section = (x - y) % period < width  # voxels of the diagonal are sqrt(1/2) apart
        exact = width**2 / 2 / 12 * width / period
        flow(f"slit at 45°, {width / math.sqrt(2):.1f} voxels", section, exact)
    for a, b in ((4, 4), (8, 8), (8, 12)):
        terms = sum(math.tanh(n * math.pi * b / 2 / a) / n**5 for n in range(1, 200, 2))
        exact = a**3 * b / 12 * (1 - 192 * a / math.pi**5 / b * terms)
        flow(f"duct, {a} x {b}", np.pad(np.ones((a, b), bool), 1), exact / (a + 2) / (b + 2))
    for radius in (4, 8, 12, 16, 24):
        section, exact = tube(radius)
        flow(f"tube, radius {radius}", section, exact)


def tube(radius: int) -> tuple[np.ndarray, float]:
    """Section of a tube, and its permeability by Poiseuille's law at the area it has in voxels."""
    side = 2 * radius + 3
    at = np.arange(side) - (side - 1) / 2
    section = np.hypot(*np.meshgrid(at, at)) < radius
    return section, np.count_nonzero(section) ** 2 / (8 * math.pi) / side**2


def flow(name: str, section: np.ndarray, exact: float) -> None:
    found = transport.permeability(np.repeat(section[None], 3, 0), 0, "periodic", tolerance=1e-3)
    compare(name, found.value, exact, found.steps)


def read_pores(path: Path) -> np.ndarray:
    """Pores [x][y][z]. Files store them [z][y][x]."""
    if path.suffix == ".npz":
        return np.ascontiguousarray(np.load(path)["im"].astype(bool).T)
    import tifffile

    if path.suffix != ".zip":
        return np.ascontiguousarray(tifffile.imread(path).T == 0)
    with zipfile.ZipFile(path) as archive:
        (name,) = (n for n in archive.namelist() if n.endswith(f"{path.stem}.tif"))
        with archive.open(name) as file:
            return np.ascontiguousarray(tifffile.imread(file).T == 0)


def millidarcy_per_square(voxel: float) -> float:
    """Millidarcy of a voxel squared; the edge of a voxel is in micrometers."""
    return (voxel * 1e-6) ** 2 / SQUARE_METERS_PER_DARCY * 1e3


def volume_rows(path: Path, args: argparse.Namespace) -> None:
    pores, boundary, threads = read_pores(path), args.boundary, args.threads
    print(f"\n{path.name}: {pores.shape}, porosity {pores.mean():.4f}, boundary {boundary}")
    row("figure", "solver", "whole Berea", "difference", "steps", "CPU seconds")
    row(*["---"] * 6)
    per_square = millidarcy_per_square(args.voxel_size)
    for name in args.axes:
        axis = "xyz".index(name)
        begin = time.process_time()
        diffusion = transport.diffusivity(pores, axis, boundary, tolerance=1e-4, threads=threads)
        volume_row("formation factor", name, 1 / diffusion.value, diffusion.steps, begin)
        begin = time.process_time()
        found = transport.permeability(
            pores, axis, boundary, threads=threads, refinement=args.refine
        )
        volume_row("permeability", name, found.value * per_square, found.steps, begin)


def volume_row(figure: str, axis: str, value: float, steps: int, begin: float) -> None:
    known = BEREA[figure][axis]
    seconds = f"{time.process_time() - begin:.0f}"
    row(f"{figure}, {axis}", value, known, f"{100 * (value / known - 1):+.1f} %", steps, seconds)


def main() -> None:
    p = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    p.add_argument("--volume", type=Path, action="append", default=[], metavar="FILE",
                   help="binary volume of Berea: .npz, .tif or a .zip of it")  # fmt: skip
    p.add_argument("--voxel-size", type=float, default=5.345, metavar="UM",
                   help="in micrometers (default: 5.345)")  # fmt: skip
    p.add_argument("--axes", default="xyz", help="axes of the volumes (default: xyz)")
    p.add_argument("--boundary", choices=("open", "periodic"), default="open",
                   help="of the volumes (default: open)")  # fmt: skip
    p.add_argument("--refine", type=int, default=1, metavar="N",
                   help="split voxels into N^3 for permeability (default: 1)")  # fmt: skip
    p.add_argument("--threads", type=int, default=0, help="0: one per core (default)")
    args = p.parse_args()
    if not args.volume:
        analytic_rows()
    for path in args.volume:
        volume_rows(path, args)


if __name__ == "__main__":
    main()
