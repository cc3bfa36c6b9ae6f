"""VGG-19 as descriptor, from a file of weights that the user provides.

The loss is equations 2 and 3 of Gutierrez et al. 2020, "On demand solid texture synthesis using
deep 3D networks", section 5.1, with their layers (section 6.1): relu1_1, relu2_1, relu3_1, relu4_1
and relu5_1, padded convolutions, average pooling.

Two kinds of state dict are recognized by their keys: torchvision's `vgg19` (`features.N.weight`,
colors normalized by ImageNet's mean and deviation) and the one of Gatys et al. (`conv1_1.weight`,
colors in BGR order, 0 ... 255, minus a mean).

Slices are whitened values; VGG receives the first three channels of their colors.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import torch
import torch.nn.functional as F
from torch import Tensor

from solidtex_export.images.srgb import srgb_encoded
from solidtex_export.losses.statistics import Features, gram
from solidtex_export.state_file import read_state

WIDTHS = (64, 128, 256, 512, 512)
CONVOLUTIONS = (2, 2, 4, 4, 1)  # of each group, as far as relu5_1
TORCHVISION_INDICES = (0, 2, 5, 7, 10, 12, 14, 16, 19, 21, 23, 25, 28)
LOSS_LAYERS = tuple(f"relu{group}_1" for group in range(1, 6))
SMALLEST = 16  # pixels: the side that leaves one in group 5


class VggError(ValueError):
    """A file without weights of VGG-19; the message names the file."""


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


class VggDescriptor:
    """VGG-19 up to relu5_1 with fixed weights."""

    def __init__(
        self, path: Path, color_mean: Tensor, color_basis: Tensor, linear: bool = False
    ) -> None:
        """`color_mean` [channel] and `color_basis` [channel, channel]: color = mean + basis @ y.

        `linear`: colors are linear light, and are encoded, since VGG was trained on sRGB.
        """
        self._linear = linear
        self._layers, self._preprocess = read_weights(path)
        picks = list(range(3)) if len(color_mean) >= 3 else [0, 0, 0]
        self._mean, self._basis = color_mean[picks], color_basis[picks]

    def loss(self, fakes: Tensor, reals: Tensor) -> Tensor:
        """Equation 3, for whitened images [batch, channel, rows, columns]."""
        features = self.features(fakes, reals)
        pairs = [features[name] for name in LOSS_LAYERS]
        return torch.stack([(gram(f) - gram(r)).square().mean() for f, r in pairs]).sum()

    def features(self, fakes: Tensor, reals: Tensor) -> Features:
        with torch.no_grad():
            of_reals = self._activations(reals)
        of_fakes = self._activations(fakes)
        return {name: (of_fakes[name], of_reals[name]) for name in of_fakes}

    def _activations(self, images: Tensor) -> dict[str, Tensor]:
        if min(images.shape[2:]) < SMALLEST:
            raise VggError(f"slice: found shape {tuple(images.shape)}, expected {SMALLEST} pixels")
        device = images.device
        rgb = torch.einsum("ij,bjrc->birc", self._basis.to(device), images.float())
        rgb = rgb + self._mean.to(device).view(1, 3, 1, 1)
        x = self._preprocess(srgb_encoded(rgb) if self._linear else rgb)
        found = {}
        remaining = iter(self._layers)
        for group, count in enumerate(CONVOLUTIONS, 1):
            for i in range(1, count + 1):
                weight, bias = (t.to(device) for t in next(remaining))
                x = F.relu(F.conv2d(x, weight, bias, padding=1))
                found[f"relu{group}_{i}"] = x
            if group < len(CONVOLUTIONS):
                x = F.avg_pool2d(x, 2)
                found[f"pool{group}"] = x
        return found


def read_weights(path: Path) -> tuple[list[tuple[Tensor, Tensor]], Preprocessing]:
    """The convolutions up to conv5_1, and the preprocessing for them."""
    state = read_state(path, "weights of VGG-19", VggError)
    names = [f"conv{g}_{i}" for g, n in enumerate(CONVOLUTIONS, 1) for i in range(1, n + 1)]
    preprocessing = GATYS
    if any(str(key).startswith("features.") for key in state):
        names = [f"features.{index}" for index in TORCHVISION_INDICES]
        preprocessing = TORCHVISION
    elif "conv1_1.weight" not in state:
        keys = ", ".join(str(key) for key in list(state)[:3])
        raise VggError(
            f"{path}: found keys {keys} ..., expected those of torchvision's vgg19"
            " (features.0.weight) or of Gatys et al. (conv1_1.weight)"
        )
    layers = []
    channels = 3
    widths = [w for w, n in zip(WIDTHS, CONVOLUTIONS, strict=True) for _ in range(n)]
    for name, width in zip(names, widths, strict=True):
        weight = _tensor(path, state, f"{name}.weight", (width, channels, 3, 3))
        layers.append((weight, _tensor(path, state, f"{name}.bias", (width,))))
        channels = width
    return layers, preprocessing


def _tensor(path: Path, state: Mapping[str, Any], key: str, shape: tuple[int, ...]) -> Tensor:
    value = state.get(key)
    if not isinstance(value, Tensor):
        raise VggError(f"{path}: {key}: found no tensor, expected one of shape {shape}")
    if tuple(value.shape) != shape:
        raise VggError(f"{path}: {key}: found shape {tuple(value.shape)}, expected {shape}")
    if not value.is_floating_point() or not value.isfinite().all():
        raise VggError(f"{path}: {key}: found values that are not finite, expected finite floats")
    return value.float()
