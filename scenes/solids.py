"""Solids as triangle meshes: grids of vertices, lathes, and distance functions made into meshes.

The scripts that make the meshes of the scenes share it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.interpolate import PchipInterpolator
from skimage.measure import marching_cubes

Array = np.ndarray


@dataclass
class Mesh:
    """Vertices with normals, and triangles that go counter-clockwise seen from outside."""

    positions: Array  # [n, 3]
    normals: Array  # [n, 3]
    triangles: Array  # [m, 3]


def write_ply(path: Path, mesh: Mesh, maker: str) -> None:
    """Write a binary PLY; `maker` is the script's name, for a comment."""
    vertices = np.concatenate([mesh.positions, mesh.normals], axis=1).astype("<f4")
    faces = np.empty(len(mesh.triangles), dtype=[("count", "u1"), ("index", "<u4", 3)])
    faces["count"] = 3
    faces["index"] = mesh.triangles
    properties = "".join(f"property float {name}\n" for name in ("x", "y", "z", "nx", "ny", "nz"))
    header = (
        f"ply\nformat binary_little_endian 1.0\ncomment made by {maker}\n"
        f"element vertex {len(vertices)}\n{properties}"
        f"element face {len(faces)}\nproperty list uchar uint vertex_indices\nend_header\n"
    )
    path.write_bytes(header.encode() + vertices.tobytes() + faces.tobytes())
    print(f"{path.name}: {len(faces)} triangles, {path.stat().st_size // 1000} kB")


def join(*meshes: Mesh) -> Mesh:
    starts = np.cumsum([0] + [len(mesh.positions) for mesh in meshes[:-1]])
    return Mesh(
        np.concatenate([mesh.positions for mesh in meshes]),
        np.concatenate([mesh.normals for mesh in meshes]),
        np.concatenate(
            [mesh.triangles + start for mesh, start in zip(meshes, starts, strict=True)]
        ),
    )


def unit(vectors: Array) -> Array:
    return vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-12)


def face_vectors(positions: Array, triangles: Array) -> Array:
    """Cross products of two edges: normals as long as twice the area."""
    a, b, c = (positions[triangles[:, i]] for i in range(3))
    return np.cross(b - a, c - a)


# --- Grids of vertices ------------------------------------------------------------------------


def grid(positions: Array, normals: Array) -> Mesh:
    """Two triangles per cell of a grid [rows, columns, 3], turned to agree with the normals."""
    rows, columns = positions.shape[:2]
    index = np.arange(rows * columns).reshape(rows, columns)
    a, b = index[:-1, :-1].ravel(), index[1:, :-1].ravel()
    c, d = index[1:, 1:].ravel(), index[:-1, 1:].ravel()
    triangles = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    positions, normals = positions.reshape(-1, 3), unit(normals.reshape(-1, 3))
    faces = face_vectors(positions, triangles)
    keep = np.linalg.norm(faces, axis=1) > 1e-12  # cells shrink to triangles at a pole
    agreement = np.sum(faces * normals[triangles[:, 0]])
    triangles = triangles[keep]
    return Mesh(positions, normals, triangles if agreement > 0 else triangles[:, ::-1])


def around_y(radius: Array, height: Array, angle: Array) -> Array:
    return np.stack([radius * np.cos(angle), height, radius * np.sin(angle)], axis=-1)


def smooth_curve(points: list[tuple[float, float]], count: int) -> Array:
    """A Catmull-Rom curve through the points, `count` of them at equal steps of arc length."""
    p = np.array(points)
    p = np.concatenate([2 * p[:1] - p[1:2], p, 2 * p[-1:] - p[-2:-1]])
    t = np.linspace(0, 1, 50, endpoint=False)[:, None]
    pieces = []
    for a, b, c, d in zip(p[:-3], p[1:-2], p[2:-1], p[3:], strict=True):
        pieces.append(
            b + 0.5 * t * (c - a + t * (2 * a - 5 * b + 4 * c - d + t * (3 * (b - c) + d - a)))
        )
    curve = np.concatenate([*pieces, p[-2:-1]])
    length = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(curve, axis=0), axis=1))])
    wanted = np.linspace(0, length[-1], count)
    return np.stack([np.interp(wanted, length, curve[:, i]) for i in range(2)], axis=1)


# --- Carved solids from distance functions ----------------------------------------------------


def rounded_max(a: Array, b: Array, radius: float) -> Array:
    """Intersection of two solids whose common edge is rounded."""
    outer = np.hypot(np.maximum(a + radius, 0), np.maximum(b + radius, 0))
    return np.minimum(np.maximum(a, b), -radius) + outer


def box_distance(p: Array, low: Array, high: Array, radius: float) -> Array:
    distance = np.maximum(low - p, p - high) + radius
    inside = np.minimum(distance.max(axis=-1), 0)
    return np.linalg.norm(np.maximum(distance, 0), axis=-1) + inside - radius


def axis_with_details(places: list[float], radius: float) -> Array:
    """Grid lines that are dense around the given coordinates and sparse between them."""
    near = np.array([-1.6, -1.05, -0.7, -0.4, -0.12, 0.12, 0.4, 0.7, 1.05, 1.6]) * radius
    lines = [place + near for place in places]
    coarse = np.linspace(min(places), max(places), 7)
    far = np.abs(coarse[:, None] - np.array(places)).min(axis=1) > 3 * radius
    return np.unique(np.round(np.concatenate([*lines, coarse[far]]), 6))


def carve(distance: Callable[[Array], Array], *axes: Array) -> Mesh:
    """Marching cubes on a grid with uneven lines (one axis for all, or three), then vertices moved
    onto the exact surface."""
    axes = axes if len(axes) == 3 else 3 * axes
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    vertices, triangles, _, _ = marching_cubes(distance(points), 0.0)
    positions = np.stack(
        [np.interp(vertices[:, i], np.arange(len(axis)), axis) for i, axis in enumerate(axes)], 1
    )

    def gradient(p: Array) -> Array:
        steps = 1e-5 * np.eye(3)
        return np.stack([distance(p + s) - distance(p - s) for s in steps], axis=-1) / 2e-5

    for _ in range(4):
        slope = gradient(positions)
        positions = positions - distance(positions)[:, None] * slope / np.maximum(
            np.sum(slope * slope, axis=1, keepdims=True), 0.25
        )
    normals = unit(gradient(positions))
    faces = face_vectors(positions, triangles)
    if np.sum(faces * normals[triangles[:, 0]]) < 0:
        triangles = triangles[:, ::-1]
    return Mesh(positions, normals, triangles[np.linalg.norm(faces, axis=1) > 1e-12])


# --- Lathes -----------------------------------------------------------------------------------


def closed_normals(positions: Array) -> Array:
    """Normals of a grid [rows, columns, 3] whose last column is its first, by differences."""
    along_rows = np.gradient(positions, axis=0)
    around = np.concatenate([positions[:, -2:-1], positions, positions[:, 1:2]], axis=1)
    return np.cross(along_rows, around[:, 2:] - around[:, :-2])


def turn_rows(profile: Array, count: int) -> Array:
    """Picks points of a fine profile [n, 2], denser where it turns."""
    step = np.diff(profile, axis=0)
    length = np.linalg.norm(step, axis=1)
    heading = np.unwrap(np.arctan2(step[:, 1], step[:, 0]))
    turn = np.abs(np.diff(heading, prepend=heading[0]))
    measure = np.cumsum(np.concatenate([[0], length / length.sum() + 1.5 * turn / turn.sum()]))
    wanted = np.linspace(0, measure[-1], count)
    return np.stack([np.interp(wanted, measure, profile[:, i]) for i in range(2)], axis=1)


def lathe(points: list[tuple[float, float]], rows: int, columns: int) -> Mesh:
    """Turned about the y axis: a smooth profile (radius, height) from the foot's middle to the
    top's, which overshoots at no point. Points that lie close together make an edge."""
    corners = np.array(points)
    length = np.cumsum(np.linalg.norm(np.diff(corners, axis=0, prepend=corners[:1]), axis=1))
    curve = PchipInterpolator(length, corners)(np.linspace(0, length[-1], 40 * rows))
    profile = turn_rows(curve, rows)
    profile[[0, -1], 0] = 0
    angle = np.linspace(0, 2 * np.pi, columns + 1)
    positions = around_y(profile[:, :1], profile[:, 1:] + 0 * angle, angle)
    positions[:, -1] = positions[:, 0]
    normals = closed_normals(positions)
    normals[0], normals[-1] = (0, -1, 0), (0, 1, 0)
    return grid(positions, normals)
