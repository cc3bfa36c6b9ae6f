"""LBP distance: multi-scale local binary patterns (Ojala, Pietikäinen, Mäenpää 2002)."""

from __future__ import annotations

import numpy as np
from skimage.feature import local_binary_pattern

from solidtex_export.evaluation.pictures import LUMA

RADII = range(1, 9)  # pixels
NEIGHBORS = 8
PATTERNS = 59  # of 8 neighbors: 58 with at most two changes around the circle, and all others


class LbpDistance:
    """L1 distance of histograms of local binary patterns, averaged over the radii 1 to 8.

    A pattern says which of 8 points on a circle are at least as bright as its center (bilinear
    between pixels, circles that leave the crop are left out). Orientation counts: 58 uniform
    patterns and one bin for the rest ("nri_uniform" of scikit-image). The channel is the luma of
    three color channels; otherwise the distance is averaged over the channels. It is between 0 and
    2. Unlike the other metrics it ignores brightness and contrast, and compares the shapes of
    outlines.
    """

    name = "binary_patterns"
    title = "LBP distance"

    def features(self, crops: np.ndarray) -> np.ndarray:
        """Histograms [channel, radius, pattern], each of sum 1."""
        if crops.shape[3] == 3:
            crops = (crops @ LUMA)[..., None]
        # Integers keep ties of 8-bit values exact, and thousandths those of their luma.
        levels = np.rint(crops * 255_000).astype(np.int32)
        return np.stack([_histograms(levels[..., c]) for c in range(crops.shape[3])])

    def distance(self, first: np.ndarray, second: np.ndarray) -> float:
        return float(np.abs(first - second).sum(-1).mean())


def _histograms(crops: np.ndarray) -> np.ndarray:
    histograms = np.zeros((len(RADII), PATTERNS))
    for index, radius in enumerate(RADII):
        for crop in crops:
            patterns = local_binary_pattern(crop, NEIGHBORS, radius, "nri_uniform")
            inner = patterns[radius:-radius, radius:-radius].astype(int)
            histograms[index] += np.bincount(inner.ravel(), minlength=PATTERNS)
    return histograms / histograms.sum(-1, keepdims=True)
