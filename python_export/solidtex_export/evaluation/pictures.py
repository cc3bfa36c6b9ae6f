"""Pictures as they are compared: 8-bit values, equally large crops, orientations.

A picture is a float32 array [row, column, channel], crops are [crop, row, column, channel]; values
are 0 ... 1 in steps of 1/255, because that is what a photograph has: an ordering of neighbours that
no picture file could hold must not count.
"""

from __future__ import annotations

import numpy as np

LUMA = np.array([0.299, 0.587, 0.114], dtype=np.float32)  # ITU-R BT.601
ORIENTATIONS = {"all": 8, "flips": 4, "none": 1}


def to_8_bit(values: np.ndarray) -> np.ndarray:
    """Values as a picture file would hold them."""
    return (np.rint(np.clip(values, 0, 1) * 255) / 255).astype(np.float32)


def luminance(pictures: np.ndarray) -> np.ndarray:
    """[..., channel] -> [...]: luma of three colour channels, otherwise the channels' mean."""
    if pictures.shape[-1] == 3:
        return pictures @ LUMA
    return pictures.mean(-1)


def random_crops(
    pictures: list[np.ndarray], side: int, count: int, rng: np.random.Generator
) -> np.ndarray:
    """`count` crops at random places, taken from the pictures in turn."""
    return np.stack([_random_crop(pictures[i % len(pictures)], side, rng) for i in range(count)])


def _random_crop(picture: np.ndarray, side: int, rng: np.random.Generator) -> np.ndarray:
    row, column = (int(rng.integers(extent - side + 1)) for extent in picture.shape[:2])
    return picture[row : row + side, column : column + side]


def oriented(crops: np.ndarray, symmetry: str) -> np.ndarray:
    """Crop i in orientation i of those in which the material looks just as right.

    "all" are the eight of a square, "flips" those without a quarter turn, "none" as they are: the
    choice of `solidtex-train --symmetry`.
    """
    return np.stack([_oriented(c, i % ORIENTATIONS[symmetry]) for i, c in enumerate(crops)])


def _oriented(crop: np.ndarray, index: int) -> np.ndarray:
    if index & 1:
        crop = crop[::-1]
    if index & 2:
        crop = crop[:, ::-1]
    return crop.transpose(1, 0, 2) if index & 4 else crop


def crop_side(picture: np.ndarray, wanted: int) -> int:
    """The largest crop, up to `wanted`, of which two fit side by side."""
    longer, shorter = max(picture.shape[:2]), min(picture.shape[:2])
    return min(wanted, longer // 2, shorter)


def halvings(picture: np.ndarray, side: int) -> list[tuple[np.ndarray, np.ndarray]]:
    """Left and right half, top and bottom half: those pairs in which each holds a crop."""
    rows, columns = picture.shape[0] // 2, picture.shape[1] // 2
    pairs = []
    if columns >= side:
        pairs.append((picture[:, :columns], picture[:, -columns:]))
    if rows >= side:
        pairs.append((picture[:rows], picture[-rows:]))
    return pairs
