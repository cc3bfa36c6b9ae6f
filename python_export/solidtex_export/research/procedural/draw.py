"""Random parameters, one per image of a batch."""

from __future__ import annotations

import math

import torch
from torch import Tensor


class Draw:
    """Seeded random source; parameters of images have the shape [count, 1, 1]."""

    def __init__(self, seed: int, count: int, size: int) -> None:
        self.count = count
        self.size = size  # side of the images, in pixels
        self.generator = torch.Generator().manual_seed(seed)

    def unit(self, *shape: int) -> Tensor:
        """Uniform in 0 ... 1."""
        return torch.rand(shape, generator=self.generator)

    def normal(self, *shape: int) -> Tensor:
        return torch.randn(shape, generator=self.generator)

    def uniform(self, low: float, high: float) -> Tensor:
        return low + (high - low) * self.unit(self.count, 1, 1)

    def log_uniform(self, low: float, high: float) -> Tensor:
        return torch.exp(self.uniform(math.log(low), math.log(high)))

    def chance(self, probability: float) -> Tensor:
        """1 with the given probability, else 0."""
        return (self.unit(self.count, 1, 1) < probability).float()

    def integer(self, low: int, high: int) -> Tensor:
        """Integers low ... high, both included, as floats."""
        return self.uniform(low, high + 1).floor().clamp(max=high)

    def one_of(self, choices: int) -> int:
        """An index shared by the whole batch."""
        return int(torch.randint(choices, (), generator=self.generator))
