"""GramGAN's critic: WGAN-GP (equation 3) whose features also serve a style loss (equation 4).

Portenier et al. 2020, section 3.1. Differs in size (a CPU trains it), in a small drift term that
keeps the critic's output near zero (as in Karras et al. 2018), and in the balance of the terms: the
distance of each layer's Gram matrices is relative to the exemplar's, and training normalises the
gradients of style and adversarial term before it weights them.
"""

from __future__ import annotations

import torch
import torch.nn.functional as F
from torch import Tensor, nn

from solidtex_export.losses.random_network import gram

PENALTY_WEIGHT = 10.0  # lambda
DRIFT_WEIGHT = 1e-3
SLOPE = 0.2
FIELD_OF_VIEW = 42  # pixels; no smaller image can be judged


class Critic(nn.Module):
    """A convolutional network; `features` are its hidden activations, `forward` its judgement."""

    def __init__(self, channels: int = 3, widths: tuple[int, ...] = (32, 64, 96, 128)) -> None:
        super().__init__()
        ins = (channels, *widths[:-1])
        self.layers = nn.ModuleList(
            nn.Conv2d(i, o, 4, stride=2) if layer else nn.Conv2d(i, o, 5)
            for layer, (i, o) in enumerate(zip(ins, widths, strict=True))
        )
        self.last = nn.Conv2d(widths[-1], 1, 3)

    def features(self, images: Tensor) -> list[Tensor]:
        activations = []
        for layer in self.layers:
            images = F.leaky_relu(layer(images), SLOPE)
            activations.append(images)
        return activations

    def judge(self, features: list[Tensor]) -> Tensor:
        return self.last(features[-1]).float().mean((1, 2, 3))

    def forward(self, images: Tensor) -> Tensor:
        return self.judge(self.features(images))


def critic_loss(critic: Critic, fakes: Tensor, reals: Tensor) -> Tensor:
    """Equation 3."""
    on_fakes, on_reals = critic(fakes), critic(reals)
    t = torch.rand(len(fakes), 1, 1, 1, device=fakes.device)
    between = torch.lerp(reals, fakes, t).requires_grad_()
    (slope,) = torch.autograd.grad(critic(between).sum(), between, create_graph=True)
    penalty = (slope.flatten(1).norm(dim=1) - 1).square().mean()
    drift = on_reals.square().mean()
    return on_fakes.mean() - on_reals.mean() + PENALTY_WEIGHT * penalty + DRIFT_WEIGHT * drift


def generator_losses(critic: Critic, fakes: Tensor, reals: Tensor) -> tuple[Tensor, Tensor]:
    """The two terms of equation 4: style (Gram matrices taken per pixel) and adversarial."""
    features = critic.features(fakes)
    with torch.no_grad():
        targets = [gram(f) for f in critic.features(reals)]
    distances = [
        (gram(f) - target).abs().mean() / (target.abs().mean() + 1e-6)
        for f, target in zip(features, targets, strict=True)
    ]
    return torch.stack(distances).mean(), -critic.judge(features).mean()
