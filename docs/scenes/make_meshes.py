"""Makes the meshes of the gallery (docs/gallery.md): binary PLY files in docs/scenes/meshes.

Every shape is a closed solid with y up. Run it from anywhere: python docs/scenes/make_meshes.py
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

REPOSITORY = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(REPOSITORY / "scenes"))

from solids import (  # noqa: E402
    Array,
    Mesh,
    around_y,
    axis_with_details,
    box_distance,
    carve,
    closed_normals,
    grid,
    join,
    lathe,
    write_ply,
)
from teapot import teapot  # noqa: E402

Profile = list[tuple[float, float]]


def arc(center: tuple[float, float], radius: float, start: float, end: float, n: int) -> Profile:
    """Points of an arc; angles in degrees from the radius direction towards the top."""
    angles = np.radians(np.linspace(start, end, n))
    x, y = center
    return [(max(0.0, x + radius * np.cos(a)), y + radius * np.sin(a)) for a in angles]


def ball() -> Mesh:
    return lathe(arc((0, 0), 1, -90, 90, 60), 56, 96)


def rounded_box(size: tuple[float, float, float], radius: float) -> Mesh:
    """A box with rounded edges around the origin."""
    half = np.array(size) / 2
    axes = [axis_with_details([-h, h], radius) for h in half]
    return carve(lambda p: box_distance(p, -half, half, radius), *axes)


# --- Chess ------------------------------------------------------------------------------------

FOOT: Profile = [
    *[(0.0, 0.0), (0.30, 0.0), (0.40, 0.0), (0.425, 0.015), (0.43, 0.05), (0.43, 0.10)],
    *[(0.415, 0.135), (0.37, 0.15), (0.355, 0.165), (0.365, 0.19), (0.36, 0.22), (0.32, 0.25)],
]


def collar(radius: float, height: float, neck: float) -> Profile:
    """A ring around the neck of a piece."""
    return [
        *[(neck, height - 0.03), (0.6 * neck + 0.4 * radius, height - 0.02)],
        *[(radius, height + 0.005), (radius, height + 0.03)],
        *[(0.6 * neck + 0.4 * radius, height + 0.05), (neck, height + 0.06)],
    ]


def pawn() -> Mesh:
    stem: Profile = [(0.25, 0.31), (0.19, 0.42), (0.15, 0.56), (0.13, 0.66)]
    head = arc((0, 0.96), 0.215, -52, 90, 14)
    return lathe([*FOOT, *stem, *collar(0.24, 0.72, 0.13), *head], 90, 56)


def bishop() -> Mesh:
    stem: Profile = [(0.26, 0.32), (0.19, 0.50), (0.15, 0.72), (0.135, 0.92)]
    mitre: Profile = [
        *[(0.15, 1.20), (0.20, 1.25), (0.235, 1.34), (0.225, 1.45), (0.17, 1.59), (0.095, 1.71)],
        (0.062, 1.745),
    ]
    finial = arc((0, 1.805), 0.075, -40, 90, 8)
    rings = [*collar(0.25, 0.97, 0.135), *collar(0.20, 1.09, 0.13)]
    return lathe([*FOOT, *stem, *rings, *mitre, *finial], 120, 56)


def rook() -> Mesh:
    """A rook with a hollow top; the scene cuts its battlements."""
    body: Profile = [(0.28, 0.34), (0.245, 0.48), (0.225, 0.65), (0.22, 0.80)]
    head: Profile = [
        *[(0.235, 0.92), (0.29, 0.97), (0.315, 1.0), (0.32, 1.03), (0.32, 1.15), (0.32, 1.25)],
        *[(0.315, 1.268), (0.30, 1.27), (0.23, 1.27), (0.215, 1.265), (0.21, 1.24), (0.21, 1.16)],
        *[(0.205, 1.125), (0.18, 1.12), (0.10, 1.12), (0.0, 1.12)],
    ]
    return lathe([*FOOT, *body, *collar(0.29, 0.84, 0.22), *head], 110, 56)


def king() -> Mesh:
    stem: Profile = [(0.28, 0.33), (0.21, 0.52), (0.17, 0.78), (0.155, 1.05)]
    crown: Profile = [
        *[(0.16, 1.33), (0.19, 1.44), (0.25, 1.58), (0.262, 1.62), (0.258, 1.65), (0.23, 1.675)],
        *[(0.15, 1.73), (0.10, 1.745), (0.07, 1.76), (0.062, 1.80), (0.04, 1.83), (0.0, 1.835)],
    ]
    rings = [*collar(0.28, 1.10, 0.155), *collar(0.22, 1.22, 0.15)]
    bars = [((0.075, 0.32, 0.075), 1.95), ((0.24, 0.075, 0.075), 1.985)]
    cross = [moved(rounded_box(size, 0.02), (0, y, 0)) for size, y in bars]
    return join(lathe([*FOOT, *stem, *rings, *crown], 120, 56), *cross)


def moved(mesh: Mesh, offset: tuple[float, float, float]) -> Mesh:
    return Mesh(mesh.positions + np.array(offset), mesh.normals, mesh.triangles)


def squares(color: int) -> Mesh:
    """The squares of one color of a board of 8 x 8, each 1 wide, their top at y = 0."""
    edge = 0.012 * np.array([-1.3, -0.4, 0.5, 1.4])  # few triangles: there are 32 of them
    half = np.array([0.4925, 0.1, 0.4925])
    axes = [np.concatenate([-h - edge[::-1], h + edge]) for h in half]
    square = carve(lambda p: box_distance(p, -half, half, 0.012), *axes)
    places = [(i - 3.5, -0.1, j - 3.5) for i in range(8) for j in range(8) if (i + j) % 2 == color]
    return join(*[moved(square, place) for place in places])


# --- A broken column --------------------------------------------------------------------------


def shaft(height: float, bottom: float, top: float, flutes: int) -> Mesh:
    """A fluted shaft with fillets; the flutes end in a round below both ends."""
    within = np.concatenate([[0, 0.07], 0.16 + 0.42 * (1 - np.cos(np.linspace(0, np.pi, 9)))])[:-1]
    angle = 2 * np.pi / flutes * (np.arange(flutes)[:, None] + within[None, :]).ravel()
    groove = np.tile(np.sqrt(np.clip(1 - ((within - 0.58) / 0.42) ** 2, 0, 1)), flutes)
    angle, groove = np.append(angle, 2 * np.pi), np.append(groove, groove[0])
    near_end = np.array([0.02, 0.1, 0.13, 0.15, 0.18, 0.22, 0.27, 0.32])
    ends = np.concatenate([near_end, np.linspace(0.6, height - 0.6, 6), height - near_end[::-1]])
    radius = bottom + (top - bottom) * (ends / height) ** 1.6
    end = np.minimum(ends, height - ends)
    depth = 0.055 * np.sqrt(np.clip(1 - (1 - (end - 0.12) / 0.17).clip(0, 1) ** 2, 0, 1))
    side = around_y(
        radius[:, None] - depth[:, None] * groove[None, :],
        ends[:, None] + 0 * angle[None, :],
        angle[None, :] + 0 * ends[:, None],
    )
    caps = [
        around_y(np.full((1, 1), r), y + 0 * angle[None, :], angle[None, :])
        for r, y in ((0.0, 0.0), (bottom - 0.02, 0.0), (top - 0.02, height), (0.0, height))
    ]
    positions = np.concatenate([*caps[:2], side, *caps[2:]])
    positions[:, -1] = positions[:, 0]
    normals = closed_normals(positions)
    normals[:2], normals[-2:] = (0, -1, 0), (0, 1, 0)
    return grid(positions, normals)


def attic_base() -> Mesh:
    """Two rolls with a hollow between them, on a plinth; its top at y = 0.62."""
    rolls: Profile = [
        *[(0.0, 0.18), (0.4, 0.18), (0.6, 0.18), (0.665, 0.185)],
        *arc((0.66, 0.265), 0.08, -80, 80, 9),
        *[(0.63, 0.352), (0.625, 0.375), (0.58, 0.385), (0.545, 0.42), (0.545, 0.46)],
        *[(0.575, 0.495), (0.58, 0.51)],
        *arc((0.58, 0.56), 0.05, -80, 80, 8),
        *[(0.55, 0.62), (0.3, 0.62), (0.0, 0.62)],
    ]
    plinth = moved(rounded_box((1.5, 0.2, 1.5), 0.015), (0, 0.1, 0))
    return join(plinth, lathe(rolls, 80, 96))


def fracture(seed: int, half_width: float, height: float, cells: int) -> Mesh:
    """A block with a fractured underside around y = 0: noise of all scales."""
    rng = np.random.default_rng(seed)
    frequency = np.hypot(*np.meshgrid(np.fft.fftfreq(cells), np.fft.rfftfreq(cells), indexing="ij"))
    spectrum = np.fft.rfft2(rng.standard_normal((cells, cells)))
    spectrum[0, 0] = 0
    relief = np.fft.irfft2(spectrum / np.maximum(frequency, 1 / cells) ** 1.75, s=(cells, cells))
    relief *= 0.14 / relief.std()
    x = np.linspace(-half_width, half_width, cells)
    x, z = np.meshgrid(x, x, indexing="ij")
    # Rings around the y axis of a square: the middle of the top, its rim, then the underside.
    lower = np.stack([x, relief, z], axis=-1)
    upper = np.stack([x, np.full_like(x, height), z], axis=-1)
    sheets = [
        *[(lower, -1), (upper, 1)],
        *[(np.stack([lower[i], upper[i]]), 0) for i in (0, -1)],
        *[(np.stack([lower[:, i], upper[:, i]]), 0) for i in (0, -1)],
    ]
    return join(*[sheet(positions, up) for positions, up in sheets])


def sheet(positions: Array, up: int) -> Mesh:
    """One side of the block, with normals up, down, or away from the y axis."""
    normals = np.cross(np.gradient(positions, axis=0), np.gradient(positions, axis=1))
    away = positions * (1, 0, 1) if up == 0 else np.broadcast_to((0, up, 0), positions.shape)
    turned = np.sign(np.sum(normals * away))
    return grid(positions, normals * turned)


# --- Turned wood and stone --------------------------------------------------------------------


def stand() -> Mesh:
    """A turned foot whose cup holds a ball of radius 1 with its middle at y = 1.8."""
    profile: Profile = [
        *[(0.0, 0.0), (0.5, 0.0), (0.70, 0.0), (0.735, 0.015), (0.74, 0.06), (0.72, 0.10)],
        *[(0.62, 0.13), (0.60, 0.15), (0.60, 0.18), (0.45, 0.24), (0.27, 0.33), (0.20, 0.43)],
        *[(0.20, 0.49), (0.26, 0.52), (0.275, 0.55), (0.26, 0.58), (0.21, 0.61), (0.23, 0.66)],
        *[(0.33, 0.74), (0.46, 0.84), (0.53, 0.91), (0.55, 0.945), (0.54, 0.962), (0.52, 0.96)],
        *arc((0, 1.8), 0.985, -59, -90, 10),
    ]
    return lathe(profile, 110, 88)


def bowl() -> Mesh:
    profile: Profile = [
        *[(0.0, 0.06), (0.30, 0.06), (0.40, 0.055), (0.415, 0.0), (0.46, 0.0), (0.49, 0.01)],
        *[(0.50, 0.06), (0.62, 0.12), (0.90, 0.28), (1.10, 0.52), (1.19, 0.80), (1.20, 0.95)],
        *[(1.19, 0.98), (1.165, 0.99), (1.14, 0.98), (1.125, 0.94), (1.10, 0.80), (1.01, 0.55)],
        *[(0.82, 0.34), (0.55, 0.20), (0.25, 0.145), (0.0, 0.14)],
    ]
    return lathe(profile, 96, 120)


def main() -> None:
    folder = Path(__file__).parent / "meshes"
    folder.mkdir(exist_ok=True)
    meshes = {
        "teapot": teapot(),
        "block": rounded_box((2, 2, 2), 0.03),
        "ball": ball(),
        "stand": stand(),
        "bowl": bowl(),
        "pawn": pawn(),
        "bishop": bishop(),
        "rook": rook(),
        "king": king(),
        "squares-light": squares(0),
        "squares-dark": squares(1),
        "column-shaft": shaft(4.0, 0.5, 0.43, 24),
        "column-base": attic_base(),
        "fracture": fracture(1, 1.6, 4.0, 56),
    }
    for name, mesh in meshes.items():
        write_ply(folder / f"{name}.ply", mesh, "docs/scenes/make_meshes.py")


if __name__ == "__main__":
    main()
