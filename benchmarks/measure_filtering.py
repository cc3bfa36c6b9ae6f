#!/usr/bin/env python3
"""Error of filtered lookups against true means (docs/experiments/filtering-accuracy.md).

For cubes of several edges in each model: how far their means deviate from the mean of all, the
error of one plain lookup in the middle, of one and of four at random in the cube, and of the
filtered one, as root mean squares over the deviation of the texture. Means are those of light; what
is compared is sRGB. From the repository, built:
.venv/bin/python benchmarks/measure_filtering.py granite-grey ...
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from solidtex import Texture

REPOSITORY = Path(__file__).resolve().parents[1]
RADII = (0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0)
PLACES = 160
SPREAD = 4000.0  # texels: side of the cube that the places are in
SAMPLES = 4


def main() -> None:
    print("| model | edge | deviation | plain | random | 4 random | filtered |")
    print("|---|---|---|---|---|---|---|")
    for name, texture in textures_asked_for(__doc__):
        for radius in RADII:
            print(row(name, texture, radius))


def textures_asked_for(doc: str) -> Iterator[tuple[str, Texture]]:
    """Open the models of the command line one after another."""
    parser = argparse.ArgumentParser(description=doc.splitlines()[0])
    parser.add_argument("model", nargs="+", help="a file, or the name of a shipped model")
    for name in parser.parse_args().model:
        with Texture(model_path(name)) as texture:
            yield name, texture


def deviation_of(texture: Texture, places: np.ndarray) -> float:
    """Standard deviation of the texture, root mean square over the channels."""
    return np.sqrt(np.var(texture.eval_points(places), axis=0).mean())


def row(name: str, texture: Texture, radius: float) -> str:
    rng = np.random.default_rng(round(8 * radius))
    deviation = deviation_of(texture, rng.uniform(0, SPREAD, (4096, 3))[:1024])
    places = rng.integers(0, SPREAD, (PLACES, 3)) + 0.25
    true = np.stack([true_mean(texture, p, radius, rng) for p in places])
    found = {
        "plain": texture.eval_points(places),
        "random": means_of(texture, places, radius, 1, rng),
        "4 random": means_of(texture, places, radius, SAMPLES, rng),
        "filtered": texture.eval_points(places, radii=radius),
    }
    errors = [np.sqrt(np.square(v - true).mean()) / deviation for v in found.values()]
    own = np.sqrt(np.var(true, axis=0).mean()) / deviation
    return (
        f"| {name} | {2 * radius:g} | {own:.2f} | " + " | ".join(f"{e:.2f}" for e in errors) + " |"
    )


def model_path(name: str) -> str:
    shipped = REPOSITORY / "models" / f"{name}.solidtex"
    return str(shipped) if shipped.exists() else name


def true_mean(texture: Texture, place: np.ndarray, radius: float, rng) -> np.ndarray:
    """Mean over a cube: of stratified points, or of voxels for large cubes."""
    if radius <= 8:
        side = 12
        cells = np.stack(np.meshgrid(*[np.arange(side)] * 3, indexing="ij"), -1).reshape(-1, 3)
        offsets = (cells + rng.random(cells.shape)) / side * 2 * radius - radius
        return light_mean(texture.eval_points(offsets, place))
    low = np.floor(place - radius).astype(int)
    size = round(2 * radius)
    return light_mean(texture.eval_box(low, (size,) * 3))


def means_of(texture: Texture, places: np.ndarray, radius: float, count: int, rng) -> np.ndarray:
    values = [
        texture.eval_points(places + rng.uniform(-radius, radius, places.shape))
        for _ in range(count)
    ]
    return from_light(np.mean([to_light(v) for v in values], axis=0))


def light_mean(values: np.ndarray) -> np.ndarray:
    axes = tuple(range(values.ndim - 1))
    return from_light(to_light(values).mean(axes, dtype=np.float64))


def to_light(encoded: np.ndarray) -> np.ndarray:
    """Exact sRGB decoding, not the library's square root."""
    c = np.clip(encoded.astype(np.float64), 0, None)
    return np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4)


def from_light(light: np.ndarray) -> np.ndarray:
    return np.where(light <= 0.0031308, light * 12.92, 1.055 * light ** (1 / 2.4) - 0.055)


if __name__ == "__main__":
    started = time.process_time()
    main()
    print(f"{time.process_time() - started:.0f} s of processor time", file=sys.stderr)
