"""Closed forms for two solids: Boolean model of spheres and excursion set of a Gaussian field."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from scipy.integrate import quad
from scipy.special import ndtr, ndtri

from solidtex_export.research.solids.materials import PorousRock, Spheres
from solidtex_export.research.solids.statistics import Minkowski

QUANTILES = (np.arange(4096) + 0.5) / 4096


class BooleanSpheres:
    """Statistics of the union of spheres at the points of a Poisson process.

    Chiu, Stoyan, Kendall and Mecke, Stochastic Geometry and its Applications, 3rd edition 2013,
    sections 3.1 and 3.2.
    """

    def __init__(self, solid: Spheres) -> None:
        self._density = solid.density
        self._radii = solid.radii(QUANTILES)
        self._pores = float(np.exp(-self._density * self._mean(4 / 3 * np.pi * self._radii**3)))

    def two_point(self, lags: ArrayLike) -> np.ndarray:
        """S_2(r): the probability that two points at distance r are both covered."""
        r = np.asarray(lags, dtype=float)[:, None] / self._radii
        overlap = np.where(r < 2, 1 - 0.75 * r + r**3 / 16, 0) * 4 / 3 * np.pi * self._radii**3
        both_free = self._pores**2 * np.exp(self._density * overlap.mean(1))
        return 1 - 2 * self._pores + both_free

    def minkowski(self) -> Minkowski:
        """Miles' formulae, in densities of the grains' surface S and curvature M."""
        surface = self._density * self._mean(4 * np.pi * self._radii**2)
        curvature = self._density * self._mean(4 * np.pi * self._radii)
        breadth = (curvature - np.pi**2 / 32 * surface**2) / (2 * np.pi)
        euler = self._density - curvature * surface / (4 * np.pi) + np.pi * surface**3 / 384
        free = self._pores
        return Minkowski(1 - free, free * surface, free * breadth, free * euler)

    def mean_pore_chord(self) -> float:
        """Mean chord of the pores. Chords are exponential: a line meets spheres at random."""
        return 1 / (self._density * self._mean(np.pi * self._radii**2))

    @staticmethod
    def _mean(values: np.ndarray) -> float:
        return float(values.mean())


class Excursion:
    """Statistics of the set where a normal field is at least t.

    The field has variance 1 and covariance exp(-r^2 / 2 l^2) (Adler and Taylor, Random Fields and
    Geometry, 2007, theorem 15.9.5).
    """

    def __init__(self, solid: PorousRock) -> None:
        self._threshold = float(ndtri(solid.porosity))
        self._length = solid.length

    def two_point(self, lags: ArrayLike) -> np.ndarray:
        """S_2(r) = p^2 + integral from 0 to rho(r) of the bivariate density at (t, t)."""
        rho = np.exp(-np.square(np.asarray(lags, dtype=float) / self._length) / 2)
        fraction = 1 - ndtr(self._threshold)
        return np.array([fraction**2 + quad(self._density, 0, np.arcsin(r))[0] for r in rho])

    def _density(self, angle: float) -> float:
        return float(np.exp(-(self._threshold**2) / (1 + np.sin(angle))) / (2 * np.pi))

    def minkowski(self) -> Minkowski:
        t, k = self._threshold, 1 / self._length
        bell = np.exp(-(t**2) / 2)
        return Minkowski(
            volume=float(1 - ndtr(t)),
            surface=float(2 * k / np.pi * bell),
            breadth=float(k**2 * t / (2 * np.pi) ** 1.5 * bell),
            euler=float(k**3 * (t**2 - 1) / (4 * np.pi**2) * bell),
        )
