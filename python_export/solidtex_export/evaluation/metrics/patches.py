"""Sliced Wasserstein distance of patches over a Laplacian pyramid (Karras et al. 2018, sec. 5)."""

from __future__ import annotations

import math

import numpy as np
from scipy.ndimage import convolve1d

PATCH = 7  # pixels
SMALLEST_SIDE = 14  # pixels: of the coarsest level
MAX_PATCHES = 8192  # of each level
PROJECTIONS = 64
BINOMIAL = np.array([1, 4, 6, 4, 1], dtype=np.float32) / 16


class SlicedWasserstein:
    """Mean over levels and directions of the one-dimensional Wasserstein distance W_1.

    Crops become a Laplacian pyramid with a binomial filter; the last level is the low-pass
    residual. 64 random unit directions project up to 8192 7 x 7 patches of all channels at random
    places of each level; W_1 is the mean absolute difference of the sorted projections. Each level
    is divided by the exemplar's standard deviation there, so that faint fine levels count as much
    as coarse ones. Unlike the paper we do not normalize each set by itself: wrong colors and
    contrast count.
    """

    name = "sliced_wasserstein"
    title = "sliced Wasserstein"

    def __init__(self, exemplar: np.ndarray) -> None:
        self._exemplar = exemplar[None]

    def features(self, crops: np.ndarray) -> list[np.ndarray]:
        """For each level, sorted projections [direction, patch]."""
        levels = pyramid(crops)
        scales = [max(float(level.std()), 1e-6) for level in pyramid(self._exemplar, len(levels))]
        rng = np.random.default_rng(0)  # the same places and directions for every set
        return [_projected(level / scale, rng) for level, scale in zip(levels, scales, strict=True)]

    def distance(self, first: list[np.ndarray], second: list[np.ndarray]) -> float:
        levels = zip(first, second, strict=True)
        return float(np.mean([np.abs(a - b).mean() for a, b in levels]))


def pyramid(crops: np.ndarray, count: int | None = None) -> list[np.ndarray]:
    """The `count` levels, finest first; by default as many as leave SMALLEST_SIDE pixels."""
    levels: list[np.ndarray] = []
    while count is None or len(levels) < count - 1:
        if count is None and min(crops.shape[1:3]) < 2 * SMALLEST_SIDE:
            break
        smooth = convolve1d(convolve1d(crops, BINOMIAL, axis=1), BINOMIAL, axis=2)
        levels.append(crops - smooth)
        crops = smooth[:, ::2, ::2]
    return [*levels, crops]


def _projected(level: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    windows = np.lib.stride_tricks.sliding_window_view(level, (PATCH, PATCH), axis=(1, 2))
    places = math.prod(windows.shape[:3])
    chosen = rng.choice(places, min(places, MAX_PATCHES), replace=False)
    patches = windows[np.unravel_index(chosen, windows.shape[:3])].reshape(len(chosen), -1)
    directions = rng.standard_normal((patches.shape[1], PROJECTIONS), dtype=np.float32)
    directions /= np.linalg.norm(directions, axis=0)
    return np.sort((patches @ directions).T, axis=1)
