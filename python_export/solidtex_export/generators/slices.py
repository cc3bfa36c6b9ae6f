"""Random slices of a solid, as images that are compared with an exemplar.

Texture space is x, y, z with z upwards in a photograph of an upright surface. A slice normal to x
shows (columns, rows downwards) = (y, -z), normal to y: (x, -z), normal to z: (x, -y). Vertical
grain in one photograph for x and y therefore runs along z in both.
"""

from __future__ import annotations

import math
from typing import Protocol

import torch
from torch import Tensor

from solidtex_export.generators.lattice import BaseLattice, Box
from solidtex_export.generators.sampler import HashedLattice, OctaveSampler

SLICE_AXES = {"x": (1, 2), "y": (0, 2), "z": (0, 1)}
"""Axis that an image's columns follow, and axis that its rows run against, by normal."""

MAX_DISTANCE = 4096.0  # of the sampler's slices from the origin, in texels


class SliceSource(Protocol):
    """Source of the slices of a training."""

    def draw(self, direction: str, size: int, batch: int) -> Tensor:
        """Whitened slices [batch, channel, size, size]."""

    def view(self, direction: str) -> str:
        """What slices of a direction have in common: their normal, or "" for random planes."""


class LatticeSlices:
    """Axis slices, one voxel thick, at random offsets modulo 2^K (Gutierrez et al., equation 8)."""

    def __init__(self, generator: BaseLattice) -> None:
        self.generator = generator
        self.period = 2 ** (generator.levels - 1)

    def draw(self, direction: str, size: int, batch: int) -> Tensor:
        normal = "xyz".index(direction)
        columns, rows = SLICE_AXES[direction]
        lo = tuple(int(v) for v in torch.randint(self.period, (3,)))
        box = Box(lo, (lo[0] + 1, lo[1] + size, lo[2] + size))
        noise = self.generator.draw_noise(box, batch)
        y = self.generator(noise, box, (normal, rows, columns))
        return y.squeeze(2).flip(2)

    def view(self, direction: str) -> str:
        return direction


class SamplerSlices:
    """Planes through the sampler family, each through its own realization of the noise.

    GramGAN, section 4: completely random planes for an isotropic material ("any"), rotation about
    one axis for grain along it ("about-z"). With a photograph per direction: axis slices ("axes").
    """

    def __init__(self, generator: OctaveSampler, planes: str) -> None:
        self.generator = generator
        self.planes = planes

    def draw(self, direction: str, size: int, batch: int) -> Tensor:
        return torch.stack([self._draw_one(direction, size) for _ in range(batch)])

    def view(self, direction: str) -> str:
        return direction if self.planes == "axes" else ""

    def _draw_one(self, direction: str, size: int) -> Tensor:
        device = self.generator.color_mean.device
        points = random_plane(self.planes, direction, size).to(device)
        y = self.generator(points, HashedLattice(self.generator.octaves, device))
        return y.view(size, size, -1).permute(2, 0, 1)


def random_plane(planes: str, direction: str, size: int) -> Tensor:
    """Points [size * size, 3] of a plane of that kind at a random place; `direction` is the normal
    of "axes".
    """
    if planes == "any":
        q, _ = torch.linalg.qr(torch.randn(3, 3))
        right, down = q[0], q[1]
    elif planes == "about-z":
        angle = 2 * math.pi * float(torch.rand(()))
        right = torch.tensor([math.cos(angle), math.sin(angle), 0.0])
        down = torch.tensor([0.0, 0.0, -1.0])
    else:
        right, down = axis_frame(direction)
    origin = (torch.rand(3) * 2 - 1) * MAX_DISTANCE
    return plane_points(origin, right, down, size, size)


def axis_frame(direction: str) -> tuple[Tensor, Tensor]:
    """Unit vectors (right, down) of the slice normal to `direction`."""
    columns, rows = SLICE_AXES[direction]
    unit = torch.eye(3)
    return unit[columns], -unit[rows]


def plane_points(origin: Tensor, right: Tensor, down: Tensor, rows: int, columns: int) -> Tensor:
    """Points [rows * columns, 3], one texel apart."""
    r = torch.arange(rows, dtype=torch.float32).view(-1, 1, 1)
    c = torch.arange(columns, dtype=torch.float32).view(1, -1, 1)
    return (origin + r * down + c * right).view(-1, 3)
