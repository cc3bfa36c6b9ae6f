"""A teapot as a distance function: a turned body with lid and knob, a swept spout and handle."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from solids import Array, Mesh, carve, rounded_max, smooth_curve

BODY = [  # (radius, height): foot, belly, rim, a groove, lid, knob
    *[(0.0, 0.0), (0.30, 0.0), (0.50, 0.0), (0.53, 0.02), (0.525, 0.06), (0.58, 0.11)],
    *[(0.80, 0.27), (0.95, 0.52), (0.965, 0.76), (0.86, 1.02), (0.68, 1.18), (0.62, 1.235)],
    *[(0.61, 1.27), (0.585, 1.285), (0.555, 1.272), (0.545, 1.285), (0.54, 1.305)],
    *[(0.44, 1.36), (0.26, 1.42), (0.13, 1.47), (0.09, 1.52), (0.10, 1.56), (0.155, 1.61)],
    *[(0.165, 1.67), (0.12, 1.73), (0.0, 1.75)],
]
SPOUT = np.array([(0.55, 0.42), (1.22, 0.36), (1.02, 1.02), (1.50, 1.25)])
SPOUT_RADII = (0.25, 0.105)
HANDLE = np.array([(-0.62, 1.10), (-1.55, 1.45), (-1.72, 0.35), (-0.80, 0.36)])


def bezier(points: Array, count: int) -> Array:
    t = np.linspace(0, 1, count)[:, None]
    a, b, c, d = points
    return (1 - t) ** 3 * a + 3 * t * (1 - t) ** 2 * b + 3 * t * t * (1 - t) * c + t**3 * d


def turned_distance(p: Array, profile: Array) -> Array:
    """Distance to the solid of revolution of a closed profile about the y axis; negative inside."""
    q = np.stack([np.hypot(p[..., 0], p[..., 2]), p[..., 1]], axis=-1)
    nearest = np.full(q.shape[:-1], np.inf)
    inside = np.zeros(q.shape[:-1], dtype=bool)
    for a, b in pairwise(profile):
        edge, rest = b - a, q - a
        t = np.clip(rest @ edge / (edge @ edge), 0, 1)
        nearest = np.minimum(nearest, np.sum((rest - t[..., None] * edge) ** 2, axis=-1))
        if a[1] != b[1]:
            crossing = a[0] + (q[..., 1] - a[1]) * edge[0] / edge[1]
            inside ^= ((a[1] > q[..., 1]) != (b[1] > q[..., 1])) & (q[..., 0] < crossing)
    return np.sqrt(nearest) * np.where(inside, -1, 1)


def swept_distance(p: Array, curve: Array, radii: Array, flat: float = 1.0) -> Array:
    """Distance to a tube of varying radius along a curve in the plane z = 0, `flat` times as wide
    in z.
    """
    q = p / (1, 1, flat)
    nearest = np.full(q.shape[:-1], np.inf)
    for a, b, ra, rb in zip(curve[:-1], curve[1:], radii[:-1], radii[1:], strict=True):
        start, edge = np.append(a, 0), np.append(b - a, 0)
        t = np.clip((q - start) @ edge / (edge @ edge), 0, 1)
        distance = np.linalg.norm(q - start - t[..., None] * edge, axis=-1)
        nearest = np.minimum(nearest, distance - (ra + t * (rb - ra)))
    return nearest


def smooth_union(a: Array, b: Array, radius: float) -> Array:
    overlap = np.maximum(radius - np.abs(a - b), 0)
    return np.minimum(a, b) - overlap**2 / (4 * radius)


def distance(p: Array) -> Array:
    body = turned_distance(p, smooth_curve(BODY, 110))
    line = bezier(SPOUT, 24)
    t = np.linspace(0, 1, 24)
    radii = SPOUT_RADII[0] + (SPOUT_RADII[1] - SPOUT_RADII[0]) * t**0.7
    tip, direction = line[-1], np.array([0.55, 0.83])
    beyond = (p[..., :2] - (tip - 0.02)) @ direction
    spout = rounded_max(swept_distance(p, line, radii), beyond, 0.02)
    # The mouth: a hole that narrows inward.
    hole = swept_distance(p, np.stack([line[-7], tip + 0.1]), np.array([0.02, 0.09]))
    handle = swept_distance(p, bezier(HANDLE, 24), np.full(24, 0.075), flat=1.3)
    whole = smooth_union(smooth_union(body, spout, 0.1), handle, 0.07)
    return rounded_max(whole, -hole, 0.02)


def lines(*pieces: tuple[float, float, float]) -> Array:
    """Grid lines: pieces of (start, end, step)."""
    return np.unique(np.concatenate([np.arange(a, b, step) for a, b, step in pieces]).round(5))


def teapot() -> Mesh:
    """A solid teapot, 1.75 high, with its spout towards +x."""
    x = lines((-1.65, -1.0, 0.032), (-1.0, 1.2, 0.05), (1.2, 1.7, 0.028))
    y = lines((-0.02, 0.15, 0.022), (0.15, 1.0, 0.045), (1.0, 1.8, 0.022))
    side = lines((0.0, 0.2, 0.024), (0.2, 1.05, 0.05))
    return carve(distance, x, y, np.unique(np.concatenate([-side, side])))
