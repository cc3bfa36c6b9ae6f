#!/usr/bin/env python3
"""Error of footprints with axes against true means (docs/experiments/footprint-axes.md).

For parallelograms at random angles, one half-axis `width` texels and the other `aspect` times as
long: how far their means deviate from the mean of all, the error of a cube of the same area, of
eight points at random in the parallelogram, and of the three axes, as root mean squares over the
deviation of the texture; then the processor time of a cube's and of a parallelogram's lookup, in
microseconds, when the bricks are there. From the repository, built:
.venv/bin/python benchmarks/measure_footprints.py granite-grey ...
"""

from __future__ import annotations

import time

import numpy as np
from measure_filtering import (
    deviation_of,
    from_light,
    light_mean,
    textures_asked_for,
    to_light,
)

from solidtex import Texture

WIDTHS = (0.5, 1.0, 2.0, 4.0)
ASPECTS = (1, 4, 16)
PLACES = 80
SPREAD = 200.0  # texels: side of the cube that the places are in
RANDOM = 8
TIMED = 64  # times that the places are looked up


def main() -> None:
    print("| model | width | aspect | deviation | cube | 8 random | axes | cube µs | axes µs |")
    print("|---|---|---|---|---|---|---|---|---|")
    for name, texture in textures_asked_for(__doc__):
        for width in WIDTHS:
            for aspect in ASPECTS:
                print(f"| {name} | {width:g} | {aspect} | {row(texture, width, aspect)} |")


def row(texture: Texture, width: float, aspect: int) -> str:
    rng = np.random.default_rng(round(100 * width) + aspect)
    deviation = deviation_of(texture, rng.uniform(0, SPREAD, (1024, 3)))
    places = rng.uniform(0, SPREAD, (PLACES, 3)).astype(np.float32)
    axes = np.stack([random_axes(width, aspect, rng) for _ in range(PLACES)])
    radii = np.full(PLACES, width * np.sqrt(aspect))
    true = np.stack([true_mean(texture, *each, rng) for each in zip(places, axes, strict=True)])
    found = [
        texture.eval_points(places, radii=radii),
        mean_of_random(texture, places, axes, rng),
        texture.eval_points(places, axes=axes),
    ]
    errors = [np.sqrt(np.square(values - true).mean()) / deviation for values in found]
    own = np.sqrt(np.var(true, axis=0).mean()) / deviation
    times = [
        time_of(texture, places, radii=radii),
        time_of(texture, places, axes=axes),
    ]
    return " | ".join([f"{value:.2f}" for value in (own, *errors)] + [f"{t:.2g}" for t in times])


def random_axes(width: float, aspect: int, rng: np.random.Generator) -> np.ndarray:
    directions, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    return directions * np.array([[width * aspect], [width], [0.0]])


def true_mean(
    texture: Texture, place: np.ndarray, axes: np.ndarray, rng: np.random.Generator
) -> np.ndarray:
    """Mean over a jittered grid, at most two thirds of a texel apart on small footprints."""
    lengths = np.linalg.norm(axes, axis=1)
    counts = np.clip(np.ceil(3 * lengths), 4, 96).astype(int) * (lengths > 0) + (lengths == 0)
    cells = np.stack(np.meshgrid(*[np.arange(n) for n in counts], indexing="ij"), -1)
    places = (cells.reshape(-1, 3) + rng.random((counts.prod(), 3))) / counts * 2 - 1
    return light_mean(texture.eval_points(places @ axes, place))


def mean_of_random(
    texture: Texture, places: np.ndarray, axes: np.ndarray, rng: np.random.Generator
) -> np.ndarray:
    values = []
    for _ in range(RANDOM):
        steps = np.einsum("pi,pik->pk", rng.uniform(-1, 1, places.shape), axes)
        values.append(to_light(texture.eval_points(places + steps)))
    return from_light(np.mean(values, axis=0))


def time_of(texture: Texture, places: np.ndarray, **footprints: np.ndarray) -> float:
    many = np.tile(places, (TIMED, 1))
    all_of_them = {name: np.concatenate([each] * TIMED) for name, each in footprints.items()}
    started = time.process_time()
    texture.eval_points(many, **all_of_them)
    return 1e6 * (time.process_time() - started) / len(many)


if __name__ == "__main__":
    main()
