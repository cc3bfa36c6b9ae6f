"""Representative volumes and areas: figures of smaller and smaller cubes or squares."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from solidtex_export.measuring import geometry
from solidtex_export.measuring.geometry import Mask

SMALLEST_EDGE = 16
MOST_CUBES = 27


def cubes(mask: Mask, edge: int) -> Iterator[Mask]:
    """Disjoint cubes of an edge, at most MOST_CUBES, spread over the volume."""
    counts = [length // edge for length in mask.shape]
    corners = list(np.ndindex(*counts))
    chosen = np.linspace(0, len(corners) - 1, min(len(corners), MOST_CUBES)).round().astype(int)
    for corner in (corners[i] for i in chosen):
        yield mask[tuple(slice(c * edge, (c + 1) * edge) for c in corner)]


def edges(mask: Mask) -> list[int]:
    """Edges of the cubes: the shortest side of the volume, its half, its quarter and so on."""
    edge = min(mask.shape)
    result = []
    while edge >= SMALLEST_EDGE:
        result.append(edge)
        edge //= 2
    return result[::-1]


def analyze(
    mask: Mask, voxel: float, unit: str, further: dict[str, Callable[[Mask], float]]
) -> list[dict[str, Any]]:
    """Mean and standard deviation of each figure over the cubes of each edge.

    Of a section, squares take the place of cubes, and the surface is that of an isotropic solid.
    """
    ndim = mask.ndim
    scale = geometry.SURFACE_OF_SECTIONS if ndim == 2 else 1.0
    counted = "squares" if ndim == 2 else "cubes"
    figures: dict[str, Callable[[Mask], float]] = {
        "fraction": lambda cube: float(cube.mean()),
        f"specific_surface_per_{unit}": lambda cube: (
            scale * geometry.specific_surface(cube) / voxel
        ),
        f"euler_density_per_{unit}{ndim}": lambda cube: (
            geometry.euler_characteristic(cube) / (cube.size * voxel**ndim)
        ),
        **further,
    }
    rows = []
    for edge in edges(mask):
        row: dict[str, Any] = {"edge_voxels": edge, f"edge_{unit}": edge * voxel}
        values = [[figure(cube) for figure in figures.values()] for cube in cubes(mask, edge)]
        row[counted] = len(values)
        for name, column in zip(figures, np.array(values).T, strict=True):
            row[name] = {
                "mean": float(column.mean()),
                "deviation": float(column.std(ddof=1)) if len(column) > 1 else None,
            }
        rows.append(row)
    return rows
