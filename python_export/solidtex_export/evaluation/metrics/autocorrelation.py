"""Autocorrelation, for the metric, correlation lengths and the repetition test."""

from __future__ import annotations

import numpy as np
import scipy.fft

LARGEST_LAG = 0.25  # of the crop: farther lags are mostly chance


def covariance_by_lag(
    first: np.ndarray, second: np.ndarray, largest: tuple[int, ...]
) -> tuple[np.ndarray, np.ndarray]:
    """Mean of first(x) second(x + lag) over all x where both exist, and their number.

    Arrays of the same shape, over any number of axes; the results have 2 * largest + 1 entries on
    each axis, lag 0 in the middle. Not circular: the transform is padded.
    """
    extents = list(zip(first.shape, largest, strict=True))
    padded = [scipy.fft.next_fast_len(n + most, real=True) for n, most in extents]
    spectrum = np.conj(scipy.fft.rfftn(first, padded)) * scipy.fft.rfftn(second, padded)
    sums = scipy.fft.irfftn(spectrum, padded)
    count = np.ones(())
    for axis, (extent, most) in enumerate(extents):
        lags = np.arange(-most, most + 1)
        sums = np.take(sums, lags, axis=axis)  # negative lags wrap around
        count = np.multiply.outer(count, extent - np.abs(lags))
    return sums / count, count


def correlation(crops: np.ndarray, largest: int) -> np.ndarray:
    """Correlation coefficients by lag [2 largest + 1, 2 largest + 1, channel] of crops.

    Mean and variance are those of all crops together. A constant channel has coefficient 0.
    """
    centered = (crops - crops.mean((0, 1, 2))).astype(np.float64)
    maps = []
    for channel in range(crops.shape[3]):
        variance = np.square(centered[..., channel]).mean()
        total = sum(covariance_by_lag(c, c, (largest, largest))[0] for c in centered[..., channel])
        maps.append(total / (len(crops) * max(variance, 1e-12)))
    return np.stack(maps, axis=-1)


class Autocorrelation:
    """Root mean square difference of the correlation coefficients.

    The mean is over all lags of up to a quarter of the crop on each axis, and over the channels.
    The metric compares sizes, spacings and directions, whatever the contrast; the loss L_C of
    Babichev and Frolov 2021 compares the same maps.
    """

    name = "autocorrelation"
    title = "autocorrelation"

    def features(self, crops: np.ndarray) -> np.ndarray:
        return correlation(crops, int(crops.shape[1] * LARGEST_LAG))

    def distance(self, first: np.ndarray, second: np.ndarray) -> float:
        return float(np.sqrt(np.square(first - second).mean()))
