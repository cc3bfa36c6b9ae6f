"""Tables 3 and 18 of Alanov et al. 2019: how far sampled volumes are from the data.

benchmarks/porous_kl.py RESULT VOLUMES -o FOLDER --size 160 --count 500
benchmarks/porous_kl.py --published POROUS/published

VOLUMES is the folder of the training's volumes. Figures of every sample and every crop go to
FOLDER/NAME.csv, divergences to FOLDER/divergences.csv, the model of each medium to
FOLDER/NAME.solidtex, a slice of its data above one of its samples to FOLDER/NAME.png. Label 0 is
pore. Lengths are in voxels, permeability in voxels squared.
"""

from __future__ import annotations

import argparse
import csv
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import torch
from PIL import Image

from solidtex_export.export.file_format import model_file
from solidtex_export.export.verification import engine
from solidtex_export.measuring import geometry
from solidtex_export.measuring.geometry import Mask
from solidtex_export.measuring.volumes import read_volume
from solidtex_export.measuring.voxels import VoxelSize
from solidtex_export.spaces.alanov.result import AlanovResult, read_alanov

BINS, RESAMPLES = 50, 1000
PSEUDO_COUNT = 0.01  # in every bin: otherwise one empty bin makes a divergence infinite
DISTANCE = 4096  # between samples, in texels: they share no noise
Rows = list[dict[str, float]]


def figures(pore: Mask, with_permeability: bool) -> dict[str, float]:
    """Pore volume, its surface, Euler characteristic, mean breadth and permeability along x."""
    found = {
        "volume": float(np.count_nonzero(pore)),
        "surface": geometry.specific_surface(pore) * pore.size,
        "euler": float(geometry.euler_characteristic(pore)),
        "mean_breadth": geometry.mean_breadth(pore),
    }
    for axis, name in enumerate("xyz"):
        lengths = geometry.chords(pore, axis)
        found[f"mean_chord_{name}"] = float(lengths.mean()) if len(lengths) else 0.0
    for lag in (1, 2, 4, 8, 16):
        pairs = [geometry.two_point(pore, axis)[lag] for axis in range(3)]
        found[f"two_point_{lag}"] = float(np.mean(pairs))
    if with_permeability:
        from solidtex_export.measuring.transport import measure_transport

        parts = ("permeability",)
        measured = measure_transport(pore, 0, "open", VoxelSize(1.0, "m"), parts)
        found["permeability"] = measured["permeability_m2"]
    return found


def divergence(p: np.ndarray, q: np.ndarray) -> float:
    """KL of the histograms of p and q over the range of both."""
    edges = np.histogram_bin_edges(np.concatenate([p, q]), BINS)
    shares = []
    for values in (p, q):
        counts = np.histogram(values, edges)[0] + PSEUDO_COUNT
        shares.append(counts / counts.sum())
    return float(np.sum(shares[0] * np.log(shares[0] / shares[1])))


def resampled(p: np.ndarray, q: np.ndarray) -> tuple[float, float]:
    """Divergence, and its deviation over bootstrap resamples of both."""
    rng = np.random.default_rng(0)
    found = [divergence(rng.choice(p, len(p)), rng.choice(q, len(q))) for _ in range(RESAMPLES)]
    return divergence(p, q), float(np.std(found))


def random_crops(volume: Mask, size: int, count: int, seed: int) -> list[Mask]:
    rng = np.random.default_rng(seed)
    crops = []
    for _ in range(count):
        at = [int(rng.integers(extent - size + 1)) for extent in volume.shape]
        crops.append(volume[tuple(slice(a, a + size) for a in at)])
    return crops


def pore_of_samples(path: Path, size: int, count: int) -> list[Mask]:
    """Where phase.0 is the more probable one."""
    with engine.open_model(path, 0) as texture:
        boxes = [((DISTANCE * i, 0, 0), (size,) * 3) for i in range(count)]
        return [np.asarray(texture.eval_box(*box))[..., 0] >= 0.5 for box in boxes]


def measure_medium(
    result: AlanovResult, name: str, volumes: Path, args: argparse.Namespace
) -> list[list[Any]]:
    """Rows of divergences.csv for a medium."""
    code = result.codes[result.index_of(name)]
    model = args.folder / f"{name}.solidtex"
    model_file.write(model, result.model(name, "", code, []))
    values = read_volume(volumes / f"{name}.tif").values
    data = np.asarray(values == values.min())
    sets = {
        "data": random_crops(data, args.size, args.count, 1),
        "data again": random_crops(data, args.size, args.count, 2),
        "samples": pore_of_samples(model, args.size, args.count),
    }
    tables: dict[str, Rows] = {}
    for kind, pores in sets.items():
        tables[kind] = [figures(p, i < args.permeability) for i, p in enumerate(pores)]
        print(f"{name}: {kind} measured", flush=True)
    _write(args.folder / f"{name}.csv", tables)
    middle = args.size // 2
    slices = [sets[kind][0][:, :, middle].T for kind in ("data", "samples")]
    Image.fromarray(~np.concatenate(slices)).save(args.folder / f"{name}.png")
    rows = []
    for column in tables["data"][0]:
        by_kind = {k: np.array([r[column] for r in t if column in r]) for k, t in tables.items()}
        row: list[Any] = [name, column]
        for kind in ("samples", "data again"):
            row += [f"{v:.3f}" for v in resampled(by_kind["data"], by_kind[kind])]
        row += [f"{by_kind[kind].mean():.6g}" for kind in ("data", "samples")]
        rows.append([*row, len(by_kind["data"])])
    return rows


def _write(path: Path, tables: dict[str, Rows]) -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        columns = ["kind", *next(iter(tables.values()))[0]]
        writer = csv.DictWriter(file, columns)
        writer.writeheader()
        for kind, rows in tables.items():
            writer.writerows({"kind": kind, **row} for row in rows)


def published(folder: Path) -> None:
    """Divergences of the 3D DCGAN of Mosser et al. 2017 from its data, 200^3."""
    for medium in ("berea", "ketton", "beadpack"):
        tables = []
        for kind in ("original", "dcgan"):
            path = folder / f"{medium}_200_{kind}.csv"
            with path.open(newline="", encoding="utf-8-sig") as file:
                tables.append(list(csv.DictReader(file)))
        for column in ("volume", "surface", "euler"):
            p, q = (np.array([float(row[column]) for row in table]) for table in tables)
            value, deviation = resampled(p, q)
            print(f"{medium},{column},{value:.2f},{deviation:.2f},{len(p)},{len(q)}")


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("result", type=Path, metavar="RESULT", nargs="?")
    parser.add_argument("volumes", type=Path, metavar="VOLUMES", nargs="?")
    parser.add_argument("-o", dest="folder", type=Path, metavar="FOLDER")
    parser.add_argument("--published", type=Path, metavar="FOLDER", help="CSVs of the baseline")
    parser.add_argument("--size", type=int, default=160, metavar="N", help="edge of a volume")
    parser.add_argument("--count", type=int, default=500, metavar="N", help="volumes of a kind")
    parser.add_argument("--permeability", type=int, default=0, metavar="N",
                        help="measure the permeability of the first N of them")  # fmt: skip
    parser.add_argument("--media", metavar="NAME", nargs="+", help="only these media")
    args = parser.parse_args()
    if args.published:
        return published(args.published)
    if not (args.result and args.volumes and args.folder):
        parser.error("expected RESULT, VOLUMES and -o FOLDER, or --published")
    args.folder.mkdir(parents=True, exist_ok=True)
    torch.set_num_threads(1)
    result = read_alanov(args.result)
    result.measure()
    names: Sequence[str] = args.media or [record["name"] for record in result.photographs]
    head = ["medium", "figure", "divergence", "deviation", "of data", "deviation of data"]
    with (args.folder / "divergences.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow([*head, "mean of data", "mean of samples", "volumes"])
        for name in names:
            writer.writerows(measure_medium(result, name, args.volumes, args))
            file.flush()
    print(f"{args.folder / 'divergences.csv'}", file=sys.stderr)


if __name__ == "__main__":
    main()
