"""Meshes for the tests: one with an atlas that is known, and PLY files as arrays."""

from pathlib import Path

import numpy as np

SIDES = 6
MARGIN = 0.04
"""Between the charts, of the width of the atlas."""


def side(index: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A corner and two edges of a side of the cube [-1, 1]^3."""
    axis, sign = index // 2, 1 - 2 * (index % 2)
    edges = np.roll(np.eye(3), axis, axis=1)
    return sign * edges[0] - edges[1] - edges[2], 2 * edges[1], 2 * edges[2]


def chart(index: int) -> tuple[np.ndarray, float, float]:
    """Lower left corner, width and height in the atlas: three charts across, two up."""
    column, row = index % 3, index // 3
    width, height = 1 / 3 - 2 * MARGIN, 1 / 2 - 2 * MARGIN
    return np.array([column / 3 + MARGIN, row / 2 + MARGIN]), width, height


def cube_obj(path: Path) -> Path:
    """A cube with a chart for each of its sides."""
    lines = []
    for index in range(SIDES):
        corner, right, up = side(index)
        low, width, height = chart(index)
        for u, v in ((0, 0), (1, 0), (1, 1), (0, 1)):
            lines.append("v {} {} {}".format(*(corner + u * right + v * up)))
            lines.append(f"vt {low[0] + u * width:.9f} {low[1] + v * height:.9f}")
        first = 4 * index + 1
        lines.append("f " + " ".join(f"{first + i}/{first + i}" for i in range(4)))
    path.write_text("\n".join(lines) + "\n")
    return path


def cube_surface(uv: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Of points [..., 2] of its atlas: whether they are in a chart, the point of the cube, and how
    that moves with u and v [..., 2, 3]."""
    inside = np.zeros(uv.shape[:-1], bool)
    points = np.zeros((*uv.shape[:-1], 3))
    slopes = np.zeros((*uv.shape[:-1], 2, 3))
    for index in range(SIDES):
        corner, right, up = side(index)
        low, width, height = chart(index)
        at = (uv - low) / (width, height)
        here = ((at >= 0) & (at <= 1)).all(axis=-1)
        inside |= here
        points[here] = corner + at[here][:, :1] * right + at[here][:, 1:] * up
        slopes[here] = np.stack([right / width, up / height])
    return inside, points, slopes


def read_ply(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """The vertices of a binary PLY file, a structured array, and its triangles [face, 3]."""
    header, data = path.read_bytes().split(b"end_header\n", 1)
    lines = [line.split() for line in header.decode().splitlines()]
    counts = {words[1]: int(words[2]) for words in lines if words[0] == "element"}
    types = {"float": "<f4", "uchar": "u1"}
    fields = [(w[2], types[w[1]]) for w in lines if w[0] == "property" and w[1] in types]
    vertices = np.frombuffer(data, np.dtype(fields), counts["vertex"])
    face = np.dtype([("count", "u1"), ("corners", "<u4", 3)])
    faces = np.frombuffer(data, face, counts["face"], vertices.nbytes)
    assert (faces["count"] == 3).all()
    return vertices, faces["corners"]
