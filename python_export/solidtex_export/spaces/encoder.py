"""Encoder E of GramGAN, section 3.2: patch to code."""

from __future__ import annotations

import itertools
import math
from typing import Protocol

import torch
import torch.nn.functional as F
from torch import Tensor, nn

from solidtex_export.losses.descriptor.network import DescriptorNetwork
from solidtex_export.losses.descriptor.weights import PROCEDURAL, Trained, load_weights
from solidtex_export.settings import SettingsError
from solidtex_export.spaces.settings import EncoderSettings

SLOPE = 0.2
EPSILON = 1e-6
STRIDED = (32, 64, 96, 128, 128)  # channels of the convolutional encoder, each at half resolution


class Encoder(Protocol):
    """Encoder: `summary` does not change in training, `code` does."""

    def summary(self, patches: Tensor) -> Tensor:
        """Input of `code` for patches [n, 3, side, side]; does not change in training."""

    def code(self, summary: Tensor) -> Tensor:
        """Codes [n, code]."""


class DescriptorEncoder(nn.Module):
    """Means and root mean squares of the frozen learned descriptor's features, then two trained
    layers.

    The descriptor was trained to tell textures apart, so it generalizes better than convolutions
    that have seen a few hundred photographs.
    """

    def __init__(self, trained: Trained, settings: EncoderSettings, code: int) -> None:
        super().__init__()
        self._frozen = (trained.network,)  # no part of the state
        self.units = {name: d + 0.1 * d.mean() for name, d in trained.deviations.items()}
        features = 2 * sum(len(d) for d in self.units.values())
        self.unit_codes = settings.unit_codes
        self.first = nn.Linear(features, settings.width)
        self.last = nn.Linear(settings.width, code)

    @property
    def network(self) -> DescriptorNetwork:
        return self._frozen[0]

    @torch.no_grad()
    def summary(self, patches: Tensor) -> Tensor:
        found = self.network.to(patches.device).features(patches)
        parts = []
        for name, unit in self.units.items():
            f = found[name].float()
            parts.append(f.mean((2, 3)) / unit.to(f.device))
            parts.append((f.square().mean((2, 3)) + EPSILON).sqrt() / unit.to(f.device))
        return torch.cat(parts, dim=1)

    @torch.no_grad()
    def calibrate(self, summaries: Tensor) -> None:
        """Start with whitened inputs and codes of unit variance over these summaries."""
        deviation, mean = torch.std_mean(summaries, dim=0)
        self.first.weight *= math.sqrt(3) / (deviation + 0.1 * deviation.mean())
        self.first.bias.copy_(-self.first.weight @ mean)
        codes = self._raw(summaries)
        self.last.weight /= codes.std(0)[:, None]
        self.last.bias.copy_((self.last.bias - codes.mean(0)) / codes.std(0))

    def code(self, summary: Tensor) -> Tensor:
        codes = self._raw(summary)
        if self.unit_codes:
            codes = codes.shape[1] ** 0.5 * F.normalize(codes, dim=1)
        return codes

    def _raw(self, summary: Tensor) -> Tensor:
        return self.last(F.leaky_relu(self.first(summary), SLOPE))


class ConvolutionEncoder(nn.Module):
    """CNN that is trained with the space, as published: strided convolutions, then a mean."""

    def __init__(self, width: int, code: int) -> None:
        super().__init__()
        channels = (3, *(max(1, c * width // 64) for c in STRIDED))
        self.convolutions = nn.ModuleList(
            nn.Conv2d(a, b, 5 if i == 0 else 3, 2, padding=2 if i == 0 else 1)
            for i, (a, b) in enumerate(itertools.pairwise(channels))
        )
        self.last = nn.Linear(channels[-1], code)

    def summary(self, patches: Tensor) -> Tensor:
        return patches

    def calibrate(self, summaries: Tensor) -> None:
        """Nothing: the convolutions are trained from their random start."""

    def code(self, summary: Tensor) -> Tensor:
        x = summary
        for layer in self.convolutions:
            x = F.leaky_relu(layer(x), SLOPE)
        return self.last(x.mean((2, 3)))


def make_encoder(settings: EncoderSettings, code: int) -> DescriptorEncoder | ConvolutionEncoder:
    if settings.kind == "convolutions":
        if settings.unit_codes:
            raise SettingsError("encoder.unit_codes: found true, expected false for convolutions")
        return ConvolutionEncoder(settings.width, code)
    return DescriptorEncoder(load_weights(PROCEDURAL), settings, code)
