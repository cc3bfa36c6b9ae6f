"""Oblique slices of the lattice family.

STS-GAN (Zhao et al. 2022), section 4.1, "45-degree-added slicing"; here at any angle. A thin block
of voxels around the plane is generated and read by cubic convolution, as the engine evaluates
between voxel centers. Losses therefore see the softness of that interpolation, and training
compensates it.
"""

from __future__ import annotations

import math

import torch
import torch.nn.functional as F
from torch import Tensor

from solidtex_export.generators.lattice import BaseLattice, Box

BEFORE, AFTER = 1, 3  # voxels that a point between voxels takes part of, from its own on


class ObliqueSlices:
    """Planes that contain one of `axes`, at random angles and offsets modulo 2^K."""

    def __init__(self, generator: BaseLattice, axes: str) -> None:
        self.generator = generator
        self.axes = axes
        self.period = 2 ** (generator.levels - 1)

    def draw(self, direction: str, size: int, batch: int) -> Tensor:
        """Whitened slices [batch, channel, size, size]; `direction` is ignored."""
        axis = "xyz".index(self.axes[int(torch.randint(len(self.axes), ()))])
        angle = math.pi * float(torch.rand(()))
        offset = torch.rand(2).tolist()
        lo = [int(v) for v in torch.randint(self.period, (3,))]
        # Positions along the other two axes, in voxels from the first voxel's center.
        steps = torch.arange(size, dtype=torch.float64)
        u, v = math.cos(angle) * steps, math.sin(angle) * steps
        u, v = u - u.min() + BEFORE + offset[0], v - v.min() + BEFORE + offset[1]
        extent = (size, int(u.max()) + AFTER, int(v.max()) + AFTER)
        box = Box(tuple(lo), tuple(start + e for start, e in zip(lo, extent, strict=True)))
        others = [a for a in range(3) if a != axis]
        order = (axis, others[0], others[1])
        noise = self.generator.draw_noise(box, batch)
        block = self.generator(noise, box, order)
        return cubic_columns(block, u, v).flip(2)

    def view(self, direction: str) -> str:
        """None: the planes have any angle."""
        return ""


def cubic_columns(block: Tensor, u: Tensor, v: Tensor) -> Tensor:
    """Interpolate block [batch, channel, row, i, j] at (i, j) = (u, v): [batch, channel, row,
    column].

    The kernel is the engine's cubic convolution (engine/filter/reconstruction.h) with torch's a,
    for rows on voxel centers. The block begins BEFORE voxels before u and v, and ends AFTER after
    them.
    """
    batch, channels, rows, *extent = block.shape
    scaled = [2 * t / (e - 1) - 1 for t, e in zip((u, v), extent, strict=True)]
    grid = torch.stack(scaled[::-1], dim=-1).to(block.device, torch.float32)  # x is the last axis
    planes = block.float().reshape(batch, channels * rows, *extent)
    grid = grid.view(1, 1, -1, 2).expand(batch, -1, -1, -1)
    values = F.grid_sample(planes, grid, mode="bicubic", align_corners=True)
    return values.view(batch, channels, rows, -1)
