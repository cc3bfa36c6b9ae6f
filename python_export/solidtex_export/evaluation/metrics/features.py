"""Fréchet distances of SqueezeNet's features: of sets of crops, and of single images."""

from __future__ import annotations

import numpy as np
import torch
import torch.nn.functional as F
from torch import Tensor

from solidtex_export.evaluation.metrics.frechet import Moments, frechet_distance, shrunk_moments
from solidtex_export.networks.squeezenet import SqueezeNet

SET_LAYER = "fire4"  # before the second pooling: a feature sees 35 pixels
IMAGE_LAYER = "fire2"  # 19 pixels


class FeatureDistance:
    """Fréchet distance of the features of two sets of crops, at full and at half size.

    The features are the 256 of SqueezeNet's fire4 at all positions of all crops; each distance is
    divided by the variance of the exemplar's features at that size (trace of their covariance),
    and the mean over both sizes is taken. It responds to color, grain and shapes alike.
    """

    name = "feature_distance"
    title = "feature distance"

    def __init__(self, network: SqueezeNet, exemplar: np.ndarray) -> None:
        self._network = network
        self._variances = [np.trace(m.covariance) for m in self.features(exemplar[None])]

    def features(self, crops: np.ndarray) -> list[Moments]:
        """Moments at full and at half size."""
        images = images_of(crops)
        sizes = (images, F.avg_pool2d(images, 2))
        vectors = [feature_vectors(self._network, x, SET_LAYER) for x in sizes]
        return [shrunk_moments(np.concatenate(v)) for v in vectors]

    def distance(self, first: list[Moments], second: list[Moments]) -> float:
        sizes = zip(first, second, self._variances, strict=True)
        return float(np.mean([frechet_distance(*a, *b) / variance for a, b, variance in sizes]))


class FeatureSifid:
    """SIFID (Shaham et al. 2019) with SqueezeNet: Fréchet distance of one image and one other.

    Compares the statistics inside two images: the 128 features of fire2 over all positions. Of two
    sets it is the mean over pairs of one crop of each.
    """

    name = "feature_sifid"
    title = "SIFID (SqueezeNet)"

    def __init__(self, network: SqueezeNet) -> None:
        self._network = network

    def features(self, crops: np.ndarray) -> list[Moments]:
        """Moments of each crop."""
        vectors = feature_vectors(self._network, images_of(crops), IMAGE_LAYER)
        return [shrunk_moments(image) for image in vectors]

    def distance(self, first: list[Moments], second: list[Moments]) -> float:
        pairs = zip(first, second, strict=True)
        return float(np.mean([frechet_distance(*a, *b) for a, b in pairs]))


def images_of(crops: np.ndarray) -> Tensor:
    return torch.from_numpy(np.ascontiguousarray(crops.transpose(0, 3, 1, 2))).float()


@torch.no_grad()
def feature_vectors(network: SqueezeNet, images: Tensor, layer: str) -> np.ndarray:
    """Features [image, position, channel] of a layer, for inputs of 0 ... 1."""
    found = network.features(images, layer)[layer] / 255
    return found.flatten(2).swapaxes(1, 2).double().numpy()
