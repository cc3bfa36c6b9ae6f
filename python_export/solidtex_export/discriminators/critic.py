"""WGAN-GP critics, and the style loss on their features.

Critic: Portenier et al. 2020 ("GramGAN"), section 3.1, equation 3, which is also equation 3 of Zhao
et al. 2022 ("STS-GAN"). Generator: equation 4, and equation 2 of STS-GAN.

The network differs: unpadded, strided convolutions and a mean over positions instead of dense
layers. It accepts slices of any size, and trains on a CPU. A small drift term keeps the critic's
output near zero (Karras et al. 2018). Equation 4's factor 1 / (4 N^2 M^2) on sums over pixels is
read as a mean over pixels and matrix entries; taken literally it would shrink with the number of
pixels.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

import torch
import torch.nn.functional as F
from torch import Tensor, nn

from solidtex_export.losses.statistics import gram

NEGATIVE_SLOPE = 0.2
KERNELS = (5, 4)  # of the first convolution, of the strided ones
LAST_KERNEL = 3


class Discriminator(Protocol):
    """Interface of a discriminator for the generator's losses and for its own training."""

    def features(self, images: Tensor) -> list[Tensor]:
        """Hidden activations [batch, channel, rows, columns] for a batch of whitened images."""

    def score(self, features: list[Tensor]) -> Tensor:
        """Scores [batch] from hidden activations, higher where images look like the photograph."""

    def loss(self, fakes: Tensor, reals: Tensor) -> Tensor:
        """Loss that the discriminator itself minimizes."""


@dataclass(frozen=True)
class Penalties:
    """Equation 3's lambda, the weight of the drift term, and the norm of the gradient penalty.

    Equation 3 holds the critic's gradient at 1 for the Euclidean distance of images, which grows
    with the root of the number of their values. As initialized, a critic's gradient is near 1 for
    the root mean square distance. `rms` multiplies the critic of equation 3 by that root, and
    divides the whole loss, lambda included, by it. Undivided, the penalty is a hundred times too
    strong and critics learn nothing.
    """

    gradient: float = 10.0
    drift: float = 1e-3
    rms: bool = False


class EqualizedConv2d(nn.Conv2d):
    """Weights of unit variance, multiplied by sqrt(2 / fan-in) when used (Karras et al. 2018)."""

    def reset_parameters(self) -> None:
        nn.init.normal_(self.weight)
        assert self.bias is not None
        nn.init.zeros_(self.bias)

    def forward(self, x: Tensor) -> Tensor:
        gain = math.sqrt(2 / self.weight[0].numel())
        return F.conv2d(x, self.weight * gain, self.bias, self.stride)


class Critic(nn.Module):
    """A convolutional network; `features` are its hidden activations, `forward` its score."""

    def __init__(
        self,
        channels: int = 3,
        widths: tuple[int, ...] = (32, 64, 96, 128),
        equalized: bool = False,
        penalties: Penalties = Penalties(),
    ) -> None:
        super().__init__()
        self._penalties = penalties
        convolution = EqualizedConv2d if equalized else nn.Conv2d
        ins = (channels, *widths[:-1])
        self.layers = nn.ModuleList(
            convolution(n, width, KERNELS[i > 0], stride=1 + (i > 0))
            for i, (n, width) in enumerate(zip(ins, widths, strict=True))
        )
        self.last = convolution(widths[-1], 1, LAST_KERNEL)

    def features(self, images: Tensor) -> list[Tensor]:
        activations = []
        for layer in self.layers:
            images = F.leaky_relu(layer(images), NEGATIVE_SLOPE)
            activations.append(images)
        return activations

    def score(self, features: list[Tensor]) -> Tensor:
        return self.last(features[-1]).float().mean((1, 2, 3))

    def loss(self, fakes: Tensor, reals: Tensor) -> Tensor:
        return critic_loss(self, fakes, reals, self._penalties)

    def forward(self, images: Tensor) -> Tensor:
        return self.score(self.features(images))


def field_of_view(layers: int) -> int:
    """Side of the smallest image, in pixels, that a critic with this many hidden layers accepts."""
    side = LAST_KERNEL
    for _ in range(layers - 1):
        side = 2 * (side - 1) + KERNELS[1]
    return side + KERNELS[0] - 1


def critic_loss(critic: Critic, fakes: Tensor, reals: Tensor, penalties: Penalties) -> Tensor:
    """Critic loss of equation 3."""
    on_fakes, on_reals = critic(fakes), critic(reals)
    t = torch.rand(len(fakes), 1, 1, 1, device=fakes.device)
    between = torch.lerp(reals, fakes, t).requires_grad_()
    (gradient,) = torch.autograd.grad(critic(between).sum(), between, create_graph=True)
    root = gradient[0].numel() ** 0.5 if penalties.rms else 1.0
    penalty = (root * gradient.flatten(1).norm(dim=1) - 1).square().mean() / root
    distance = on_fakes.mean() - on_reals.mean()
    return distance + penalties.gradient * penalty + penalties.drift * on_reals.square().mean()


def style_loss(critic: Discriminator, features: list[Tensor], reals: Tensor) -> Tensor:
    """L_style of equation 4."""
    with torch.no_grad():
        targets = [gram(f) for f in critic.features(reals)]
    pairs = zip(features, targets, strict=True)
    distances = [(gram(f) - target).abs().mean() for f, target in pairs]
    return torch.stack(distances).mean()


def adversarial_loss(critic: Discriminator, features: list[Tensor]) -> Tensor:
    """Generator loss -E[D(f)] of equation 4."""
    return -critic.score(features).mean()
