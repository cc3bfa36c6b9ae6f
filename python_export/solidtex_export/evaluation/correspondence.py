"""Correspondence map of copies from the exemplar: Gutierrez et al. 2020, figure 13."""

from __future__ import annotations

import numpy as np

NEIGHBORHOOD = 4  # pixels, as in the figure
CHUNK = 1024  # neighborhoods compared at a time: bounds the memory


def correspondence(picture: np.ndarray, exemplar: np.ndarray) -> np.ndarray:
    """Place in `exemplar` of the most similar neighborhood of every pixel: int [row, column, 2].

    Neighborhoods of `picture` are 4 x 4 pixels, with all channels, compared by squared differences.
    """
    ours, theirs = _neighborhoods(picture), _neighborhoods(exemplar)
    flat, candidates = ours.reshape(-1, ours.shape[-1]), theirs.reshape(-1, theirs.shape[-1])
    # |a - b|^2 = |a|^2 - 2 a.b + |b|^2, and |a|^2 does not change the order.
    center = candidates.mean(0)
    flat, candidates = flat - center, candidates - center
    half_norms = 0.5 * np.square(candidates).sum(1)
    best = [
        np.argmin(half_norms - flat[i : i + CHUNK] @ candidates.T, axis=1)
        for i in range(0, len(flat), CHUNK)
    ]
    places = np.unravel_index(np.concatenate(best), theirs.shape[:2])
    return np.stack(places, axis=-1).reshape(*ours.shape[:2], 2)


def coherence(places: np.ndarray) -> float:
    """Share of neighboring pixels whose places in the exemplar are neighbors in the same way.

    A verbatim copy has 1.
    """
    right = (np.diff(places, axis=1) == (0, 1)).all(-1)
    down = (np.diff(places, axis=0) == (1, 0)).all(-1)
    return float((right.mean() + down.mean()) / 2)


def as_colors(places: np.ndarray, exemplar_shape: tuple[int, ...]) -> np.ndarray:
    """The map as an image [row, column, 3], row as red, column as green; copies are smooth."""
    extent = np.maximum(np.array(exemplar_shape[:2]) - NEIGHBORHOOD, 1)
    red, green = np.moveaxis(places / extent, -1, 0)
    return np.stack([red, green, 1 - (red + green) / 2], axis=-1).astype(np.float32)


def _neighborhoods(picture: np.ndarray) -> np.ndarray:
    window = (NEIGHBORHOOD, NEIGHBORHOOD)
    windows = np.lib.stride_tricks.sliding_window_view(picture, window, axis=(0, 1))
    return windows.reshape(*windows.shape[:2], -1)
