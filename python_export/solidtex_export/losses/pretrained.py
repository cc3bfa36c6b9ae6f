"""Descriptors with weights that the user provides: VGG-19 and SqueezeNet, trained on ImageNet.

The loss of VGG-19 is equations 2 and 3 of Gutierrez et al. 2020, "On demand solid texture synthesis
using deep 3D networks", section 5.1, with their layers (section 6.1): relu1_1 ... relu5_1. That of
SqueezeNet compares normalized features, as that of the built-in network does, at full and at half
size.

Slices are whitened values; the networks receive the first three channels of their colors.
"""

from __future__ import annotations

from typing import Any

import torch
from torch import Tensor

from solidtex_export.images.srgb import srgb_encoded
from solidtex_export.losses.learned import Moments, moments_distance
from solidtex_export.losses.statistics import Features, gram
from solidtex_export.networks.squeezenet import SqueezeNet
from solidtex_export.networks.vgg import Vgg19
from solidtex_export.networks.weights import WeightsError

VGG_LAYERS = tuple(f"relu{group}_1" for group in range(1, 6))


class PretrainedDescriptor:
    """Features of a network with fixed weights."""

    def __init__(
        self,
        network: Vgg19 | SqueezeNet,
        color_mean: Tensor,
        color_basis: Tensor,
        linear: bool = False,
    ) -> None:
        """`color_mean` [channel] and `color_basis` [channel, channel]: color = mean + basis @ y.

        `linear`: colors are linear light, and are encoded, since the networks saw sRGB.
        """
        self._network = network
        self._linear = linear
        picks = list(range(3)) if len(color_mean) >= 3 else [0, 0, 0]
        self._mean, self._basis = color_mean[picks], color_basis[picks]

    @torch.no_grad()
    def measure(self, reals: Tensor) -> dict[str, Any]:
        """Statistics of whitened images [batch, channel, y, x]: Gram matrices, or moments."""
        return self._statistics(reals)

    def distance(self, fakes: Tensor, target: dict[str, Any]) -> Tensor:
        """Distance of images from what `measure` found."""
        pairs = [(found, target[name]) for name, found in self._statistics(fakes).items()]
        if isinstance(self._network, Vgg19):
            return torch.stack([(f - r).square().mean() for f, r in pairs]).sum()
        # Features that the exemplar hardly excites count less.
        return torch.stack([moments_distance(f, r, r.floor) for f, r in pairs]).mean()

    def _statistics(self, images: Tensor) -> dict[str, Any]:
        features = self._activations(images)
        if isinstance(self._network, Vgg19):
            return {name: gram(features[name]) for name in VGG_LAYERS}
        return {name: Moments.of(f) for name, f in features.items() if "relu" in name}

    def features(self, fakes: Tensor, reals: Tensor) -> Features:
        """Feature maps by layer."""
        with torch.no_grad():
            of_reals = self._activations(reals)
        of_fakes = self._activations(fakes)
        return {name: (of_fakes[name], of_reals[name]) for name in of_fakes}

    def _activations(self, images: Tensor) -> dict[str, Tensor]:
        smallest = self._network.smallest
        if min(images.shape[2:]) < smallest:
            shape = tuple(images.shape)
            raise WeightsError(f"slice: found shape {shape}, expected at least {smallest} pixels")
        device = images.device
        rgb = torch.einsum("ij,bjrc->birc", self._basis.to(device), images.float())
        rgb = rgb + self._mean.to(device).view(1, 3, 1, 1)
        return self._network.named_features(srgb_encoded(rgb) if self._linear else rgb)
