"""Gram matrices of a descriptor trained on procedural textures, in place of VGG-19's.

The style loss of Gutierrez et al. 2020 (equations 2 and 3) on the network of losses/descriptor.
Features are normalized by the exemplar's mean, and by its deviation plus their deviation over the
procedural textures. Most deep features vanish on a given exemplar, and would otherwise be amplified
without bound. docs/experiments/descriptor-loss.md lists what else was tried.
"""

from __future__ import annotations

import torch
import torch.nn.functional as F
from torch import Tensor

from solidtex_export.losses.descriptor.network import INPUT_CHANNELS
from solidtex_export.losses.descriptor.weights import Trained
from solidtex_export.losses.statistics import Features, gram

GRAM_SOFTNESS = 0.5  # Gram differences beyond this count linearly
SILENT_SHARE = 0.1  # of a layer's mean deviation: the least that a feature is divided by


class LearnedDescriptor:
    """Compares images by the features of a network that was trained to discriminate textures."""

    def __init__(self, trained: Trained) -> None:
        self._network = trained.network
        scales = enumerate(self._network.widths, 1)
        self._pooled = {f"conv{scale}_{len(widths)}" for scale, widths in scales}
        self._floors = {
            name: (d + SILENT_SHARE * d.mean()).view(1, -1, 1, 1)
            for name, d in trained.deviations.items()
        }

    def loss(self, fakes: Tensor, reals: Tensor) -> Tensor:
        """Distance of the statistics of two batches of whitened images, of any channel count.

        Batches are [batch, channel, rows, columns]; the two may differ in size.
        """
        pairs = [p for name, p in self.features(fakes, reals).items() if name.startswith("relu")]
        return torch.stack([_distance(*pair) for pair in pairs]).mean()

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
            raise ValueError(
                f"images: found {tuple(fakes.shape[2:])} and {tuple(reals.shape[2:])} pixels,"
                " expected at least 3 x 3"
            )
        return features

    def _activations(self, images: Tensor, axes: Tensor) -> dict[str, Tensor]:
        network = self._network.to(images.device)
        return network.features(torch.einsum("ic,bcrs->birs", axes, images))

    def _normalized(self, name: str, fakes: Tensor, reals: Tensor) -> tuple[Tensor, Tensor]:
        fakes, reals = fakes.float(), reals.float()
        mean = reals.mean((0, 2, 3), keepdim=True)
        deviation = (reals - mean).square().mean((0, 2, 3), keepdim=True).sqrt()
        gain = 1 / (deviation + self._floors[name].to(reals.device))
        return (fakes - mean) * gain, (reals - mean) * gain


def _distance(fakes: Tensor, reals: Tensor) -> Tensor:
    """Distance on one layer, whose features of the exemplar have zero mean."""
    grams = F.smooth_l1_loss(gram(fakes), gram(reals), beta=GRAM_SOFTNESS)
    return grams + fakes.mean((0, 2, 3)).square().mean()


def random_axes(channels: int) -> Tensor:
    """Random orthonormal map [3, channels] to three channels; missing channels are zero."""
    side = max(channels, INPUT_CHANNELS)
    turn, upper = torch.linalg.qr(torch.randn(side, side))
    turn = turn * upper.diagonal().sign()  # uniform over all turns and reflections (Mezzadri 2007)
    return turn[:INPUT_CHANNELS, :channels].contiguous()
