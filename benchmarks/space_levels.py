#!/usr/bin/env python3
"""Correlation of models at neighboring levels between two materials (docs/spaces-walk.md).

For pairs of training photographs and numbers of steps between them: how the values of the two
models around the middle correlate, at points of a cube at a distance from the origin. From the
repository, built: .venv/bin/python benchmarks/space_levels.py models/stones.solidtex-space
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from space_pictures import models, photographs

from solidtex import Texture

STEPS = (1, 2, 4, 8, 16)
DISTANCES = (0, 128, 512, 2048)  # texels
PAIRS = 6
CUBE, POINTS = 24.0, 2000  # half the edge of the cube, in texels


def main() -> None:
    space = Path(sys.argv[1])
    names = photographs(space)
    rng = np.random.default_rng(0)
    pairs = [rng.choice(names, 2, replace=False) for _ in range(PAIRS)]
    print("| steps | " + " | ".join(f"{d} texels away" for d in DISTANCES) + " |")
    print("|---" * (len(DISTANCES) + 1) + "|")
    for steps in STEPS:
        rows = [correlations(space, pair, steps, i) for i, pair in enumerate(pairs)]
        print(f"| {steps} | " + " | ".join(f"{c:.2f}" for c in np.mean(rows, axis=0)) + " |")


def correlations(space: Path, pair: np.ndarray, steps: int, seed: int) -> list[float]:
    materials = [f"{space}:{name}" for name in pair]
    halves = [0.5 - 0.5 / steps, 0.5 + 0.5 / steps]
    with models(materials, 2, [(1 - t, t) for t in halves]) as files:
        textures = [Texture(str(file)) for file in files]
    rng = np.random.default_rng(seed)
    direction = rng.normal(size=3)
    direction /= np.linalg.norm(direction)
    found = []
    for distance in DISTANCES:
        offsets = rng.uniform(-CUBE, CUBE, (POINTS, 3))
        points = (distance * direction + offsets).astype(np.float32)
        values = [texture.eval_points(points) for texture in textures]
        a, b = (v - v.mean(0) for v in values)
        found.append(float((a * b).sum() / np.sqrt((a**2).sum() * (b**2).sum())))
    return found


if __name__ == "__main__":
    main()
