"""VGG-19 up to relu5_1 (Simonyan and Zisserman 2015), from a file of its weights.

Padded convolutions and average pooling, as Gutierrez et al. 2020 use it (section 6.1). Two kinds of
state dict are recognized by their keys: torchvision's `vgg19` (`features.N.weight`, colors
normalized by ImageNet's mean and deviation) and the one of Gatys et al. (`conv1_1.weight`, colors
in BGR order, 0 ... 255, minus a mean).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sized
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import torch
import torch.nn.functional as F
from torch import Tensor

from solidtex_export.networks.weights import weights_of

WIDTHS = (64, 128, 256, 512, 512)
CONVOLUTIONS = (2, 2, 4, 4, 1)  # of each group, as far as relu5_1
TORCHVISION_INDICES = (0, 2, 5, 7, 10, 12, 14, 16, 19, 21, 23, 25, 28)
EXPECTED = (
    "weights of VGG-19, torchvision's (features.0.weight) or those of Gatys et al. (conv1_1.weight)"
)


@dataclass(frozen=True)
class Preprocessing:
    """Converts RGB colors in 0 ... 1 to the input range of the weights."""

    order: tuple[int, int, int]
    scale: float
    mean: tuple[float, float, float]
    deviation: tuple[float, float, float]

    def __call__(self, rgb: Tensor) -> Tensor:
        shape = (1, 3, 1, 1)
        mean = torch.tensor(self.mean, device=rgb.device).view(shape)
        deviation = torch.tensor(self.deviation, device=rgb.device).view(shape)
        return (rgb[:, list(self.order)] * self.scale - mean) / deviation


TORCHVISION = Preprocessing((0, 1, 2), 1.0, (0.485, 0.456, 0.406), (0.229, 0.224, 0.225))
GATYS = Preprocessing((2, 1, 0), 255.0, (103.939, 116.779, 123.68), (1.0, 1.0, 1.0))


class Vgg19:
    """The network with fixed weights."""

    smallest = 16
    """Pixels: the side that leaves one in group 5."""

    def __init__(self, state: Mapping[str, Any], path: Path) -> None:
        names = [f"conv{g}_{i}" for g, n in enumerate(CONVOLUTIONS, 1) for i in range(1, n + 1)]
        self.preprocessing = GATYS
        if not _is_named_by_gatys(state):
            names = [f"features.{index}" for index in TORCHVISION_INDICES]
            self.preprocessing = TORCHVISION
        self.layers: list[tuple[Tensor, Tensor]] = []
        channels = 3
        widths = [w for w, n in zip(WIDTHS, CONVOLUTIONS, strict=True) for _ in range(n)]
        for name, width in zip(names, widths, strict=True):
            shape = (width, channels, 3, 3)
            weight = weights_of(path, state, f"{name}.weight", shape, EXPECTED)
            self.layers.append(
                (weight, weights_of(path, state, f"{name}.bias", (width,), EXPECTED))
            )
            channels = width

    def named_features(self, images: Tensor) -> dict[str, Tensor]:
        """Outputs by layer; images are [image, channel, row, column], sRGB, 0 ... 1."""
        x = self.preprocessing(images)
        found = {}
        remaining = iter(self.layers)
        for group, count in enumerate(CONVOLUTIONS, 1):
            for i in range(1, count + 1):
                weight, bias = (t.to(images.device) for t in next(remaining))
                x = F.relu(F.conv2d(x, weight, bias, padding=1))
                found[f"relu{group}_{i}"] = x
            if group < len(CONVOLUTIONS):
                x = F.avg_pool2d(x, 2)
                found[f"pool{group}"] = x
        return found


def grouped_names(groups: Iterable[Sized]) -> list[str]:
    """relu1_1, relu1_2, pool1, relu2_1 ... for the layers of each group."""
    names = []
    for number, group in enumerate(groups, 1):
        names += [f"relu{number}_{i}" for i in range(1, len(group) + 1)] + [f"pool{number}"]
    return names


def feature_names() -> list[str]:
    """Names of the features, finest first."""
    return grouped_names(map(range, CONVOLUTIONS))[:-1]  # the last group is not pooled


def recognizes(state: Mapping[str, Any]) -> bool:
    """Whether the names of the tensors are VGG-19's."""
    return _is_named_by_gatys(state) or any(str(key).startswith("features.") for key in state)


def _is_named_by_gatys(state: Mapping[str, Any]) -> bool:
    return "conv1_1.weight" in state
