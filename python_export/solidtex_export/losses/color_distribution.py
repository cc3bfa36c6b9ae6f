"""Color distribution loss: sliced Wasserstein distance of pixels, on several octaves.

Rabin, Peyré, Delon and Bernot 2012, "Wasserstein barycenter and its application to texture mixing".
A slice is compared with the whole exemplar, since crops with different shares of colors would pull
it towards their barycenter. The loss starts late: docs/experiments/color-distribution.md.
"""

from __future__ import annotations

import torch
import torch.nn.functional as F
from torch import Tensor

OCTAVES = 3
DIRECTIONS = 6  # of each octave, new for every call


def color_distance(slices: Tensor, exemplar: Tensor) -> Tensor:
    """Sum over octaves of the mean squared distance of sorted projections.

    Whitened values: `slices` [batch, channel, rows, columns], `exemplar` [channel, rows, columns].
    """
    exemplar = exemplar[None]
    distance = _sliced_wasserstein(slices, exemplar)
    for _ in range(OCTAVES - 1):
        if min(*slices.shape[2:], *exemplar.shape[2:]) < 2:
            break
        slices, exemplar = F.avg_pool2d(slices, 2), F.avg_pool2d(exemplar, 2)
        distance = distance + _sliced_wasserstein(slices, exemplar)
    return distance


def _sliced_wasserstein(slices: Tensor, exemplar: Tensor) -> Tensor:
    fakes, reals = (images.float().transpose(0, 1).flatten(1) for images in (slices, exemplar))
    directions = F.normalize(torch.randn(DIRECTIONS, len(fakes)), dim=1).to(fakes.device)
    fake, real = ((directions @ colors).sort(dim=1).values for colors in (fakes, reals))
    even = (torch.arange(fake.shape[1], device=real.device) + 0.5) / fake.shape[1]
    return (fake - real[:, (even * real.shape[1]).long()]).square().mean()
