"""One realization of a lattice generator's noise, for evaluating one solid in parts."""

from __future__ import annotations

import math

import torch
from torch import Tensor

from solidtex_export.generators.lattice import BaseLattice, Box
from solidtex_export.generators.planes import XYZ, Axes
from solidtex_export.generators.sampler import HashedLattice


class FixedNoise:
    """Noise as a function of position. Only the evaluated part is held in memory."""

    def __init__(self, generator: BaseLattice) -> None:
        self.generator = generator
        device = generator.color_mean.device
        channels = generator.noise_channels
        self._lattices = [HashedLattice(channels, device) for _ in range(generator.levels)]

    def colors(self, box: Box, axes: Axes = XYZ) -> Tensor:
        """Channels [channel, ...] of `box`, its spatial axes in the order `axes`."""
        box = box.permuted(axes)
        y = self.generator(self.draw(box, axes), box, axes)
        return self.generator.colors(y)[0]

    def draw(self, box: Box, axes: Axes) -> list[Tensor]:
        """Noise for a box with axes in the order `axes`, as BaseLattice.draw_noise returns it."""
        boxes = zip(self._lattices, self.generator.noise_boxes(box), strict=True)
        return [self._level(lattice, b, axes) for lattice, b in boxes]

    def _level(self, lattice: HashedLattice, box: Box, axes: Axes) -> Tensor:
        like = self.generator.color_mean
        ranges = [
            torch.arange(l, h, device=like.device) for l, h in zip(box.lo, box.hi, strict=True)
        ]
        grids = torch.meshgrid(*ranges, indexing="ij")
        cells = torch.stack([grids[axes.index(a)].flatten() for a in range(3)], dim=-1)
        channels = self.generator.noise_channels
        values = lattice(cells.expand(channels, -1, -1))
        if self.generator.distribution == "uniform":
            values = (1 + torch.erf(values / math.sqrt(2))) / 2
        return values.view(1, channels, *box.size).to(like.dtype)
