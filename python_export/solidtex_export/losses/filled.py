"""Selection of channels that are not empty."""

from __future__ import annotations

from torch import Tensor

EMPTY = 0.06  # deviation of a whitened channel; rounding to 8 bits is 0.04 of marble, 0.05 of wood


def filled_channels(photograph: Tensor) -> Tensor:
    """Mask [channel] of the channels of a whitened photograph [channel, rows, columns] that vary.

    Two channels of a gray photograph hold rounding errors only, which must not be learned.
    """
    deviations = photograph.std((1, 2))
    return deviations >= min(EMPTY, float(deviations.max()))
