"""SIFID, the Fréchet distance of Inception features inside single images (SinGAN, Shaham et al.
2019, section 4.2)."""

from __future__ import annotations

import pickle
from pathlib import Path

import numpy as np
import torch
import torch.nn.functional as F
from torch import Tensor

from solidtex_export.evaluation.metrics.frechet import frechet_distance

# Of torchvision's inception_v3, up to the convolution just before the second pooling: name, output
# channels, input channels, kernel, stride, padding, and whether 3 x 3 pooling by 2 follows.
LAYERS = (
    ("Conv2d_1a_3x3", 32, 3, 3, 2, 0, False),
    ("Conv2d_2a_3x3", 32, 32, 3, 1, 0, False),
    ("Conv2d_2b_3x3", 64, 32, 3, 1, 1, True),
    ("Conv2d_3b_1x1", 80, 64, 1, 1, 0, False),
    ("Conv2d_4a_3x3", 192, 80, 3, 1, 0, False),
)
EPSILON = 1e-3  # of inception_v3's batch normalization
STATISTICS = ("weight", "bias", "running_mean", "running_var")


class WeightsError(OSError):
    """A file without Inception weights; the message names the file."""


class SingleImageFrechet:
    """|m_a - m_b|^2 + trace(C_a + C_b - 2 (C_a C_b)^(1/2)).

    m and C are mean and covariance, over all positions of all crops of a set, of the 192 features
    before the second pooling. SinGAN compares one image with one; we compare sets of crops. The
    weights are a state dict of torchvision's inception_v3, whose values differ from the TensorFlow
    weights that published figures use.
    """

    name = "sifid"
    title = "SIFID"

    def __init__(self, weights: Path) -> None:
        self._layers = read_layers(weights)

    @torch.no_grad()
    def features(self, crops: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Mean [192] and covariance [192, 192]."""
        x = torch.from_numpy(crops).permute(0, 3, 1, 2) * 2 - 1
        for weight, bias, (*_, stride, padding, pooled) in zip(*self._layers, LAYERS, strict=True):
            x = F.relu(F.conv2d(x, weight, bias, stride, padding))
            x = F.max_pool2d(x, 3, 2) if pooled else x
        vectors = x.permute(0, 2, 3, 1).reshape(-1, x.shape[1]).double().numpy()
        return vectors.mean(0), np.cov(vectors, rowvar=False)

    def distance(
        self, first: tuple[np.ndarray, np.ndarray], second: tuple[np.ndarray, np.ndarray]
    ) -> float:
        return frechet_distance(*first, *second)


def read_layers(path: Path) -> tuple[list[Tensor], list[Tensor]]:
    """Weights and biases of LAYERS, with batch normalization folded in."""
    try:
        state = torch.load(path, map_location="cpu", weights_only=True)
    except (OSError, RuntimeError, EOFError, pickle.UnpicklingError) as error:
        raise WeightsError(
            f"{path}: found no readable weights ({error}), expected a state dict of inception_v3"
        ) from error
    weights, biases = [], []
    for name, outputs, inputs, kernel, *_ in LAYERS:
        shapes: dict[str, tuple[int, ...]] = {
            f"{name}.conv.weight": (outputs, inputs, kernel, kernel),
            **{f"{name}.bn.{statistic}": (outputs,) for statistic in STATISTICS},
        }
        values = [_tensor(state, key, shape, path) for key, shape in shapes.items()]
        weight, scale, shift, mean, variance = values
        scale = scale / torch.sqrt(variance + EPSILON)
        weights.append(weight * scale.view(-1, 1, 1, 1))
        biases.append(shift - mean * scale)
    return weights, biases


def _tensor(state: object, key: str, shape: tuple[int, ...], path: Path) -> Tensor:
    value = state.get(key) if isinstance(state, dict) else None
    if not isinstance(value, Tensor) or tuple(value.shape) != shape:
        found = f"shape {tuple(value.shape)}" if isinstance(value, Tensor) else "nothing"
        raise WeightsError(f"{path}: {key}: found {found}, expected shape {shape}")
    return value.float()
