"""Descriptors by name. A descriptor maps an image to features, whose statistics losses compare."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Protocol

from torch import Tensor

from solidtex_export.losses.descriptor.network import DISTILLED_WIDTHS, WIDTHS
from solidtex_export.losses.descriptor.weights import Trained, WeightsError
from solidtex_export.losses.learned import LearnedDescriptor
from solidtex_export.losses.pretrained import PretrainedDescriptor
from solidtex_export.losses.statistics import Features
from solidtex_export.networks import SqueezeNet, Vgg19, squeezenet, vgg
from solidtex_export.networks.vgg import grouped_names


class Descriptor(Protocol):
    """Interface of descriptors.

    Images are [batch, channel, rows, columns] of whitened values: zero mean and unit variance along
    each principal axis of the photographs' channels.
    """

    def measure(self, reals: Tensor) -> Any:
        """Statistics of images, which `distance` compares with."""

    def distance(self, fakes: Tensor, target: Any) -> Tensor:
        """The descriptor's own distance of images, of any size, from measured statistics."""

    def features(self, fakes: Tensor, reals: Tensor) -> Features:
        """Feature maps by layer name, for losses that compare them in other ways."""


@dataclass(frozen=True)
class PretrainedWeights:
    """Pretrained weights that the user provides."""

    features: Vgg19 | SqueezeNet | None = None
    learned: Trained | None = None

    def feature_names(self, descriptor: str) -> list[str]:
        """Layers of the descriptor of that name, for images that are large enough."""
        if descriptor == "features" and self.features is not None:
            named = vgg if isinstance(self.features, Vgg19) else squeezenet
            return named.feature_names()
        return grouped_names(self.learned.network.widths if self.learned else WIDTHS)


def known_feature_names() -> list[str]:
    """Layers that any descriptor has."""
    learned = grouped_names(WIDTHS) + grouped_names(DISTILLED_WIDTHS)
    names = vgg.feature_names() + squeezenet.feature_names() + learned
    return list(dict.fromkeys(names))


@dataclass(frozen=True)
class DescriptorSource:
    """Inputs of descriptors: color = color_mean + color_basis @ y, and weights."""

    color_mean: Tensor
    color_basis: Tensor
    weights: PretrainedWeights = field(default_factory=PretrainedWeights)
    linear: bool = False
    """Whether colors are linear light rather than sRGB-encoded."""

    def make(self, name: str) -> Descriptor:
        """Make a descriptor. "features" without a file is "learned", the built-in network."""
        if name == "features" and self.weights.features is not None:
            network = self.weights.features
            return PretrainedDescriptor(network, self.color_mean, self.color_basis, self.linear)
        return LearnedDescriptor(self.learned(f'descriptor "{name}"'))

    def learned(self, caller: str) -> Trained:
        """The built-in network."""
        if self.weights.learned is None:
            raise WeightsError(f"{caller}: found no weights, expected some")
        return self.weights.learned
