"""A cube of a solid with the corner nearest to the viewer cut out, in isometric projection."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

# An orthonormal frame: the viewer looks from (1, 1, 1); z is up on the picture.
RIGHT = np.array([-1.0, 1.0, 0.0]) / np.sqrt(2)
UP = np.array([-1.0, -1.0, 2.0]) / np.sqrt(6)
VIEW = np.array([1.0, 1.0, 1.0]) / np.sqrt(3)
BRIGHTNESS = (0.82, 0.92, 1.0)  # of faces normal to x, y and z
CUT = 0.5
EXTENT = 1.66  # of the picture, in sides of the cube: its hexagon is 1.63 high


def draw_cut_cube(block: np.ndarray, side: int) -> np.ndarray:
    """A picture [side, side, channel] on white of a block [x, y, z, channel] with equal edges."""
    steps = (np.arange(side) + 0.5) / side - 0.5
    across, up = np.meshgrid(EXTENT * steps, -EXTENT * steps)
    origins = 0.5 + across[..., None] * RIGHT + up[..., None] * UP
    picture = np.ones((side, side, block.shape[3]), dtype=np.float32)
    for axis, points, hit in _faces(origins):
        # A point on a face belongs to the voxel below it, which is still there.
        voxels = np.ceil(points[hit] * block.shape[0]).astype(int).clip(min=1) - 1
        picture[hit] = BRIGHTNESS[axis] * block[tuple(voxels.T)]
    return picture


def _faces(origins: np.ndarray) -> Iterator[tuple[int, np.ndarray, np.ndarray]]:
    """Axis, points [row, column, 3] in the cube, and where they are on the face, for six faces.

    No face hides another: the outer ones lack exactly the corner through which the inner ones are
    seen.
    """
    for axis in range(3):
        others = [a for a in range(3) if a != axis]
        for plane in (1.0, CUT):
            distance = (plane - origins[..., axis]) / VIEW[axis]
            points = origins + distance[..., None] * VIEW
            points[..., axis] = plane  # exactly
            flat = points[..., others]
            cut_out = (flat > CUT).all(-1)
            inside = ((flat >= 0) & (flat <= 1)).all(-1)
            yield axis, points.clip(0, 1), inside & (cut_out if plane == CUT else ~cut_out)
