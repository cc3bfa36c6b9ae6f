"""Solids of burnt and settled earth: brick and sandstone."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from solidtex_export.images.channels import COLOR
from solidtex_export.research.solids.fractal import Fractal, smooth_step
from solidtex_export.research.solids.random_parts import GaussianField, PoissonPoints
from solidtex_export.research.solids.solid import mixed


class FiredBrick:
    """Brick: clay with cloudy tones, sand, pale and burnt crumbs, and pores, the darker phase.

    Crumbs are balls distorted by a field, so that each has its own outline.
    """

    channels = COLOR
    threshold = 0.3
    directions = "xyz"
    clay = np.array([0.5, 0.22, 0.14]), np.array([0.78, 0.42, 0.27])
    crumbs = np.array([0.24, 0.13, 0.11]), np.array([0.85, 0.68, 0.5])  # burnt, pale
    pore = np.array([0.13, 0.07, 0.06])
    density, smallest, largest = 9e-4, 1.5, 6.0
    burnt_share = 0.45

    def __init__(self, seed: int = 0) -> None:
        self._clouds = Fractal(14.0, 3, 100 * seed)
        self._sand = Fractal(1.3, 2, 100 * seed + 10)
        self._bends = [Fractal(3.0, 2, 100 * seed + 20 + 10 * axis) for axis in range(3)]
        self._pores = Fractal(3.2, 2, 100 * seed + 50)
        self._places = PoissonPoints(self.density, 2 * self.largest, seed)

    def __call__(self, points: np.ndarray) -> np.ndarray:
        bent = points + 0.9 * np.stack([bend(points) for bend in self._bends], axis=1)
        sand = self._sand(points)
        tone = (0.45 + 0.15 * self._clouds(points) + 0.13 * sand).clip(0, 1)
        values = mixed(tone, *self.clay)
        values = self._crumbled(values, bent, sand)
        open_ = smooth_step((self._pores(bent) - 1.75) / 0.25)
        return mixed(open_, values, self.pore).clip(0, 1)

    def _crumbled(self, values: np.ndarray, points: np.ndarray, sand: np.ndarray) -> np.ndarray:
        """`values` with the colors of the crumbs at `points`, the last drawn on top."""
        positions, marks = self._places.near(points, self.largest)
        radii = self.smallest * (self.largest / self.smallest) ** (marks[:, 0] ** 2)
        kinds = (marks[:, 1] > self.burnt_share).astype(int)
        inside = cKDTree(points).query_ball_point(positions, radii)
        values = values.copy()
        for indices, kind, mark in zip(inside, kinds, marks[:, 2], strict=True):
            weight = (0.55 + 0.35 * mark) * np.ones(len(indices))
            color = self.crumbs[kind] * (1 + 0.06 * sand[indices, None])
            values[indices] = mixed(weight, values[indices], color)
        return values


class Sandstone:
    """Grains of sand in wavy layers, normal to z, from cream to rust; the darker phase is rust."""

    channels = COLOR
    threshold = 0.55
    directions = "xy"
    cream, ochre, rust = (
        np.array(c) for c in ((0.9, 0.82, 0.68), (0.82, 0.62, 0.4), (0.58, 0.32, 0.2))
    )

    def __init__(self, seed: int = 0) -> None:
        self._wave = GaussianField((45.0, 45.0, 30.0), seed)
        self._layers = [GaussianField((400.0, 400.0, 9.0 / 2**i), seed + 1 + i) for i in range(3)]
        self._stains = GaussianField((18.0, 18.0, 5.0), seed + 4)
        self._sand = Fractal(1.1, 2, 100 * seed + 10)

    def __call__(self, points: np.ndarray) -> np.ndarray:
        bent = points + np.array([0, 0, 3.0]) * self._wave(points)[:, None]
        layers = sum(0.6**i * layer(bent) for i, layer in enumerate(self._layers)) / 1.23
        tone = 0.45 + 0.17 * layers + 0.06 * self._stains(points) + 0.08 * self._sand(points)
        stops = np.stack([self.cream, self.ochre, self.rust], axis=1)
        return np.stack([np.interp(tone, (0, 0.45, 0.95), part) for part in stops], axis=1)
