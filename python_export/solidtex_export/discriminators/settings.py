"""Settings of discriminators in a preset."""

from __future__ import annotations

from typing import Annotated

from pydantic import field_validator

from solidtex_export.discriminators.critic import field_of_view
from solidtex_export.losses.descriptor.network import layer_names, smallest_image
from solidtex_export.settings import Array, Pair, Settings, expected, within

Beta = Annotated[float, within(0, 0.99999)]
Width = Annotated[int, within(1, 4096)]


class DiscriminatorSettings(Settings):
    """Base settings: one discriminator per photograph and scale, trained by Adam."""

    learning_rate: Annotated[float, within(1e-9, 10)] = 1e-3
    betas: Pair[Beta] = (0.0, 0.99)
    replay_buffer: Annotated[int, within(1, 4096)] = 12
    """Number of recent slices in the replay buffer."""
    batch: Annotated[int, within(1, 1024)] = 4
    crop: Annotated[int, within(0, 65536)] = 64
    """Side of the training crops of slices, in pixels; 0 for whole slices."""
    scales: Array[Annotated[float, within(0.01, 1)]] = (1.0,)
    """Scales, one discriminator each: a fraction of a slice's side, magnified to the whole side."""

    @field_validator("scales")
    @classmethod
    def _not_empty(cls, scales: tuple[float, ...]) -> tuple[float, ...]:
        if not scales:
            raise expected("numbers")
        return scales

    @property
    def smallest(self) -> int:
        """Side of the smallest slice that the discriminator accepts, in texels."""
        raise NotImplementedError


class CriticSettings(DiscriminatorSettings):
    """Settings of a convolutional critic on pixels, WGAN-GP (discriminators/critic.py)."""

    widths: Array[Width] = (32, 64, 96, 128)
    equalized_learning_rate: bool = False
    """Store weights at unit variance and scale them when used."""
    penalty: Annotated[float, within(0, 1e6)] = 10.0
    rms: bool = False
    """Use the root mean square distance of images in the gradient penalty, not the Euclidean one,
    and divide the loss by the ratio of the two.
    """
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
    """Settings of small heads on the frozen descriptor network, hinge loss
    (discriminators/projected.py).
    """

    batch: Annotated[int, within(1, 1024)] = 2
    crop: Annotated[int, within(0, 65536)] = 128
    layers: Array[str] = ("conv2_2", "conv3_2", "conv4_1")
    """Layers of the descriptor network, one head each."""
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
