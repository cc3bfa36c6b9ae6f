"""The descriptor network: plain convolutions on five scales, each a factor of two coarser.

There are no normalization layers, so features depend on their neighborhood alone. The two finest
scales convolve without padding. The coarser ones mirror their border, because losing a border would
cost too much of a small image.
"""

from __future__ import annotations

from collections.abc import Iterable

import torch
import torch.nn.functional as F
from torch import Tensor, nn

INPUT_CHANNELS = 3
WIDTHS = ((48, 48), (96, 96), (128, 128), (128,), (128,))  # per scale, per convolution
DISTILLED_WIDTHS = ((48, 48), (96, 96), (128, 128), (192, 192), (192, 192))
UNPADDED_SCALES = 2


def layer_names(widths: tuple[tuple[int, ...], ...] = WIDTHS) -> list[str]:
    """Layer names in VGG's scheme, scale before index: conv1_1, conv1_2, conv2_1 ..."""
    return [f"conv{s}_{i}" for s, w in enumerate(widths, 1) for i in range(1, len(w) + 1)]


def smallest_image(layers: Iterable[str], widths: tuple[tuple[int, ...], ...] = WIDTHS) -> int:
    """Side of the smallest image, in pixels, that has features on all these layers."""
    names = layer_names(widths)
    judged = names[: 1 + max(names.index(name) for name in layers)]
    side = 0  # needed before the layer that is looked at
    for scale in reversed(range(len(widths))):
        side *= 2
        for place in reversed(range(len(widths[scale]))):
            if f"conv{scale + 1}_{place + 1}" in judged:
                side = max(2, side) if scale >= UNPADDED_SCALES else max(3, side + 2)
    return side


class DescriptorNetwork(nn.Module):
    """Maps whitened images [batch, 3, rows, columns] to one feature map per convolution."""

    def __init__(self, widths: tuple[tuple[int, ...], ...] = WIDTHS) -> None:
        super().__init__()
        self.widths = widths
        previous = INPUT_CHANNELS
        for name, width in zip(layer_names(widths), sum(widths, ()), strict=True):
            layer = nn.Conv2d(previous, width, 3)
            assert layer.bias is not None
            nn.init.kaiming_normal_(layer.weight)
            nn.init.zeros_(layer.bias)
            self.add_module(name, layer)
            previous = width
        self.to(memory_format=torch.channels_last)

    def features(self, images: Tensor) -> dict[str, Tensor]:
        """Features after each layer's ReLU, finest first, down to the scale where the image is too
        small.
        """
        found: dict[str, Tensor] = {}
        x = images.contiguous(memory_format=torch.channels_last)
        for scale, widths in enumerate(self.widths):
            if scale:
                if min(x.shape[2:]) < 2:
                    return found
                x = F.avg_pool2d(x, 2)
            for place in range(len(widths)):
                padded = scale >= UNPADDED_SCALES
                if min(x.shape[2:]) < (2 if padded else 3):
                    return found
                name = f"conv{scale + 1}_{place + 1}"
                x = F.pad(x, (1, 1, 1, 1), "reflect") if padded else x
                x = F.relu(self.get_submodule(name)(x))
                found[name] = x
        return found
