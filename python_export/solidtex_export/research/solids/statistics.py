"""3D statistics of two-phase solids: bool [x, y, z], true where the phase is; unit one voxel."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from itertools import combinations, product

import numpy as np

from solidtex_export.evaluation.metrics.autocorrelation import covariance_by_lag

# Directions to the 26 neighbors and the share of all directions that are nearest to each: Ohser
# and Muecklich, Statistical Analysis of Microstructures in Materials Science, 2000, section 4.2.
WEIGHTS = {1: 0.0457779, 2: 0.0369806, 3: 0.0351956}


@dataclass(frozen=True)
class Minkowski:
    """The four Minkowski functionals, per voxel: volume fraction, surface area, mean breadth
    (integral of mean curvature over 2 pi; of a ball: its diameter) and Euler characteristic."""

    volume: float
    surface: float
    breadth: float
    euler: float


def minkowski(phase: np.ndarray) -> Minkowski:
    """Estimate the functionals without border bias: all are means over places inside.

    Surface area counts crossings along 13 directions (Crofton's formula: two crossings per unit
    length and unit area). Mean breadth is the mean Euler characteristic of plane sections normal to
    x, y and z, exact for isotropic solids only. Voxels close narrow gaps between surfaces, such as
    those of barely touching spheres, which makes breadth and Euler characteristic too small.
    Compare them with those of a true solid of the same voxels.
    """
    return Minkowski(
        volume=float(phase.mean()),
        surface=_surface(phase),
        breadth=float(np.mean([_euler_of_sections(phase, axis) for axis in range(3)])),
        euler=_euler(phase, (0, 1, 2)),
    )


def _surface(phase: np.ndarray) -> float:
    total = 0.0
    for step in product((-1, 0, 1), repeat=3):
        if step <= (0, 0, 0):
            continue  # the same direction backwards
        first, second = (phase[_shifted(phase.shape, step, sign)] for sign in (1, -1))
        axes = sum(map(abs, step))
        total += 2 * WEIGHTS[axes] * float((first != second).mean()) / axes**0.5
    return 2 * total


def _shifted(shape: tuple[int, ...], step: tuple[int, ...], sign: int) -> tuple[slice, ...]:
    moves = [sign * s for s in step]
    return tuple(slice(max(0, -m), min(n, n - m)) for m, n in zip(moves, shape, strict=True))


def _euler_of_sections(phase: np.ndarray, normal: int) -> float:
    return _euler(phase, tuple(a for a in range(3) if a != normal))


def _euler(phase: np.ndarray, axes: tuple[int, ...]) -> float:
    """Euler characteristic per voxel in the space of `axes`.

    The mean of two versions: voxels as points joined to their face neighbors, and as closed cubes.
    A cell of the first exists if all its voxels are in the phase, of the second if any is. All
    kinds of cells are counted in the same window: their numbers nearly cancel.
    """
    total = 0.0
    for count in range(len(axes) + 1):
        for chosen in combinations(axes, count):
            of_points = (-1) ** count * _cells(phase, axes, chosen, np.logical_and)
            # What lies between voxels along `chosen` is a cube's cell without extent there.
            of_cubes = (-1) ** (len(axes) - count) * _cells(phase, axes, chosen, np.logical_or)
            total += 0.5 * (of_points + of_cubes)
    return total


def _cells(
    phase: np.ndarray, axes: tuple[int, ...], chosen: tuple[int, ...], combine: np.ufunc
) -> float:
    """Number of cells between voxels along `chosen`, per voxel."""
    for axis in axes:
        size = phase.shape[axis]
        low = phase.take(range(size - 1), axis)
        phase = combine(low, phase.take(range(1, size), axis)) if axis in chosen else low
    return float(phase.mean())


def two_point(phase: np.ndarray, largest: int) -> np.ndarray:
    """S_2(r): the probability that two points at distance r are both in the phase, r = 0 ...
    largest.

    The mean over all lags whose length rounds to r.
    """
    values = phase.astype(np.float64)
    by_lag, count = covariance_by_lag(values, values, (largest,) * 3)
    steps = np.arange(-largest, largest + 1)
    radius = np.rint(np.sqrt(sum(np.square(s) for s in np.ix_(steps, steps, steps)))).astype(int)
    weights = np.bincount(radius.ravel(), count.ravel())
    return (np.bincount(radius.ravel(), (by_lag * count).ravel()) / weights)[: largest + 1]


def chords(phase: np.ndarray, axes: tuple[int, ...] = (0, 1, 2)) -> np.ndarray:
    """Lengths of the runs of the phase along the axes that do not touch the border."""
    lengths = []
    for axis in axes:
        lines = np.moveaxis(phase, axis, -1).reshape(-1, phase.shape[axis])
        changes = np.diff(lines.astype(np.int8), axis=1)
        line, place = np.nonzero(changes)
        begins = changes[line, place] > 0
        # A run is a beginning followed by an end on the same line.
        whole = begins[:-1] & ~begins[1:] & (line[:-1] == line[1:])
        lengths.append((place[1:] - place[:-1])[whole])
    return np.concatenate(lengths)


LARGEST_LAG = 32  # voxels


@dataclass(frozen=True)
class SolidError:
    """Errors of a solid's statistics against the true ones.

    `two_point`: root mean square difference of S_2 up to 32 voxels, over the true variance p (1 -
    p). `chords_bright`, `chords_dark`: Wasserstein distance of the chord lengths of the phases,
    over their true mean. `volume`, `surface`, `breadth`, `euler`: differences of the Minkowski
    functionals, in units of the true volume fraction and surface area S: volume / p, surface / S,
    breadth / S^2, euler / S^3.
    """

    two_point: float
    chords_bright: float
    chords_dark: float
    volume: float
    surface: float
    breadth: float
    euler: float


def solid_error(found: np.ndarray, true: np.ndarray) -> SolidError:
    """Compares two phases, bool [x, y, z]."""
    fraction = float(true.mean())
    difference = two_point(found, LARGEST_LAG) - two_point(true, LARGEST_LAG)
    ours, theirs = asdict(minkowski(found)), asdict(minkowski(true))
    surface = theirs["surface"]
    units = {"volume": fraction, "surface": surface, "breadth": surface**2, "euler": surface**3}
    return SolidError(
        two_point=float(np.sqrt(np.square(difference).mean()) / (fraction * (1 - fraction))),
        chords_bright=_chord_error(found, true),
        chords_dark=_chord_error(~found, ~true),
        **{name: (ours[name] - theirs[name]) / unit for name, unit in units.items()},
    )


def _chord_error(found: np.ndarray, true: np.ndarray) -> float:
    """Wasserstein distance W_1, the area between the distribution functions."""
    longest = max(found.shape)
    histograms = [np.bincount(chords(phase), minlength=longest) for phase in (found, true)]
    if not histograms[0].sum():
        return float("inf")  # nothing of this phase is left
    ours, theirs = (np.cumsum(h / h.sum()) for h in histograms)
    mean = (np.arange(len(histograms[1])) * histograms[1]).sum() / histograms[1].sum()
    return float(np.abs(ours - theirs).sum() / mean)
