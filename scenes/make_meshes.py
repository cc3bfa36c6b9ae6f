"""Makes the meshes of the demo scene: compact binary PLY files in scenes/meshes.

Every shape is a closed solid with y up, except the ground. Run it from anywhere:
python scenes/make_meshes.py
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from skimage.measure import marching_cubes

Array = np.ndarray


@dataclass
class Mesh:
    """Vertices with normals, and triangles that go counter-clockwise seen from outside."""

    positions: Array  # [n, 3]
    normals: Array  # [n, 3]
    triangles: Array  # [m, 3]


def write_ply(path: Path, mesh: Mesh) -> None:
    vertices = np.concatenate([mesh.positions, mesh.normals], axis=1).astype("<f4")
    faces = np.empty(len(mesh.triangles), dtype=[("count", "u1"), ("index", "<u4", 3)])
    faces["count"] = 3
    faces["index"] = mesh.triangles
    properties = "".join(f"property float {name}\n" for name in ("x", "y", "z", "nx", "ny", "nz"))
    header = (
        "ply\nformat binary_little_endian 1.0\ncomment made by scenes/make_meshes.py\n"
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


def torus_knot(p: int, q: int, tube: float, segments: int, sides: int) -> Mesh:
    """A tube along the (p, q) torus knot, standing on its edge, about 2 wide."""

    def center(t: Array) -> Array:
        radius = 0.68 + 0.32 * np.cos(q * t)
        return np.stack(
            [radius * np.cos(p * t), radius * np.sin(p * t), 0.32 * np.sin(q * t)], axis=-1
        )

    def surface(t: Array, angle: Array) -> Array:
        step = 1e-3
        tangent = unit(center(t + step) - center(t - step))
        inward = center(t + step) + center(t - step) - 2 * center(t)
        side = unit(np.cross(tangent, inward))
        up = np.cross(side, tangent)
        circle = np.cos(angle)[..., None] * side + np.sin(angle)[..., None] * up
        return center(t) + tube * circle

    t, angle = np.meshgrid(
        np.linspace(0, 2 * np.pi, segments + 1),
        np.linspace(0, 2 * np.pi, sides + 1),
        indexing="ij",
    )
    positions = surface(t, angle)
    positions[-1], positions[:, -1] = positions[0], positions[:, 0]  # closed to the last bit
    return grid(positions, surface(t, angle) - center(t))


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


VASE_PROFILE = [  # (radius, height): from the middle of the foot, up, over the lip, down inside
    *[(0.0, 0.0), (0.15, 0.0), (0.30, 0.0), (0.335, 0.025), (0.33, 0.07), (0.30, 0.12)],
    *[(0.40, 0.32), (0.56, 0.62), (0.62, 0.92), (0.55, 1.25), (0.37, 1.52), (0.27, 1.70)],
    *[(0.29, 1.84), (0.36, 1.93), (0.375, 1.965), (0.35, 1.98), (0.32, 1.95), (0.24, 1.82)],
    *[(0.215, 1.70), (0.30, 1.50), (0.46, 1.22), (0.52, 0.92), (0.46, 0.62), (0.28, 0.30)],
    *[(0.14, 0.22), (0.0, 0.20)],
]


def vase(rows: int, columns: int, flutes: int) -> Mesh:
    """Turned on a lathe, with flutes that wind around its body."""
    profile = smooth_curve(VASE_PROFILE, rows)
    lip = int(np.argmax(profile[:, 1]))
    row = np.arange(rows, dtype=float)

    def surface(u: Array, v: Array) -> Array:
        radius = np.interp(u, row, profile[:, 0])
        height = np.interp(u, row, profile[:, 1])
        body = np.clip((height - 0.16) / 0.25, 0, 1) * np.clip((1.66 - height) / 0.45, 0, 1)
        depth = 0.045 * body * body * (3 - 2 * body) * (u < lip)
        groove = np.abs(np.cos(0.5 * flutes * v + 2.4 * height)) ** 0.7
        return around_y(radius * (1 - depth * (1 - groove)), height, v)

    u, v = np.meshgrid(row, np.linspace(0, 2 * np.pi, columns + 1), indexing="ij")
    positions = surface(u, v)
    positions[[0, -1], :, 0] = positions[[0, -1], :, 2] = 0
    positions[:, -1] = positions[:, 0]
    # Normals from the finished grid, so that neighbours along the profile are averaged.
    along_u = np.gradient(positions, axis=0)
    closed = np.concatenate([positions[:, -2:-1], positions, positions[:, 1:2]], axis=1)
    along_v = (closed[:, 2:] - closed[:, :-2]) / 2
    normals = np.cross(along_u, along_v)
    normals[0], normals[-1] = (0, -1, 0), (0, 1, 0)
    return grid(positions, normals)


def ball_sector(start: float, end: float, rows: int, columns: int, bevel: float) -> Mesh:
    """The part of the unit ball between two meridians (degrees), its rims slightly rounded."""
    polar = np.linspace(0, np.pi, rows)
    radius, height = np.sin(polar), np.cos(polar)
    radius[[0, -1]] = 0
    rounding = bevel * np.minimum(1, radius / 0.2)  # none at the poles
    meshes, rims = [], []
    for angle, into in ((np.radians(start), 1), (np.radians(end), -1)):
        outward = around_y(radius, height, np.full(rows, angle))
        sideways = into * around_y(np.ones(rows), 0 * radius, np.full(rows, angle + np.pi / 2))
        center = outward * (1 - rounding[:, None]) + sideways * rounding[:, None]
        turn = np.linspace(0, np.pi / 2, 6)[None, :, None]
        normals = outward[:, None] * np.sin(turn) - sideways[:, None] * np.cos(turn)
        rim = center[:, None] + rounding[:, None, None] * normals
        axis = np.stack([0 * radius, height, 0 * radius], axis=-1)
        face = np.stack([axis, rim[:, 0]], axis=1)
        meshes += [grid(rim, normals), grid(face, np.stack([-sideways, -sideways], axis=1))]
        rims.append(rim[:, -1])
    # Meridians from rim to rim, on the ball.
    first, last = (np.arctan2(rim[:, 2], rim[:, 0]) for rim in rims)
    first[[0, -1]], last[[0, -1]] = np.radians(start), np.radians(end)
    first = first + 2 * np.pi * np.round((np.radians(start) - first) / (2 * np.pi))
    last = last + 2 * np.pi * np.round((np.radians(end) - last) / (2 * np.pi))
    angle = first[:, None] + (last - first)[:, None] * np.linspace(0, 1, columns)
    skin = around_y(radius[:, None], height[:, None] + 0 * angle, angle)
    positions = skin.copy()
    positions[:, 0], positions[:, -1] = rims
    return join(grid(positions, skin), *meshes)


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


def carve(distance: Callable[[Array], Array], axis: Array) -> Mesh:
    """Marching cubes on a grid with uneven lines, then vertices moved onto the exact surface."""
    points = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1)
    vertices, triangles, _, _ = marching_cubes(distance(points), 0.0)
    positions = np.interp(vertices, np.arange(len(axis)), axis)

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


def cube_with_notch(cut: float, radius: float) -> Mesh:
    """A cube of side 2 without the corner where all coordinates are above `cut`."""

    def distance(p: Array) -> Array:
        cube = box_distance(p, np.full(3, -1.0), np.full(3, 1.0), radius)
        notch = box_distance(p, np.full(3, cut), np.full(3, 3.0), radius)
        return rounded_max(cube, -notch, radius)

    return carve(distance, axis_with_details([-1.0, cut, 1.0], radius))


def corner_of_cube(cut: float, radius: float) -> Mesh:
    """The corner that cube_with_notch lacks, a little smaller, as a saw would leave it."""
    gap = 0.02

    def distance(p: Array) -> Array:
        return box_distance(p, np.full(3, cut + gap), np.full(3, 1.0), radius)

    return carve(distance, axis_with_details([cut + gap, 1.0], radius))


def ground() -> Mesh:
    """A floor that bends up into a backdrop far behind."""
    turn = np.linspace(0, np.pi / 2, 24)
    z = np.concatenate([[12.0], -8 - 5 * np.sin(turn), [-13.0]])
    y = np.concatenate([[0.0], 5 - 5 * np.cos(turn), [16.0]])
    normal_z = np.concatenate([[0.0], np.sin(turn), [1.0]])
    normal_y = np.concatenate([[1.0], np.cos(turn), [0.0]])
    x = np.array([-30.0, 30.0])
    positions = np.stack(np.broadcast_arrays(x[None, :], y[:, None], z[:, None]), axis=-1)
    normals = np.stack(
        np.broadcast_arrays(0 * x[None, :], normal_y[:, None], normal_z[:, None]), axis=-1
    )
    return grid(positions, normals)


def plane() -> Mesh:
    """A floor of 400 x 400 units."""
    x = np.array([-200.0, 200.0])
    positions = np.stack(np.broadcast_arrays(x[None, :], 0.0, -x[:, None]), axis=-1)
    return grid(positions, np.broadcast_to([0.0, 1.0, 0.0], positions.shape))


def main() -> None:
    folder = Path(__file__).parent / "meshes"
    folder.mkdir(exist_ok=True)
    write_ply(folder / "cube-cut.ply", cube_with_notch(0.1, 0.035))
    write_ply(folder / "cube-corner.ply", corner_of_cube(0.1, 0.035))
    write_ply(folder / "ball-cut.ply", ball_sector(90, 360, 68, 100, 0.02))
    write_ply(folder / "ball-wedge.ply", ball_sector(0, 90, 68, 36, 0.02))
    write_ply(folder / "knot.ply", torus_knot(2, 3, 0.19, 300, 24))
    write_ply(folder / "vase.ply", vase(100, 120, 10))
    write_ply(folder / "ground.ply", ground())
    write_ply(folder / "plane.ply", plane())


if __name__ == "__main__":
    main()
