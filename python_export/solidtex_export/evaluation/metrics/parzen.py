"""Average log-likelihood of patches by Parzen windows, as GramGAN (2020, section 4) uses it."""

from __future__ import annotations

import math

import numpy as np
from scipy.special import logsumexp

SIDES = (16, 8, 4)  # pixels of a patch: the paper begins with large ones and reduces them
KERNELS = 1024  # patches of the truth
SAMPLES = 512  # patches of what is measured
BANDWIDTHS = np.geomspace(0.02, 0.5, 12)  # deviations of the Gaussian kernel, values 0 ... 1


def random_patches(crops: np.ndarray, side: int, count: int) -> np.ndarray:
    """Up to `count` patches [patch, value] at random places of crops."""
    windows = np.lib.stride_tricks.sliding_window_view(crops, (side, side), axis=(1, 2))
    places = math.prod(windows.shape[:3])
    chosen = np.random.default_rng(0).choice(places, min(places, count), replace=False)
    patches = windows[np.unravel_index(chosen, windows.shape[:3])]
    return patches.reshape(len(chosen), -1).astype(np.float64)


class ParzenWindows:
    """Density of the patches of true crops: a Gaussian kernel on each.

    The bandwidth is the one of BANDWIDTHS under which other true crops are likeliest.
    """

    def __init__(self, truth: np.ndarray, held_out: np.ndarray, side: int) -> None:
        self._side = side
        self._patches = random_patches(truth, side, KERNELS)
        others = self._squared_distances(held_out)
        found = [self._mean(others, bandwidth) for bandwidth in BANDWIDTHS]
        self.bandwidth = float(BANDWIDTHS[np.argmax(found)])
        self.held_out = float(max(found))
        """Average log-likelihood of the held-out crops."""

    def average_log_likelihood(self, crops: np.ndarray) -> float:
        """Mean over patches of crops of the density's natural logarithm."""
        return self._mean(self._squared_distances(crops), self.bandwidth)

    def _squared_distances(self, crops: np.ndarray) -> np.ndarray:
        """[patch of crops, kernel]."""
        patches = random_patches(crops, self._side, SAMPLES)
        squares = np.square(patches).sum(1)[:, None] + np.square(self._patches).sum(1)
        return (squares - 2 * patches @ self._patches.T).clip(0)

    def _mean(self, squares: np.ndarray, bandwidth: float) -> float:
        count, values = self._patches.shape
        scale = math.log(count) + values / 2 * math.log(2 * math.pi * bandwidth**2)
        return float(logsumexp(squares / (-2 * bandwidth**2), axis=1).mean() - scale)
