"""SqueezeNet v1.0, trained on ImageNet (Iandola et al. 2016), from a file of its weights."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import torch
import torch.nn.functional as F
from torch import Tensor, nn

from solidtex_export.networks.vgg import grouped_names
from solidtex_export.networks.weights import WeightsError, weights_of
from solidtex_export.state_file import read_state

MEAN = (104.0, 117.0, 123.0)  # of blue, green and red, 0 ... 255: subtracted from the input
CLASSES = 1000
WIDTHS = (16, 16, 32, 32, 48, 48, 64, 64)  # squeezed channels of fire2 ... fire9
FIRES = tuple(f"fire{i}" for i in range(2, 2 + len(WIDTHS)))
POOLED = ("conv1", "fire4", "fire8")  # layers that pooling follows
GROUPS = (("conv1",), ("fire2", "fire3", "fire4"), ("fire5", "fire6", "fire7"))
EXPECTED = "weights of SqueezeNet v1.0 (safetensors or a state dict)"


class Fire(nn.Module):
    """Squeeze to few channels, then expand by a 1 x 1 and a 3 x 3 convolution side by side."""

    def __init__(self, inputs: int, squeezed: int) -> None:
        super().__init__()
        self.squeeze1x1 = nn.Conv2d(inputs, squeezed, 1)
        self.expand1x1 = nn.Conv2d(squeezed, 4 * squeezed, 1)
        self.expand3x3 = nn.Conv2d(squeezed, 4 * squeezed, 3, padding=1)

    def forward(self, x: Tensor) -> Tensor:
        x = F.relu(self.squeeze1x1(x))
        return F.relu(torch.cat([self.expand1x1(x), self.expand3x3(x)], 1))


def feature_names() -> list[str]:
    """Names of the features that `SqueezeNet.named_features` returns."""
    found = grouped_names(GROUPS)[:-1]  # the last group is not pooled
    return found + [f"half_{name}" for name in found]


def _pooled(features: Tensor) -> Tensor:
    """Largest values of 3 x 3 neighborhoods, at half the size."""
    return F.max_pool2d(features, 3, 2, ceil_mode=True)


class SqueezeNet(nn.Module):
    """The network; images are [image, channel, row, column], sRGB, 0 ... 1."""

    smallest = 64
    """Pixels: the side that leaves 3 x 3 of fire8 at half the size."""

    def __init__(self) -> None:
        super().__init__()
        self.conv1 = nn.Conv2d(3, 96, 7, 2)
        inputs = 96
        for name, squeezed in zip(FIRES, WIDTHS, strict=True):
            self.add_module(name, Fire(inputs, squeezed))
            inputs = 8 * squeezed
        self.conv_final = nn.Conv2d(inputs, CLASSES, 1)

    def features(self, images: Tensor, last: str = FIRES[-1]) -> dict[str, Tensor]:
        """Outputs of conv1 and the fire modules up to `last`, before pooling."""
        found: dict[str, Tensor] = {}
        x = images.flip(1) * 255 - images.new_tensor(MEAN).view(3, 1, 1)
        for name in ("conv1", *FIRES):
            x = self.get_submodule(name)(x)
            x = found[name] = F.relu(x) if name == "conv1" else x
            if name == last:
                break
            x = _pooled(x) if name in POOLED else x
        return found

    def named_features(self, images: Tensor) -> dict[str, Tensor]:
        """Outputs of conv1 to fire7 at full and at half size, by names like VGG's: groups are the
        modules between two poolings.
        """
        self.to(images.device)
        half = self._grouped(F.avg_pool2d(images, 2))
        return self._grouped(images) | {f"half_{name}": f for name, f in half.items()}

    def _grouped(self, images: Tensor) -> dict[str, Tensor]:
        by_module = self.features(images, GROUPS[-1][-1])
        found: dict[str, Tensor] = {}
        for group, modules in enumerate(GROUPS, 1):
            found |= {f"relu{group}_{i}": by_module[name] for i, name in enumerate(modules, 1)}
            if group < len(GROUPS):
                found[f"pool{group}"] = _pooled(by_module[modules[-1]])
        return found

    def forward(self, images: Tensor) -> Tensor:
        """Probabilities [image, class]."""
        x = F.relu(self.conv_final(self.features(images)[FIRES[-1]]))
        return x.mean((2, 3)).softmax(1)


def recognizes(state: Mapping[str, Any]) -> bool:
    """Whether the names of the tensors are SqueezeNet's."""
    return "fire2.squeeze1x1.weight" in state


def load_squeezenet(path: Path) -> SqueezeNet:
    """The network with the weights in a file, frozen."""
    return squeezenet_of(read_state(path, EXPECTED, WeightsError), path)


def squeezenet_of(state: Mapping[str, Any], path: Path) -> SqueezeNet:
    """The network with these weights, frozen."""
    network = SqueezeNet()
    tensors = {
        name: weights_of(path, state, name, tuple(value.shape), EXPECTED)
        for name, value in network.state_dict().items()
    }
    network.load_state_dict(tensors)
    return network.requires_grad_(False).eval()
