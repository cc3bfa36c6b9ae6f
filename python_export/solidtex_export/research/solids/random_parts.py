"""Building blocks of the solids: Gaussian fields and random points, infinite and aperiodic."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

MODES = 256
CELL_OFFSET = 1 << 20  # seeds cannot be negative; cells within +-2^20 are distinct


class GaussianField:
    """A stationary random field of mean 0 and variance 1: a sum of cosines at random.

    Its covariance is exp(-sum_i (x_i / l_i)^2 / 2), l the `lengths` in texels: wave vectors are
    normal with deviations 1 / l (Bochner's theorem). With 256 of them it is nearly normal.
    """

    def __init__(self, lengths: tuple[float, float, float], seed: int) -> None:
        rng = np.random.default_rng(seed)
        self._waves = (rng.standard_normal((MODES, 3)) / lengths).astype(np.float32).T
        self._phases = rng.uniform(0, 2 * np.pi, MODES).astype(np.float32)

    def __call__(self, points: np.ndarray) -> np.ndarray:
        """Values at points [n, 3]; float32, so meant for points within 10 000 texels."""
        angles = points.astype(np.float32) @ self._waves + self._phases
        return np.cos(angles).sum(1) * np.float32(np.sqrt(2 / MODES))


class PoissonPoints:
    """Independently scattered points, `density` of them per cubic texel; random marks by cell."""

    def __init__(self, density: float, cell: float, seed: int) -> None:
        self._mean = density * cell**3
        self._cell = cell
        self._seed = seed
        self._in_cell = lru_cache(maxsize=4096)(self._draw)

    def near(self, points: np.ndarray, reach: float) -> tuple[np.ndarray, np.ndarray]:
        """Points within `reach` of the box around points [n, 3].

        Returns positions [m, 3] and independent uniform numbers [m, 4].
        """
        low = np.floor((points.min(0) - reach) / self._cell).astype(int)
        high = np.floor((points.max(0) + reach) / self._cell).astype(int)
        cells = np.ndindex(*(high - low + 1))
        drawn = [self._in_cell(*(low + cell).tolist()) for cell in cells]
        positions, marks = zip(*drawn, strict=True)
        return np.concatenate(positions), np.concatenate(marks)

    def _draw(self, x: int, y: int, z: int) -> tuple[np.ndarray, np.ndarray]:
        rng = np.random.default_rng((self._seed, *(c + CELL_OFFSET for c in (x, y, z))))
        count = rng.poisson(self._mean)
        return (np.array([x, y, z]) + rng.random((count, 3))) * self._cell, rng.random((count, 4))
