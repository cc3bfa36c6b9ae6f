"""Generator of the lattice family.

Gutierrez et al. 2020, "On demand solid texture synthesis using deep 3D networks", sections 4.1 to
4.3. State-dict keys are those of the authors' public implementation, so that its checkpoints load
here. Two buffers are added, `color_mean` and `color_basis` (color = color_mean + color_basis @ y).

Two things differ from the paper; neither changes the values of an evaluated model. Regions are
propagated on absolute coordinates instead of compensating shifts (section 4.3). The batch
normalization of an upsampling is applied before the replication, which is eight times cheaper.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

import torch
from torch import Tensor, nn

from solidtex_export.generators.planes import (
    XYZ,
    Axes,
    PlaneConvolution,
    PlaneNorm,
    from_planes,
    to_planes,
)
from solidtex_export.generators.regions import Box

BLOCK_MARGIN = 2  # two 3^3 convolutions without padding


class BaseLattice(nn.Module):
    """Base of the lattice generators: an unpadded network over noise on several levels, evaluated
    for any box.
    """

    distribution: ClassVar[str] = "uniform"
    """Distribution of the noise: uniform in [0, 1), or standard normal."""

    color_mean: Tensor
    color_basis: Tensor

    def __init__(
        self, levels: int, noise_channels: int, out_channels: int, softmax: bool = False
    ) -> None:
        super().__init__()
        self.levels = levels
        self.noise_channels = noise_channels
        self.softmax = softmax  # the channels are probabilities of phases
        self.register_buffer("color_mean", torch.zeros(out_channels))
        self.register_buffer("color_basis", torch.eye(out_channels))

    def feature_boxes(self, box: Box) -> list[Box]:
        """Per level, finest first, the region of its features that `box` depends on."""
        boxes = [box]
        for _ in range(1, self.levels):
            boxes.append(boxes[-1].grown(BLOCK_MARGIN).coarser())
        return boxes

    def noise_boxes(self, box: Box) -> list[Box]:
        """Per level, finest first, the region of noise that `box` depends on."""
        raise NotImplementedError

    def colors(self, y: Tensor) -> Tensor:
        """Colors of whitened values y [batch, channel, ...]."""
        colors = self.linear_colors(y)
        return colors.softmax(1) if self.softmax else colors

    def linear_colors(self, y: Tensor) -> Tensor:
        """Colors without the softmax."""
        shape = (1, -1, *[1] * (y.ndim - 2))
        mixed = torch.einsum("ij,bj...->bi...", self.color_basis, y)
        return mixed + self.color_mean.view(shape)

    def draw_noise(self, box: Box, batch: int = 1) -> list[Tensor]:
        """Fresh noise for `box`, on the generator's device."""
        like = self.color_mean
        draw = torch.rand if self.distribution == "uniform" else torch.randn
        shape = (batch, self.noise_channels)
        return [
            draw((*shape, *b.size), device=like.device, dtype=like.dtype)
            for b in self.noise_boxes(box)
        ]


class ConvBlock(nn.Module):
    """Section 4.1: convolutions 3^3, 3^3, 1^3, each with batch normalization and leaky ReLU."""

    def __init__(self, in_channels: int, out_channels: int, negative_slope: float) -> None:
        super().__init__()
        self.conv1 = PlaneConvolution(in_channels, out_channels, 3)
        self.bn1 = PlaneNorm(out_channels)
        self.conv2 = PlaneConvolution(out_channels, out_channels, 3)
        self.bn2 = PlaneNorm(out_channels)
        self.conv3 = PlaneConvolution(out_channels, out_channels, 1)
        self.bn3 = PlaneNorm(out_channels)
        self.act = nn.LeakyReLU(negative_slope)

    def forward(self, x: Tensor, axes: Axes) -> Tensor:
        x = self.act(self.conv1(x, axes, self.bn1))
        x = self.act(self.conv2(x, axes, self.bn2))
        return self.act(self.conv3(x, axes, self.bn3))


class Upsampling(nn.Module):
    """Nearest-neighbor upsampling of the region `source`, cropped to the finer region `target`."""

    def __init__(self, channels: int) -> None:
        super().__init__()
        self.bn = PlaneNorm(channels)

    def forward(self, x: Tensor, source: Box, target: Box) -> Tensor:
        return upsampled(self.bn(x), source, target)


def upsampled(x: Tensor, source: Box, target: Box) -> Tensor:
    """Upsample a volume of planes on the region `source` to `target`; each voxel is repeated 2^3
    times.
    """
    for axis in range(3):
        x = torch.stack([x, x], axis + 2).flatten(axis + 1, axis + 2)
        start = target.lo[axis] - 2 * source.lo[axis]
        x = x.narrow(axis + 1, start, target.size[axis])
    return x


class LatticeGenerator(BaseLattice):
    """G(Z | theta) of section 4, evaluated for any box; stage 1 is the coarsest level."""

    def __init__(
        self,
        levels: int = 6,
        noise_channels: int = 3,
        step_channels: int = 4,
        out_channels: int = 3,
        slope: float = 0.01,
        softmax: bool = False,
    ) -> None:
        super().__init__(levels, noise_channels, out_channels, softmax)
        for stage in range(1, levels + 1):
            width = stage * step_channels
            self.add_module(f"cb{stage}_1", ConvBlock(noise_channels, step_channels, slope))
            if stage > 1:
                self.add_module(f"cb{stage}_2", ConvBlock(width, width, slope))
            if stage < levels:
                self.add_module(f"up{stage}", Upsampling(width))
        self.last_conv = PlaneConvolution(levels * step_channels, out_channels, 1)

    def noise_boxes(self, box: Box) -> list[Box]:
        """Regions of noise of section 4.2."""
        boxes = self.feature_boxes(box)
        fine = [b.grown(2 * BLOCK_MARGIN) for b in boxes[:-1]]
        return [*fine, boxes[-1].grown(BLOCK_MARGIN)]

    def forward(self, noise: Sequence[Tensor], box: Box, axes: Axes = XYZ) -> Tensor:
        """The whitened colors y [batch, channel, x, y, z] of `box`; noise[k] fills noise_boxes[k].

        Noise, box and result have their spatial axes in the order `axes`: on a CPU a slice is
        evaluated much faster with its thin axis first.
        """
        boxes = self.feature_boxes(box)
        y = self.get_submodule("cb1_1")(to_planes(noise[-1]), axes)
        for stage in range(2, self.levels + 1):
            level = self.levels - stage
            joint = boxes[level].grown(BLOCK_MARGIN)
            coarse = self.get_submodule(f"up{stage - 1}")(y, boxes[level + 1], joint)
            fine = self.get_submodule(f"cb{stage}_1")(to_planes(noise[level]), axes)
            y = self.get_submodule(f"cb{stage}_2")(torch.cat([coarse, fine], dim=4), axes)
        return from_planes(self.last_conv(y, axes))
