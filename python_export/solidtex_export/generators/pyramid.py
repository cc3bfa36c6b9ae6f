"""Fully convolutional generator with multi-scale noise.

Zhao et al. 2022, "STS-GAN", section 3.4. The paper specifies locality by convolutions, and a group
of K noises of different sizes as input, after Ulyanov et al. 2016 and Gutierrez et al. 2020. Here
each level concatenates its own standard normal noise with the upsampled features of the coarser
level, then convolves twice. There is no batch normalization: the gradient penalty of WGAN-GP
excludes it from the critic, and a generator without it is evaluated as it was trained. There is no
padding, so blocks tile.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, ClassVar

import numpy as np
import torch
import torch.nn.functional as F
from torch import Tensor, nn

from solidtex_export.generators.lattice import BLOCK_MARGIN, BaseLattice, Box, upsampled
from solidtex_export.generators.planes import (
    XYZ,
    Axes,
    PlaneConvolution,
    from_planes,
    to_planes,
)


class PyramidGenerator(BaseLattice):
    """Generator with convolutions `blocks[k]` on level k; level 0 is the finest."""

    distribution: ClassVar[str] = "normal"

    def __init__(
        self,
        levels: int = 5,
        noise_channels: int = 4,
        width: int = 32,
        out_channels: int = 3,
        slope: float = 0.2,
    ) -> None:
        super().__init__(levels, noise_channels, out_channels)
        self.negative_slope = slope
        blocks = []
        for level in range(levels):
            joint = noise_channels + (width if level < levels - 1 else 0)
            convolutions = PlaneConvolution(joint, width, 3), PlaneConvolution(width, width, 3)
            blocks.append(nn.ModuleList(convolutions))
        self.blocks: Sequence[Sequence[PlaneConvolution]] = nn.ModuleList(blocks)  # type: ignore[assignment]
        self.last = PlaneConvolution(width, out_channels, 1)
        self._share_variance()

    @torch.no_grad()
    def _share_variance(self) -> None:
        """Scale the initial weights so that all levels contribute and whitened colors have nearly
        unit variance.

        A default convolution passes on three quarters of a deviation, and each level adds noise of
        its own: the finest level had 76 % of a slice's variance and the two coarsest 1 % each. With
        each level's noise scaled to its share they have 37, 27, 21, 19 and 14 %.
        """
        gain = (2 / (1 + self.negative_slope**2)) ** 0.5  # against what a rectifier takes away
        for level, (first, second) in enumerate(self.blocks):
            coarse = first.in_channels - self.noise_channels
            share = 1 / (self.levels - level)
            first.weight[:, coarse:] *= (share * first.in_channels / self.noise_channels) ** 0.5
            if coarse:
                first.weight[:, :coarse] *= gain * ((1 - share) * first.in_channels / coarse) ** 0.5
            second.weight *= gain
        self.last.weight *= gain

    def noise_boxes(self, box: Box) -> list[Box]:
        return [b.grown(BLOCK_MARGIN) for b in self.feature_boxes(box)]

    def forward(self, noise: Sequence[Tensor], box: Box, axes: Axes = XYZ) -> Tensor:
        """As LatticeGenerator.forward."""
        boxes = self.feature_boxes(box)
        x = to_planes(noise[-1])
        for level in range(self.levels - 1, -1, -1):
            if level < self.levels - 1:
                joint = boxes[level].grown(BLOCK_MARGIN)
                coarse = upsampled(x, boxes[level + 1], joint)
                x = torch.cat([coarse, to_planes(noise[level])], dim=4)
            for convolution in self.blocks[level]:
                x = F.leaky_relu(convolution(x, axes), self.negative_slope)
        return from_planes(self.last(x, axes))


def fold_pyramid(generator: PyramidGenerator) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """The `field` object of the model's document, and its float32 tensors."""
    nodes: list[dict[str, Any]] = []
    tensors: dict[str, Tensor] = {}

    def node(name: str, op: str, **fields: Any) -> str:
        nodes.append({"name": name, "op": op, **fields})
        return name

    def conv(name: str, source: str, weight: Tensor, bias: Tensor) -> str:
        tensors[f"{name}.weight"], tensors[f"{name}.bias"] = weight, bias
        out_channels, kernel = weight.shape[0], weight.shape[2]
        return node(name, "conv3d", inputs=[source], out_channels=out_channels, kernel=kernel)

    x = ""
    for level in range(generator.levels - 1, -1, -1):
        noise = {"level": level, "channels": generator.noise_channels}
        z = node(f"z{level}", "noise", **noise, distribution=generator.distribution)
        if x:
            up = node(f"up{level}", "upsample", inputs=[x])
            z = node(f"cat{level}", "concat", inputs=[up, z])
        x = z
        for i, convolution in enumerate(generator.blocks[level]):
            name = f"level{level}.conv{i}"
            x = conv(name, x, convolution.weight.double(), convolution.bias.double())
            name = f"level{level}.act{i}"
            x = node(name, "leaky_relu", inputs=[x], slope=generator.negative_slope)
    basis, mean = generator.color_basis.double(), generator.color_mean.double()
    weight = torch.einsum("ij,jkxyz->ikxyz", basis, generator.last.weight.double())
    output = conv("colors", x, weight, mean + basis @ generator.last.bias.double())
    arrays = {name: value.detach().cpu().float().numpy() for name, value in tensors.items()}
    return {"nodes": nodes, "output": output}, arrays
