"""Sizes and directions of structures in crops, for comparing slices of different normals."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter

from solidtex_export.evaluation.metrics.autocorrelation import correlation
from solidtex_export.evaluation.pictures import luminance

GRADIENT_SIGMA = 1.0  # pixels
COARSE_SIGMA = 4.0  # pixels: bands of a dozen and more, that fine grain hides from the other
LOCAL_SIGMA = 6.0  # pixels: the window of the local structure tensor

Values = float | np.ndarray


@dataclass(frozen=True)
class Directionality:
    """Lengths of structures across and down (pixels), and their anisotropy.

    Lengths are the lags at which the autocorrelation of luminance falls to one half (None where it
    never does). `coherence` is that of the mean structure tensor (Bigün and Granlund 1987), (l1 -
    l2) / (l1 + l2): 0 for isotropic structures, 1 for a single direction; `angle` is that
    direction, degrees counterclockwise from the right, 0 ... 180. `coarse_coherence` and
    `coarse_angle` use derivatives at sigma = 4 pixels, which respond to wide bands.
    `local_coherence` is the mean of the coherence of the tensor in a Gaussian window of 6 pixels:
    streaks of varying direction raise it, and leave the others unchanged.
    """

    length_across: float | None
    length_down: float | None
    coherence: float
    angle: float
    coarse_coherence: float
    coarse_angle: float
    local_coherence: float


def directionality(crops: np.ndarray) -> Directionality:
    """Measure crops [crop, row, column, channel] in their original orientation."""
    gray = luminance(crops)
    middle = gray.shape[1] // 2
    rho = correlation(gray[..., None], middle)[..., 0]
    xx, yy, xy = tensor = _structure_tensor(gray, GRADIENT_SIGMA)
    mean, coarse_mean = (
        [float(part.mean()) for part in parts]
        for parts in (tensor, _structure_tensor(gray, COARSE_SIGMA))
    )
    smooth = [gaussian_filter(part, (0, LOCAL_SIGMA, LOCAL_SIGMA)) for part in (xx, yy, xy)]
    return Directionality(
        length_across=half_length(rho[middle, middle:]),
        length_down=half_length(rho[middle:, middle]),
        coherence=float(_coherence(*mean)),
        angle=_angle(*mean),
        coarse_coherence=float(_coherence(*coarse_mean)),
        coarse_angle=_angle(*coarse_mean),
        local_coherence=float(_coherence(*smooth).mean()),
    )


def half_length(rho: np.ndarray) -> float | None:
    """Lag at which rho [lag], which starts with 1, falls to one half; linearly interpolated."""
    below = np.flatnonzero(rho <= 0.5)
    if not len(below):
        return None
    lag = int(below[0])
    if lag == 0:  # a constant image
        return 0.0
    return float(lag - 1 + (rho[lag - 1] - 0.5) / (rho[lag - 1] - rho[lag]))


def _structure_tensor(gray: np.ndarray, sigma: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Products of the derivatives to the right and upwards: xx, yy and xy."""
    up = -gaussian_filter(gray, (0, sigma, sigma), (0, 1, 0))
    right = gaussian_filter(gray, (0, sigma, sigma), (0, 0, 1))
    return np.square(right), np.square(up), right * up


def _coherence(xx: Values, yy: Values, xy: Values) -> np.ndarray:
    return np.hypot(xx - yy, 2 * xy) / np.maximum(xx + yy, 1e-12)


def _angle(xx: float, yy: float, xy: float) -> float:
    steepest = 0.5 * np.degrees(np.arctan2(2 * xy, xx - yy))  # things run at a right angle to it
    return float((steepest + 90) % 180)
