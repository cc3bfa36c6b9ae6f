"""What a preset says of its discriminators."""

from __future__ import annotations

from typing import Annotated

from pydantic import field_validator

from solidtex_export.discriminators.critic import field_of_view
from solidtex_export.losses.descriptor.network import layer_names, smallest_image
from solidtex_export.settings import Array, Pair, Settings, expected, within

Beta = Annotated[float, within(0, 0.99999)]
Width = Annotated[int, within(1, 4096)]


class DiscriminatorSettings(Settings):
    """Of either kind: one discriminator per photograph and scale, trained by Adam."""

    learning_rate: Annotated[float, within(1e-9, 10)] = 1e-3
    betas: Pair[Beta] = (0.0, 0.99)
    replay_buffer: Annotated[int, within(1, 4096)] = 12
    """Recent slices that it is trained on."""
    batch: Annotated[int, within(1, 1024)] = 4
    crop: Annotated[int, within(0, 65536)] = 64
    """Side of the crops of slices that it is trained on, in pixels; 0 for whole slices."""
    scales: Array[Annotated[float, within(0.01, 1)]] = (1.0,)
    """One discriminator for each: sees this fraction of a slice's side, magnified to the side."""

    @field_validator("scales")
    @classmethod
    def _not_empty(cls, scales: tuple[float, ...]) -> tuple[float, ...]:
        if not scales:
            raise expected("numbers")
        return scales

    @property
    def smallest(self) -> int:
        """Side of the smallest slice that it can judge, in texels."""
        raise NotImplementedError


class CriticSettings(DiscriminatorSettings):
    """A convolutional network on pixels, WGAN-GP (discriminators/critic.py)."""

    widths: Array[Width] = (32, 64, 96, 128)
    equalized_learning_rate: bool = False
    """Weights of unit variance, scaled when used."""
    penalty: Annotated[float, within(0, 1e6)] = 10.0
    rms: bool = False
    """Hold gradients at 1 for root mean square distances between images, not for their length,
    and divide the penalty by the root that lies between them."""
    drift: Annotated[float, within(0, 1e6)] = 1e-3

    @field_validator("widths")
    @classmethod
    def _some_widths(cls, widths: tuple[int, ...]) -> tuple[int, ...]:
        if not widths:
            raise expected("numbers")
        return widths

    @property
    def smallest(self) -> int:
        return field_of_view(len(self.widths))


class ProjectedCriticSettings(DiscriminatorSettings):
    """Small heads on the frozen descriptor network, hinge loss (discriminators/projected.py)."""

    batch: Annotated[int, within(1, 1024)] = 2
    crop: Annotated[int, within(0, 65536)] = 128
    layers: Array[str] = ("conv2_2", "conv3_2", "conv4_1")
    """Of the descriptor network, one head each."""
    head_width: Width = 64

    @field_validator("layers")
    @classmethod
    def _known_layers(cls, layers: tuple[str, ...]) -> tuple[str, ...]:
        known = layer_names()
        if not layers or not set(layers) <= set(known):
            raise expected(f"some of {', '.join(known)}")
        return layers

    @property
    def smallest(self) -> int:
        return smallest_image(self.layers)


AnyDiscriminator = CriticSettings | ProjectedCriticSettings
