"""What a preset says of discriminators."""

from __future__ import annotations

from dataclasses import dataclass

from solidtex_export.discriminators.critic import field_of_view
from solidtex_export.losses.descriptor.network import smallest_image
from solidtex_export.settings import number


@dataclass(frozen=True)
class CriticTraining:
    """What critics of either kind have: one per photograph and scale."""

    learning_rate: float = number(1e-9, 10, 1e-3)
    betas: tuple[float, float] = number(0, 0.99999, (0.0, 0.99))
    memory: int = number(1, 4096, 12)
    """Recent slices that it is trained on."""
    batch: int = number(1, 1024, 4)
    crop: int = number(0, 65536, 64)
    """Side of what it sees of a slice in its own training, in pixels; 0 for all of it."""
    scales: tuple[float, ...] = number(0.01, 1, (1.0,))
    """One critic for each: sees this fraction of a slice's side, magnified to the whole side."""


@dataclass(frozen=True)
class Critic(CriticTraining):
    """A network that judges pixels, WGAN-GP (discriminators/critic.py)."""

    widths: tuple[int, ...] = number(1, 4096, (32, 64, 96, 128))
    equalised: bool = False
    """Weights of unit variance, scaled when used."""
    penalty: float = number(0, 1e6, 10.0)
    rms: bool = False
    """Hold slopes at 1 for root mean square distances between images, not for their length, and
    divide the penalty by the root that lies between them."""
    drift: float = number(0, 1e6, 1e-3)

    @property
    def smallest(self) -> int:
        """Side of the smallest slice that it can judge, in texels."""
        return field_of_view(len(self.widths))


@dataclass(frozen=True)
class ProjectedCritic(CriticTraining):
    """Small heads on our frozen descriptor network, hinge loss (discriminators/projected.py)."""

    batch: int = number(1, 1024, 2)
    crop: int = number(0, 65536, 128)
    layers: tuple[str, ...] = ("conv2_2", "conv3_2", "conv4_1")
    """Of the descriptor network, one head each."""
    head_width: int = number(1, 4096, 64)

    @property
    def smallest(self) -> int:
        """Side of the smallest slice that it can judge, in texels."""
        return smallest_image(self.layers)


AnyCritic = Critic | ProjectedCritic
