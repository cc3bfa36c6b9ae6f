"""FDMSE, the mean squared difference of Fourier magnitudes (STS-GAN 2022, section 4.4)."""

from __future__ import annotations

import numpy as np
import scipy.fft


class FourierMagnitudes:
    """FDMSE = mean over frequencies k and channels of (M_a(k) - M_b(k))^2.

    M(k) is the mean over the crops of |F(crop - its mean)(k)|, F the orthonormal two-dimensional
    discrete Fourier transform. The paper says only "calculate the magnitude based on the image
    frequency domain, and then proceed with the calculation of mean squared error". Averaging over
    crops, removing the mean and orthonormal scaling are ours: of a single crop, magnitudes are
    mostly chance, and the mean color would outweigh all else. So the values cannot be compared
    with those of the paper's table 1.
    """

    name = "fdmse"
    title = "FDMSE"

    def features(self, crops: np.ndarray) -> np.ndarray:
        """M [row frequency, column frequency, channel]."""
        centered = crops - crops.mean((1, 2), keepdims=True)
        return np.abs(scipy.fft.fft2(centered, axes=(1, 2), norm="ortho")).mean(0)

    def distance(self, first: np.ndarray, second: np.ndarray) -> float:
        return float(np.square(first - second).mean())
