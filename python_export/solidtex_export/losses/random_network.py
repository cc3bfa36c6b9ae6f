"""Gram matrices of a random network that is drawn anew in every iteration.

The style loss of Gutierrez et al. 2020 (equations 2 and 3; after Gatys et al. 2015) with VGG-19
replaced. No pretrained weights are needed, and since the network changes, the generator cannot
exploit the blind spots of a single one. The statistics that normalize each layer come from the
exemplar, seen through the same weights.
"""

from __future__ import annotations

from dataclasses import dataclass

import torch
import torch.nn.functional as F
from torch import Tensor

from solidtex_export.losses.statistics import Features, gram

GRAM_WEIGHT = 10.0
MEAN_WEIGHT = 4.0
THRESHOLD_DEVIATION = 0.5
DEVIATION_FLOOR = 0.05


@dataclass(frozen=True)
class RandomDescriptor:
    """Convolutions of the given widths; features are halved in resolution between the groups.

    Layers are named as those of VGG-19: relu1_1, relu1_2, pool1, relu2_1 ...
    """

    groups: tuple[tuple[int, ...], ...] = ((32, 32), (64, 64), (96, 96), (128,))

    def loss(self, fakes: Tensor, reals: Tensor) -> Tensor:
        """Distance of the statistics of two batches of images [batch, channel, rows, columns]."""
        features = self.features(fakes, reals)
        pairs = [pair for name, pair in features.items() if name.startswith("relu")]
        return torch.stack([_distance(*pair) for pair in pairs]).mean()

    def features(self, fakes: Tensor, reals: Tensor) -> Features:
        """Features of both batches through one new network, as deep as their size allows."""
        features: Features = {}
        kernel = 5
        for i, group in enumerate(self.groups, 1):
            for j, width in enumerate(group, 1):
                if min(*fakes.shape[2:], *reals.shape[2:]) < kernel + 2:
                    return features
                fakes, reals = _layer(fakes, reals, width, kernel)
                features[f"relu{i}_{j}"] = fakes, reals
                kernel = 3
            fakes, reals = F.avg_pool2d(fakes, 2), F.avg_pool2d(reals, 2)
            features[f"pool{i}"] = fakes, reals
        return features


def _layer(fakes: Tensor, reals: Tensor, width: int, kernel: int) -> tuple[Tensor, Tensor]:
    """One random convolution, ReLU, and normalization by the exemplar's statistics."""
    weight = torch.randn(width, fakes.shape[1], kernel, kernel, device=fakes.device)
    weight = weight - 0.5 * weight.mean((2, 3), keepdim=True)
    weight = weight / weight.flatten(1).norm(dim=1).view(-1, 1, 1, 1)
    threshold = THRESHOLD_DEVIATION * torch.randn(1, width, 1, 1, device=fakes.device)
    with torch.no_grad():
        u = F.conv2d(reals, weight)
        mean, deviation = _moments(u)
        scale = 1 / (deviation + 1e-6)
        shift = -(mean * scale + threshold)
        f = F.relu(u * scale + shift)
        mean, deviation = _moments(f)
        gain = 1 / (deviation + DEVIATION_FLOOR)
        reals = (f - mean) * gain
    f = F.relu(F.conv2d(fakes, weight) * scale + shift)
    return (f - mean) * gain, reals


def _moments(x: Tensor) -> tuple[Tensor, Tensor]:
    """Mean and standard deviation per channel (torch.std_mean is several times slower on a CPU)."""
    x = x.float()
    mean = x.mean((0, 2, 3), keepdim=True)
    variance = x.square().mean((0, 2, 3), keepdim=True) - mean.square()
    return mean, variance.clamp_min(0).sqrt()


def _distance(fakes: Tensor, reals: Tensor) -> Tensor:
    grams = (gram(fakes) - gram(reals)).square().mean()
    means = (fakes.float().mean((0, 2, 3)) - reals.float().mean((0, 2, 3))).square().mean()
    return GRAM_WEIGHT * grams + MEAN_WEIGHT * means
