"""Gram matrices of a descriptor trained on procedural textures, in place of VGG-19's.

The style loss of Gutierrez et al. 2020 (equations 2 and 3) on the network of losses/descriptor.
Features are normalized by the exemplar's mean, and by its deviation plus their deviation over the
procedural textures. Most deep features vanish on a given exemplar, and would otherwise be amplified
without bound. docs/experiments/descriptor-loss.md lists what else was tried.
"""

from __future__ import annotations

from typing import NamedTuple

import torch
import torch.nn.functional as F
from torch import Tensor

from solidtex_export.losses.descriptor.network import INPUT_CHANNELS
from solidtex_export.losses.descriptor.weights import Trained
from solidtex_export.losses.statistics import Features, second_moments

GRAM_SOFTNESS = 0.5  # Gram differences beyond this count linearly
SILENT_SHARE = 0.1  # of a layer's mean deviation: the least that a feature is divided by
EXEMPLAR_SILENT_SHARE = 0.3  # the same, of the exemplar's mean deviation
FLAT = 1e-6  # added to it too: features of an exemplar without any pattern


class LearnedDescriptor:
    """Compares images by the features of a network that was trained to discriminate textures."""

    def __init__(self, trained: Trained) -> None:
        self._network, self._heads = trained.network, trained.heads
        scales = enumerate(self._network.widths, 1)
        self._pooled = {f"conv{scale}_{len(widths)}" for scale, widths in scales}
        self._floors = {
            name: (d + SILENT_SHARE * d.mean()).view(1, -1, 1, 1)
            for name, d in trained.deviations.items()
        }

    @torch.no_grad()
    def measure(self, reals: Tensor) -> Measured:
        """Statistics of a batch of whitened images [batch, channel, rows, columns], of any channel
        count, in random axes of color.
        """
        axes = random_axes(reals.shape[1]).to(reals.device)
        moments = _moments(self._compared_features(reals, axes))
        if not moments:
            raise _too_small(reals)
        return Measured(axes, moments)

    def distance(self, fakes: Tensor, target: Measured) -> Tensor:
        """Distance of images of any size from what `measure` found, over the layers that both
        have.
        """
        found = _moments(self._compared_features(fakes, target.axes))
        if not found:
            raise _too_small(fakes)
        return self._compared(found, target.moments)

    @torch.no_grad()
    def distances(self, images: Tensor) -> Tensor:
        """Distances [image - 1] of all other `images` from the first."""
        axes = random_axes(images.shape[1]).to(images.device)
        found = self._compared_features(images, axes)
        first, *others = (
            _moments({name: f[i : i + 1] for name, f in found.items()}) for i in range(len(images))
        )
        return torch.stack([self._compared(other, first) for other in others])

    def _compared(self, found: dict[str, Moments], targets: dict[str, Moments]) -> Tensor:
        """Mean distance of the layers that both have."""
        distances = [
            moments_distance(found[name], targets[name], self._floor(name, targets[name]))
            for name in found
            if name in targets
        ]
        return torch.stack(distances).mean()

    def features(self, fakes: Tensor, reals: Tensor) -> Features:
        """Normalized feature maps by layer on five scales, relu1_1, relu1_2, pool1 ... pool5.

        Each call rotates the channels at random, the same way for both batches.
        """
        axes = random_axes(fakes.shape[1]).to(fakes.device)
        with torch.no_grad():
            targets = self._activations(reals, axes)
        found = self._activations(fakes, axes)
        features: Features = {}
        for name in (n for n in found if n in targets):
            fake, real = self._normalized(name, found[name], targets[name])
            features[name.replace("conv", "relu")] = fake, real
            if name in self._pooled and min(*fake.shape[2:], *real.shape[2:]) > 1:
                pooled = F.avg_pool2d(fake, 2), F.avg_pool2d(real, 2)
                features[name.replace("conv", "pool")[: -len("_1")]] = pooled
        if not features:
            raise _too_small(fakes if not found else reals)
        return features

    def _floor(self, name: str, target: Moments) -> Tensor:
        """What is added to the deviations of the exemplar's features."""
        if self._heads is None:
            return self._floors[name]
        return target.floor

    def _compared_features(self, images: Tensor, axes: Tensor) -> dict[str, Tensor]:
        """The network's features, or those that it predicts of its teacher's."""
        features = self._activations(images, axes)
        return self._heads.to(images.device).predicted(features) if self._heads else features

    def _activations(self, images: Tensor, axes: Tensor) -> dict[str, Tensor]:
        network = self._network.to(images.device)
        return network.features(torch.einsum("ic,bcrs->birs", axes, images))

    def _normalized(self, name: str, fakes: Tensor, reals: Tensor) -> tuple[Tensor, Tensor]:
        fakes, reals = fakes.float(), reals.float()
        mean = reals.mean((0, 2, 3), keepdim=True)
        deviation = (reals - mean).square().mean((0, 2, 3), keepdim=True).sqrt()
        gain = 1 / (deviation + self._floors[name].to(reals.device))
        return (fakes - mean) * gain, (reals - mean) * gain


class Moments(NamedTuple):
    """Statistics of one layer's features: a few numbers in place of normalized maps."""

    mean: Tensor
    second: Tensor
    """Mean products [channel, channel]."""

    @classmethod
    def of(cls, features: Tensor) -> Moments:
        rows = features.permute(0, 2, 3, 1).flatten(0, 2).T
        return cls(rows.mean(1, dtype=torch.float32), second_moments(rows))

    @property
    def deviation(self) -> Tensor:
        return (self.second.diagonal() - self.mean.square()).clamp_min(0).sqrt()

    @property
    def floor(self) -> Tensor:
        """What is added to an exemplar's deviations, so that features it hardly has count less."""
        return EXEMPLAR_SILENT_SHARE * self.deviation.mean() + FLAT


class Measured(NamedTuple):
    """Statistics of images by layer, and the axes of color that they were measured in."""

    axes: Tensor
    moments: dict[str, Moments]


def _moments(activations: dict[str, Tensor]) -> dict[str, Moments]:
    return {name: Moments.of(features) for name, features in activations.items()}


def moments_distance(fake: Moments, real: Moments, floor: Tensor) -> Tensor:
    """Distance of the moments of normalized features, whose mean is zero on the exemplar."""
    center = real.mean
    gain = 1 / (real.deviation + floor.to(center.device).flatten())
    shift = torch.outer(fake.mean - center, center)
    difference = (fake.second - real.second - shift - shift.T) * torch.outer(gain, gain)
    grams = F.smooth_l1_loss(difference, torch.zeros_like(difference), beta=GRAM_SOFTNESS)
    return grams + ((fake.mean - center) * gain).square().mean()


def _too_small(images: Tensor) -> ValueError:
    rows, columns = images.shape[2:]
    return ValueError(f"images: found {columns} x {rows} pixels, expected at least 3 x 3")


def random_axes(channels: int) -> Tensor:
    """Random orthonormal map [3, channels] to three channels; missing channels are zero."""
    side = max(channels, INPUT_CHANNELS)
    turn, upper = torch.linalg.qr(torch.randn(side, side))
    turn = turn * upper.diagonal().sign()  # uniform over all turns and reflections (Mezzadri 2007)
    return turn[:INPUT_CHANNELS, :channels].contiguous()
