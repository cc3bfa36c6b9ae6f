"""Images for comparison: 8-bit values, equally large crops, orientations.

An image is a float32 array [row, column, channel], crops are [crop, row, column, channel]. Values
are 0 ... 1 in steps of 1/255, as in a photograph: an order of neighbors that no image file could
hold must not count.
"""

from __future__ import annotations

import numpy as np
from PIL import Image

LUMA = np.array([0.299, 0.587, 0.114], dtype=np.float32)  # ITU-R BT.601
ORIENTATIONS = {"all": 8, "flips": 4, "none": 1}

CUBE_RIGHT = np.array([-1.0, 1.0, 0.0]) / np.sqrt(2)  # seen from (1, 1, 1), with z up
CUBE_UP = np.array([-1.0, -1.0, 2.0]) / np.sqrt(6)
CUBE_EXTENT = 1.66  # of the image, in sides of the cube: its hexagon is 1.63 high
BRIGHTNESS = (0.82, 0.92, 1.0)  # of faces normal to x, y and z


def to_8_bit(values: np.ndarray) -> np.ndarray:
    """Quantize values as an image file would."""
    return (np.rint(np.clip(values, 0, 1) * 255) / 255).astype(np.float32)


def luminance(pictures: np.ndarray) -> np.ndarray:
    """[..., channel] -> [...]: luma of three color channels, otherwise the channels' mean."""
    if pictures.shape[-1] == 3:
        return pictures @ LUMA
    return pictures.mean(-1)


def random_crops(
    pictures: list[np.ndarray], side: int, count: int, rng: np.random.Generator
) -> np.ndarray:
    """`count` crops at random places, taken from the images in turn."""
    return np.stack([_random_crop(pictures[i % len(pictures)], side, rng) for i in range(count)])


def _random_crop(picture: np.ndarray, side: int, rng: np.random.Generator) -> np.ndarray:
    row, column = (int(rng.integers(extent - side + 1)) for extent in picture.shape[:2])
    return picture[row : row + side, column : column + side]


def oriented(crops: np.ndarray, symmetry: str) -> np.ndarray:
    """Turn crop i to orientation i of `symmetry`.

    "all" are the eight of a square, "flips" those without a quarter turn, "none" the original: the
    values of `solidtex-train --symmetry`.
    """
    return np.stack([_oriented(c, i % ORIENTATIONS[symmetry]) for i, c in enumerate(crops)])


def _oriented(crop: np.ndarray, index: int) -> np.ndarray:
    if index & 1:
        crop = crop[::-1]
    if index & 2:
        crop = crop[:, ::-1]
    return crop.transpose(1, 0, 2) if index & 4 else crop


def crop_side(picture: np.ndarray, wanted: int) -> int:
    """Side of the largest crop, up to `wanted`, of which two fit side by side."""
    longer, shorter = max(picture.shape[:2]), min(picture.shape[:2])
    return min(wanted, longer // 2, shorter)


def halvings(picture: np.ndarray, side: int) -> list[tuple[np.ndarray, np.ndarray]]:
    """Left and right half, top and bottom half: the pairs in which each half holds a crop."""
    rows, columns = picture.shape[0] // 2, picture.shape[1] // 2
    pairs = []
    if columns >= side:
        pairs.append((picture[:, :columns], picture[:, -columns:]))
    if rows >= side:
        pairs.append((picture[:rows], picture[-rows:]))
    return pairs


def draw_cut_cube(block: np.ndarray, side: int) -> np.ndarray:
    """An image [side, side, channel] on white of a block [x, y, z, channel] with equal edges.

    The cube stands in isometric projection, seen from (1, 1, 1), without its nearest corner: its
    outer faces and the slices through its middle are sheared and pasted.
    """
    count = block.shape[0]
    picture = np.ones((side, side, block.shape[3]), np.float32)
    corner = np.arange(count) >= count // 2
    is_corner = corner[:, None] & corner[None]
    for axis in range(3):
        planes = (np.take(block, index, axis) for index in (-1, (count - 1) // 2))
        for depth, plane, mask in zip((1.0, 0.5), planes, (~is_corner, is_corner), strict=True):
            shear = _face_of_picture(axis, depth, side, count)
            inside = _sheared(mask.astype(np.float32), shear, side) > 0
            for channel in range(block.shape[3]):
                face = BRIGHTNESS[axis] * plane[..., channel]
                picture[..., channel][inside] = _sheared(face, shear, side)[inside]
    return picture


def _face_of_picture(axis: int, depth: float, side: int, count: int) -> np.ndarray:
    """Map pixels (column, row, 1) to voxels of the face at `depth` of an axis."""
    pixels_per_unit = side / CUBE_EXTENT
    columns = CUBE_RIGHT * pixels_per_unit, -CUBE_UP * pixels_per_unit
    others = [a for a in range(3) if a != axis]
    linear = np.array([[c[a] / count for a in reversed(others)] for c in columns])
    start = np.full(3, -0.5)
    start[axis] += depth
    offset = [start @ c + side / 2 for c in columns]
    inverse = np.linalg.inv(linear)
    return np.column_stack([inverse, -inverse @ offset])


def _sheared(face: np.ndarray, shear: np.ndarray, side: int) -> np.ndarray:
    image = Image.fromarray(np.ascontiguousarray(face, np.float32))
    affine = Image.Transform.AFFINE
    return np.asarray(image.transform((side, side), affine, tuple(shear.ravel()), fillcolor=0))
