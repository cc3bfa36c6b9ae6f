"""The analytic solids. Each divides into a brighter and a darker phase."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.spatial import cKDTree
from scipy.special import ndtri
from scipy.stats import truncnorm

from solidtex_export.images.channels import COLOR
from solidtex_export.research.solids.earthen import FiredBrick, Sandstone
from solidtex_export.research.solids.paint import RustedPaint
from solidtex_export.research.solids.random_parts import GaussianField, PoissonPoints
from solidtex_export.research.solids.solid import MAPS, Solid, mixed

DARK, LIGHT = np.array([0.22, 0.2, 0.2]), np.array([0.82, 0.78, 0.7])


class Spheres:
    """Overlapping random spheres, lighter than the matrix: a Boolean model.

    Log-normal radii, median 7 texels, cut off at 14. Volume fraction, two-point correlation,
    Minkowski functionals and chords are known: `exact.BooleanSpheres`.
    """

    channels = COLOR
    threshold = 0.5
    directions = "xyz"
    density = 2.2e-4
    median, deviation, largest = 7.0, 0.3, 14.0

    def __init__(self, seed: int = 0) -> None:
        self._centers = PoissonPoints(self.density, 2 * self.largest, seed)

    def radii(self, uniform: np.ndarray) -> np.ndarray:
        """Radii of the distribution at probabilities 0 ... 1."""
        top = np.log(self.largest / self.median) / self.deviation
        return self.median * np.exp(self.deviation * truncnorm.ppf(uniform, -np.inf, top))

    def __call__(self, points: np.ndarray) -> np.ndarray:
        positions, marks = self._centers.near(points, self.largest)
        radii = self.radii(marks[:, 0])
        tones = np.full(len(points), -1.0)
        inside = cKDTree(points).query_ball_point(positions, radii)
        for indices, tone in zip(inside, marks[:, 1], strict=True):
            tones[indices] = np.maximum(tones[indices], tone)
        covered = mixed(0.75 + 0.25 * tones, DARK, LIGHT)
        return np.where(tones[:, None] < 0, DARK, covered)


class PorousRock:
    """Rock where a Gaussian field exceeds a threshold, pores elsewhere: `exact.Excursion`."""

    channels = COLOR
    threshold = 0.5
    directions = "xyz"
    porosity = 0.35
    length = 6.0

    def __init__(self, seed: int = 0) -> None:
        self._field = GaussianField((self.length,) * 3, seed)

    def __call__(self, points: np.ndarray) -> np.ndarray:
        rock = self._field(points) >= ndtri(self.porosity)
        return np.where(rock[:, None], LIGHT, DARK)


class LayeredWood:
    """Growth rings across x and y, slightly wavy, with fibers along z."""

    channels = COLOR
    threshold = 0.45
    directions = "xy"
    ring = 22.0
    early, late = np.array([0.78, 0.58, 0.36]), np.array([0.38, 0.22, 0.11])

    def __init__(self, seed: int = 0) -> None:
        self._wave = GaussianField((60.0, 60.0, 400.0), seed)
        self._fibers = GaussianField((1.6, 1.6, 60.0), seed + 1)

    def __call__(self, points: np.ndarray) -> np.ndarray:
        # Along the diagonal of x and y, so that slices normal to both show the same rings.
        across = (points[:, 0] + points[:, 1]) / (np.sqrt(2) * self.ring)
        age = (across + 0.7 * self._wave(points)) % 1
        dark = np.where(age < 0.9, age**3, (1 - age) * 7.29)  # slowly dark, then suddenly light
        return mixed((dark + 0.07 * self._fibers(points)).clip(0, 1), self.early, self.late)


class VeinedMarble:
    """Thin dark sheets in clouded white, where a warped Gaussian field is zero."""

    channels = COLOR
    threshold = 0.6
    directions = "xyz"
    white, vein = np.array([0.93, 0.92, 0.9]), np.array([0.3, 0.32, 0.36])
    width = 0.1  # of the field's values on both sides of zero

    def __init__(self, seed: int = 0) -> None:
        self._sheets = GaussianField((22.0,) * 3, seed)
        self._bends = [GaussianField((9.0,) * 3, seed + 1 + axis) for axis in range(3)]
        self._clouds = GaussianField((16.0,) * 3, seed + 4)

    def __call__(self, points: np.ndarray) -> np.ndarray:
        bent = points + 2.5 * np.stack([bend(points) for bend in self._bends], axis=1)
        vein = np.exp(-np.square(self._sheets(bent) / self.width))
        cloud = 0.1 * (1 + np.tanh(self._clouds(points)))
        return mixed(np.maximum(vein, cloud), self.white, self.vein)


class Grains:
    """Poisson-Voronoi grains, each of one color and roughness, with sunken joints.

    The darker phase are the joints: points that are nearly as far from another center as from their
    own. Maps are roughness and height, which is low in the joints.
    """

    channels = (*COLOR, *MAPS)
    threshold = 0.3
    directions = "xyz"
    density = 1 / 16.0**3  # grains of 16^3 texels on average
    joint = 1.6  # texels: width
    cell = 32.0
    reach = 64.0  # far enough that no nearest center is missed
    light, brown, mortar = (np.array(c) for c in ((0.8, 0.76, 0.7), (0.55, 0.4, 0.3), (0.12,) * 3))

    def __init__(self, seed: int = 0) -> None:
        self._centers = PoissonPoints(self.density, self.cell, seed)

    def __call__(self, points: np.ndarray) -> np.ndarray:
        positions, marks = self._centers.near(points, self.reach)
        distances, indices = cKDTree(positions).query(points, 2)
        own = marks[indices[:, 0]]
        between = np.linalg.norm(positions[indices[:, 0]] - positions[indices[:, 1]], axis=1)
        wall = (distances[:, 1] ** 2 - distances[:, 0] ** 2) / (2 * between)  # distance to it
        inside = wall >= self.joint / 2
        albedo = np.where(inside[:, None], mixed(own[:, 0], self.brown, self.light), self.mortar)
        roughness = np.where(inside, 0.2 + 0.5 * own[:, 1], 0.95)
        height = np.minimum(wall / 4, 1) * (0.7 + 0.3 * own[:, 2])
        return np.column_stack([albedo, roughness, height])


SOLIDS: dict[str, Callable[[int], Solid]] = {
    "spheres": Spheres,
    "porous": PorousRock,
    "wood": LayeredWood,
    "marble": VeinedMarble,
    "grains": Grains,
    "paint": RustedPaint,
    "brick": FiredBrick,
    "sandstone": Sandstone,
}
