#!/usr/bin/env python3
"""Share of a model's variance that follows the position modulo the pitch of its coarsest level.

A texture that does not repeat has none. The means of two blocks far apart, at each position modulo
the pitch along an axis, are compared: what they have in common is hardly chance. See
docs/experiments/ablation.md. From the repository, built, with `build/python` on PYTHONPATH:

    .venv/bin/python benchmarks/grid_share.py models/*.solidtex
"""

from __future__ import annotations

import argparse

import numpy as np
from numpy.typing import NDArray

import solidtex

PITCH = 32  # texels, of the presets' coarsest level
SIDE = 128  # texels of a block
FAR = 40 * PITCH


def brightness(texture: solidtex.Texture) -> NDArray[np.float64]:
    """[block, x, y, z], of zero mean and unit deviation."""
    corners = ((0, 0, 0), (FAR, 0, 0))
    blocks = [texture.eval_box(corner, (SIDE,) * 3)[..., :3].mean(-1) for corner in corners]
    values = np.stack(blocks).astype(np.float64)
    return (values - values.mean()) / max(float(values.std()), 1e-12)


def shares(values: NDArray[np.float64]) -> list[float]:
    """By axis: covariance of both blocks' means at each position modulo the pitch."""
    found = []
    for axis in range(3):
        others = tuple(a for a in (1, 2, 3) if a != axis + 1)
        means = values.mean(others).reshape(2, -1, PITCH).mean(1)
        first, second = means - means.mean(1, keepdims=True)
        found.append(float((first * second).mean()))
    return found


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("models", nargs="+", help="paths or names of models")
    print("| model | x | y | z |\n|---|---|---|---|")
    for model in options.parse_args().models:
        figures = " | ".join(
            f"{share:.1%}" for share in shares(brightness(solidtex.Texture(model)))
        )
        print(f"| {model} | {figures} |", flush=True)


if __name__ == "__main__":
    main()
