#!/usr/bin/env python3
"""Pictures of a texture space: encoded photographs, a walk between materials, and a map of all.

The walk is a strip of slices of the models that solidtex-mix --animate writes. The map shows a
slice of every training photograph's model at the two principal axes of the codes, or where UMAP
places them, each moved to the nearest free place of a grid. From the repository, built:
.venv/bin/python benchmarks/space_pictures.py models/stones.solidtex-space Granite_001 Rock_020
"""

from __future__ import annotations

import argparse
import json
import re
import subprocess
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image, ImageDraw
from safetensors import safe_open
from safetensors.numpy import load_file
from scipy.optimize import linear_sum_assignment

from solidtex import Texture

BINARIES = Path(__file__).resolve().parent.parent / "build" / "bin"
ASPECT = 1.4  # of the map
GAP = 3  # pixels between slices
WHITE = (255, 255, 255)
QUALITY = 88


def main() -> None:
    args = options()
    space, name = args.space, args.space.name.split(".")[0]
    args.output.mkdir(parents=True, exist_ok=True)
    along_z = document_of(space)["directions"] == "xy"
    if args.walk:
        places = [f"{space}:{photograph}" for photograph in args.walk]
        save(strip(places, args, along_z), args.output / f"walk-{name}.jpg")
    if args.encoded:
        save(pairs(space, args.encoded, args.size, along_z), args.output / f"encoded-{name}.jpg")
    if args.only_encoded:
        return
    codes = load_file(space)["codes"]
    names = photographs(space)
    save(chart(space, names, codes, args, along_z), args.output / f"map-{name}.jpg")


def options() -> argparse.Namespace:
    p = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    p.add_argument("space", type=Path, metavar="SPACE", help="a .solidtex-space file")
    p.add_argument("walk", nargs="*", metavar="PHOTOGRAPH", help="training photographs to visit")
    p.add_argument("--encoded", nargs="+", type=Path, default=[], metavar="FILE",
                   help="photographs to encode; each is shown beside a slice")  # fmt: skip
    p.add_argument("--only-encoded", action="store_true", help="make no map")
    p.add_argument("-o", "--output", type=Path, default=Path("docs/images/spaces"))
    p.add_argument("--models", type=int, default=9, help="number of models of the walk")
    p.add_argument("--size", type=int, default=128, help="side of the walk's slices, in texels")
    p.add_argument("--tile", type=int, default=48, help="side of the map's slices, in texels")
    p.add_argument("--projection", choices=("pca", "umap"), default="pca",
                   help="umap needs the package umap-learn")  # fmt: skip
    return p.parse_args()


@contextmanager
def models(
    materials: Sequence[str], count: int, places: Sequence[Sequence[float]] = ()
) -> Iterator[list[Path]]:
    """The models of a walk through materials of a space, or through `places`: their weights."""
    with tempfile.TemporaryDirectory() as folder:
        output = Path(folder) / "model-######.solidtex"
        command = [BINARIES / "solidtex-mix", *materials, "--animate", str(count), "-o", output]
        for weights in places:
            command += ["--weights", ",".join(str(w) for w in weights)]
        subprocess.run(command, check=True)
        yield sorted(Path(folder).iterdir())


def document_of(space: Path) -> dict[str, Any]:
    with safe_open(space, "numpy") as file:
        document: dict[str, Any] = json.loads(file.metadata()["solidtex-space"])
    return document


def photographs(space: Path) -> list[str]:
    return [photograph["name"] for photograph in document_of(space)["photographs"]]


def slice_of(model: Path, size: int, along_z: bool) -> Image.Image:
    """A slice through x and y, or through x and z, which shows the grain of wood upright."""
    box = (size, 1, size) if along_z else (size, size, 1)
    values = Texture(str(model)).eval_box((0, 0, 0), box).reshape(size, size, -1)[..., :3]
    values = values.transpose(1, 0, 2)[::-1]
    return Image.fromarray((255 * np.clip(values, 0, 1)).round().astype(np.uint8))


def pairs(space: Path, photos: Sequence[Path], size: int, along_z: bool) -> Image.Image:
    """Photographs at the space's resolution, each beside a slice of its encoded model."""
    resolution = document_of(space)["resolution"]
    columns = 4
    rows = -(-len(photos) // columns)
    sheet = Image.new("RGB", (columns * (2 * size + 4 * GAP), rows * (size + GAP)), WHITE)
    with tempfile.TemporaryDirectory() as folder:
        for i, photo in enumerate(photos):
            model = Path(folder) / f"{i}.solidtex"
            command = [BINARIES / "solidtex-encode", photo, "--space", space, "-o", model]
            subprocess.run(command, check=True)
            x, y = i % columns * (2 * size + 4 * GAP), i // columns * (size + GAP)
            sheet.paste(reduced(photo, resolution).crop((0, 0, size, size)), (x, y))
            sheet.paste(slice_of(model, size, along_z), (x + size + GAP, y))
    return sheet


def reduced(photo: Path, resolution: int) -> Image.Image:
    """The photograph with a shorter side of at most `resolution` pixels."""
    image = Image.open(photo).convert("RGB")
    share = min(1.0, resolution / min(image.size))
    return image.resize(tuple(round(share * side) for side in image.size))


def strip(materials: Sequence[str], args: argparse.Namespace, along_z: bool) -> Image.Image:
    count, size = args.models, args.size
    with models(materials, count) as files:
        sheet = Image.new("RGB", (count * (size + GAP) - GAP, size), WHITE)
        for i, model in enumerate(files):
            sheet.paste(slice_of(model, size, along_z), (i * (size + GAP), 0))
    return sheet


def plane_of(codes: np.ndarray, projection: str) -> np.ndarray:
    """Places [material, 2] of the codes, each coordinate by its rank from 0 to 1."""
    if projection == "umap":
        from umap import UMAP  # optional: slow to import

        places = UMAP(random_state=0).fit_transform(codes)
    else:
        centered = codes - codes.mean(0)
        _, lengths, axes = np.linalg.svd(centered, full_matrices=False)
        shares = lengths**2 / np.sum(lengths**2)
        print(f"the two principal axes have {shares[:2].sum():.0%} of the codes' variance")
        places = centered @ axes[:2].T
    return np.argsort(np.argsort(places, axis=0), axis=0) / max(1, len(codes) - 1)


def grid_places(places: np.ndarray) -> tuple[np.ndarray, int, int]:
    """The nearest free cell [material, 2] of a grid, and its columns and rows."""
    columns = int(np.ceil(np.sqrt(ASPECT * len(places))))
    rows = -(-len(places) // columns)
    cells = np.array([(x, y) for y in range(rows) for x in range(columns)])
    wanted = places * (columns - 1, rows - 1)
    distances = ((wanted[:, None] - cells[None]) ** 2).sum(-1)
    return cells[linear_sum_assignment(distances)[1]], columns, rows


def chart(
    space: Path, names: Sequence[str], codes: np.ndarray, args: argparse.Namespace, along_z: bool
) -> Image.Image:
    cells, columns, rows = grid_places(plane_of(codes, args.projection))
    label = 11
    width, height = args.tile + GAP, args.tile + GAP + label
    sheet = Image.new("RGB", (columns * width, rows * height), WHITE)
    draw = ImageDraw.Draw(sheet)
    with models([f"{space}:{name}" for name in names], len(names)) as files:
        for name, model, (x, y) in zip(names, files, cells, strict=True):
            corner = (int(x) * width, int(y) * height)
            sheet.paste(slice_of(model, args.tile, along_z), corner)
            kind = re.match(r"[^\W\d_]*", name).group().lower()  # type: ignore[union-attr]
            draw.text((corner[0], corner[1] + args.tile), kind[:9], fill=(90, 90, 90))
    return sheet


def save(image: Image.Image, path: Path) -> None:
    image.save(path, quality=QUALITY)
    print(path)


if __name__ == "__main__":
    main()
