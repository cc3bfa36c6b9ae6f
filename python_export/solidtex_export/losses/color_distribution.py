"""Color distribution loss: sliced Wasserstein distance of pixels, on several octaves.

Rabin, Peyré, Delon and Bernot 2012, "Wasserstein barycenter and its application to texture mixing".
A slice is compared with the whole exemplar, since crops with different shares of colors would pull
it towards their barycenter. The loss starts late: docs/experiments/color-distribution.md.
"""

from __future__ import annotations

from typing import NamedTuple

import torch
import torch.nn.functional as F
from torch import Tensor

OCTAVES = 3
BANK = 64  # directions of each octave
DIRECTIONS = 6  # of them, drawn anew for every call


class ColorDistribution:
    """Compares slices with one exemplar [channel, rows, columns], both of whitened values.

    The exemplar's projections are sorted once, for as many directions as `BANK` holds.
    """

    def __init__(self, exemplar: Tensor) -> None:
        self._octaves = [exemplar]
        while len(self._octaves) < OCTAVES and min(self._octaves[-1].shape[1:]) >= 2:
            self._octaves.append(F.avg_pool2d(self._octaves[-1], 2))
        self._banks: dict[tuple[int, int], _Bank] = {}

    def __call__(self, slices: Tensor) -> Tensor:
        """Sum over octaves of the mean squared distance of sorted projections of `slices` [batch,
        channel, rows, columns].
        """
        distances = []
        for octave, exemplar in enumerate(self._octaves):
            if octave:
                if min(slices.shape[2:]) < 2:
                    break
                slices = F.avg_pool2d(slices, 2)
            pixels = slices.float().transpose(0, 1).flatten(1)
            key = octave, pixels.shape[1]
            if key not in self._banks:
                self._banks[key] = _bank(exemplar.flatten(1), pixels.shape[1])
            directions, sorted_reals = self._banks[key]
            picked = torch.randperm(BANK)[:DIRECTIONS].to(pixels.device)
            fakes = (directions[picked] @ pixels).sort(dim=1).values
            distances.append((fakes - sorted_reals[picked]).square().mean())
        return torch.stack(distances).sum()


class _Bank(NamedTuple):
    """Directions [BANK, channel], and the exemplar's sorted projections [BANK, pixel]."""

    directions: Tensor
    projections: Tensor


def _bank(colors: Tensor, count: int) -> _Bank:
    """Random directions, the same for every training, and `count` evenly spaced quantiles of the
    projections of `colors` [channel, pixel].
    """
    generator = torch.Generator().manual_seed(0)
    normal = torch.randn(BANK, len(colors), generator=generator)
    directions = F.normalize(normal, dim=1).to(colors.device)
    projections = (directions @ colors).sort(dim=1).values
    even = (torch.arange(count, device=colors.device) + 0.5) / count
    return _Bank(directions, projections[:, (even * colors.shape[1]).long()])
