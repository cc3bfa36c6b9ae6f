"""Checks of seeds and places, with the limits of the engine."""

from __future__ import annotations

from collections.abc import Sequence
from operator import index

import numpy as np

MAX_SEED = 2**64 - 1
FARTHEST = 2**30 + 2**16
"""Largest magnitude of a coordinate, in texels."""


def check_seed(seed: int) -> int:
    """Refuse a seed that the engine does not take."""
    if not 0 <= index(seed) <= MAX_SEED:
        raise ValueError(f"seed: found {seed}, expected a whole number from 0 to {MAX_SEED}")
    return index(seed)


def three_whole(name: str, values: Sequence[int]) -> tuple[int, int, int]:
    """Three whole numbers; floats are none."""
    try:
        found = tuple(index(value) for value in values)
    except TypeError:
        found = ()
    if len(found) != 3:
        raise ValueError(f"{name}: found {values!r}, expected three whole numbers")
    return found[0], found[1], found[2]


def check_box(
    origin: Sequence[int], size: Sequence[int]
) -> tuple[tuple[int, int, int], tuple[int, int, int]]:
    """First voxel and size of a box that the engine evaluates."""
    lo, extent = three_whole("origin", origin), three_whole("size", size)
    if min(extent) < 1:
        raise ValueError(f"size: found {tuple(size)}, expected three whole numbers above 0")
    for first, edge in zip(lo, extent, strict=True):
        if first < -FARTHEST or first + edge > FARTHEST:
            raise ValueError(
                f"origin: found {tuple(origin)} with the size {tuple(size)}, expected voxels"
                " between -2**30 - 2**16 and 2**30 + 2**16"
            )
    return lo, extent


def check_points(points: np.ndarray) -> None:
    """Refuse coordinates that are not finite, or beyond the engine's limit."""
    wrong = np.argwhere(~(np.abs(points) <= FARTHEST))
    if len(wrong):
        row, axis = wrong[0]
        raise ValueError(
            f"positions: found {points[row, axis]} in row {row}, expected finite coordinates"
            f" within +-{FARTHEST}"
        )
