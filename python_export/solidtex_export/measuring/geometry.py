"""Geometry of a phase in 2D or 3D, in units of voxels."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

Mask = NDArray[np.bool_]

# Directions of the neighbors of a voxel and their shares of the sphere (Ohser and Muecklich 2000).
SHARES_3D = {1: 0.0915558, 2: 0.0739613, 3: 0.0703914}
# Directions of the neighbors of a pixel: the four have equal shares of the circle.
SHARE_2D = 0.25
SURFACE_OF_SECTIONS = 4 / np.pi  # surface by volume, by boundary length by area; isotropic solids
LONGEST_WAVES = 2  # along the longest edge, in the integral range
PORE_RADII = 25  # opened sizes in the distribution of pore sizes


def directions(ndim: int) -> list[tuple[int, ...]]:
    """One of each pair of opposite neighbors: 13 in 3D, 4 in 2D."""
    steps = itertools.product((-1, 0, 1), repeat=ndim)
    return [step for step in steps if step > (0,) * ndim]


def specific_surface(mask: Mask) -> float:
    """Area of the phase's boundary by volume (length by area in 2D), by Crofton's formula.

    Test lines run along all neighbors. The faces of the volume itself do not count.
    """
    total = 0.0
    for step in directions(mask.ndim):
        here, there = _shifted(mask, step)
        share = SHARE_2D if mask.ndim == 2 else SHARES_3D[sum(map(abs, step))]
        total += share * float(np.mean(here != there)) / float(np.linalg.norm(step))
    return (np.pi / 2 if mask.ndim == 2 else 2) * total


def _shifted(mask: Mask, step: tuple[int, ...]) -> tuple[Mask, Mask]:
    """The voxels that have a neighbor at `step`, and those neighbors."""
    here = tuple(slice(max(0, -s), n - max(0, s)) for s, n in zip(step, mask.shape, strict=True))
    there = tuple(slice(max(0, s), n - max(0, -s)) for s, n in zip(step, mask.shape, strict=True))
    return mask[here], mask[there]


def euler_characteristic(mask: Mask) -> int:
    """Components less tunnels plus cavities of the phase, connected through faces."""
    from skimage.measure import euler_number

    return int(euler_number(mask, connectivity=1))


def mean_breadth(mask: Mask) -> float:
    """Integral of mean curvature over 2 pi, by sections across the three axes.

    The mean breadth of a ball is its diameter.
    """
    return sum(section_euler(np.moveaxis(mask, axis, 0)) for axis in range(3)) / 3


def section_euler(mask: Mask) -> int:
    """Sum of the Euler characteristics of the sections along axis 0, connected through edges."""
    rows = np.count_nonzero(mask[:, 1:] & mask[:, :-1])
    columns = np.count_nonzero(mask[:, :, 1:] & mask[:, :, :-1])
    squares = np.count_nonzero(
        mask[:, 1:, 1:] & mask[:, 1:, :-1] & mask[:, :-1, 1:] & mask[:, :-1, :-1]
    )
    return int(np.count_nonzero(mask) - rows - columns + squares)


def two_point(mask: Mask, axis: int) -> list[float]:
    """S2: the probability that two voxels 0, 1, 2 ... apart along an axis are both of the phase."""
    line = np.moveaxis(mask, axis, 0)
    length = len(line)
    return [float(np.mean(line[: length - lag] & line[lag:])) for lag in range(length // 2 + 1)]


def chords(mask: Mask, axis: int) -> NDArray[np.int64]:
    """Lengths of the runs of the phase along an axis. Runs cut by the border do not count."""
    lines = np.moveaxis(mask, axis, -1).reshape(-1, mask.shape[axis])
    padded = np.zeros((len(lines), lines.shape[1] + 1), bool)
    padded[:, :-1] = lines
    edges = np.diff(padded.reshape(-1).astype(np.int8), prepend=0)
    starts, ends = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
    pitch = padded.shape[1]
    inside = (starts % pitch != 0) & (ends % pitch != pitch - 1)
    return np.asarray((ends - starts)[inside], np.int64)


def integral_range(mask: Mask) -> float:
    """Volume (area in 2D) in which the phase is like one independent sample.

    The fraction of a volume V has the variance fraction * (1 - fraction) * range / V. The range is
    the integral of the correlation, which is its spectrum at frequency 0. One volume does not show
    that value; the mean over its longest waves stands for it.
    """
    frequencies: Any = 0.0
    waves: NDArray[Any] = mask
    counts = np.arange(-LONGEST_WAVES, LONGEST_WAVES + 1)
    for length in mask.shape:
        wave = np.exp(2j * np.pi / length * np.outer(np.arange(length), counts))
        waves = np.tensordot(waves, wave.astype(np.complex64), (0, 0))
        frequencies = np.add.outer(frequencies, (counts / length) ** 2)
    limit = (LONGEST_WAVES / max(mask.shape)) ** 2
    long = (frequencies > 0) & (frequencies <= limit * (1 + 1e-9))
    variance = float(mask.mean() * (1 - mask.mean()))
    return float(np.mean(np.abs(waves[long]) ** 2) / mask.size / variance) if variance else 0.0


def pore_sizes(mask: Mask) -> tuple[list[float], list[float]]:
    """Radii, and the fraction of the phase that balls (disks in 2D) of each radius or more cover.

    The same openings as PoreSpy's local_thickness.
    """
    depth = _depth(mask)
    largest = float(depth.max())
    radii = np.geomspace(1, max(largest, 1), PORE_RADII)
    radii = np.unique(np.floor(1000 * radii) / 1000)  # no radius above the largest
    covered = _reached(mask, depth, radii) / max(1, int(np.count_nonzero(mask)))
    return radii.tolist(), covered.tolist()


def disk_sizes(slices: Mask, radii: list[float]) -> list[float]:
    """The fraction of the phase in slices along axis 0 that disks of each radius or more cover."""
    reached = np.zeros(len(radii), np.int64)
    for piece in slices:
        reached += _reached(piece, _depth(piece), np.array(radii))
    return list(reached / max(1, int(np.count_nonzero(slices))))


def _depth(mask: Mask) -> NDArray[np.float64]:
    """Distance from each voxel of the phase to its border; without a border it is infinite."""
    if mask.all():
        return np.full(mask.shape, np.inf)
    return np.asarray(ndimage.distance_transform_edt(mask))


def _reached(
    mask: Mask, depth: NDArray[np.float64], radii: NDArray[np.float64]
) -> NDArray[np.int64]:
    """Number of voxels of the phase that openings of each radius or more cover."""
    reached, counts = np.zeros_like(mask), []
    for radius in radii[::-1]:
        centers = depth >= radius
        if centers.any():
            reached |= ndimage.distance_transform_edt(~centers) < radius
        counts.append(np.count_nonzero(reached & mask))
    return np.array(counts[::-1])


def mean_radius(radii: list[float], covered: list[float]) -> float:
    """Mean over the phase of the largest radius that covers a place; none covers: 0."""
    return float(np.dot(radii, -np.diff(covered, append=0)))


def measure_phase(mask: Mask, voxel: float, unit: str) -> dict[str, Any]:
    """The figures of one phase, with units."""
    ndim = mask.ndim
    fraction, independent = float(mask.mean()), integral_range(mask)
    figures: dict[str, Any] = {
        "fraction": fraction,
        "fraction_deviation": float(np.sqrt(fraction * (1 - fraction) * independent / mask.size)),
        f"integral_range_{unit}{ndim}": independent * voxel**ndim,
        f"specific_surface_per_{unit}": specific_surface(mask) / voxel,
        "euler_characteristic": euler_characteristic(mask),
    }
    volume = mask.size * voxel**ndim
    figures[f"euler_density_per_{unit}{ndim}"] = figures["euler_characteristic"] / volume
    if ndim == 3:
        breadth = mean_breadth(mask)
        figures[f"mean_breadth_{unit}"] = breadth * voxel
        figures[f"mean_breadth_density_per_{unit}2"] = breadth * voxel / volume
    return figures


def measure_axis(mask: Mask, axis: int, voxel: float, unit: str) -> dict[str, Any]:
    """Correlation and chords of a phase along an axis, with units."""
    lengths = chords(mask, axis)
    counts = np.bincount(lengths)[1:] if len(lengths) else np.zeros(0, int)
    return {
        f"mean_chord_{unit}": float(lengths.mean() * voxel) if len(lengths) else None,
        "chord_counts": counts.tolist(),  # of 1, 2, 3 ... voxels
        "two_point": two_point(mask, axis),  # 0, 1, 2 ... voxels apart
    }
