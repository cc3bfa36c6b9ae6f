"""Power spectrum by frequency and direction, in decibels."""

from __future__ import annotations

import numpy as np
import torch

from solidtex_export.losses.spectrum import bands_of, power

FLOOR = 12**-0.5 / 255  # deviation of what rounding to 8 bits adds


class PowerSpectrum:
    """Root mean square difference of power in decibels, over frequency bands and channels.

    Bands and power are those of losses/spectrum.py: 16 x 8 rectangles of frequencies, those that
    rise to the right apart from those that fall, of crops with faded borders. All bands have equal
    weight, so the metric responds to weaves, blur and noise whatever their share of the power; the
    coarsest frequencies dominate FDMSE. It ignores shapes.
    """

    name = "spectrum"
    title = "spectrum"

    def features(self, crops: np.ndarray) -> np.ndarray:
        """Decibels [channel, band of rows, band of columns]."""
        images = torch.from_numpy(np.ascontiguousarray(crops.transpose(0, 3, 1, 2))).float()
        found = power(images, bands_of(crops.shape[1]), FLOOR)
        return 10 * np.log10(found.numpy())

    def distance(self, first: np.ndarray, second: np.ndarray) -> float:
        return float(np.sqrt(np.square(first - second).mean()))
