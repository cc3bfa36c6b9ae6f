"""Makes the meshes of the demo scene: compact binary PLY files in scenes/meshes.

Every shape is a closed solid with y up, except the ground. Run it from anywhere:
python scenes/make_meshes.py
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from solids import (
    Array,
    Mesh,
    around_y,
    axis_with_details,
    box_distance,
    carve,
    grid,
    join,
    rounded_max,
    smooth_curve,
    unit,
    write_ply,
)


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
    # Normals from the finished grid, so that neighbors along the profile are averaged.
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
    meshes = {
        "cube-cut": cube_with_notch(0.1, 0.035),
        "cube-corner": corner_of_cube(0.1, 0.035),
        "ball-cut": ball_sector(90, 360, 68, 100, 0.02),
        "ball-wedge": ball_sector(0, 90, 68, 36, 0.02),
        "knot": torus_knot(2, 3, 0.19, 300, 24),
        "vase": vase(100, 120, 10),
        "ground": ground(),
        "plane": plane(),
    }
    for name, mesh in meshes.items():
        write_ply(folder / f"{name}.ply", mesh, "scenes/make_meshes.py")


if __name__ == "__main__":
    main()
