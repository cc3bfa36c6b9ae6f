"""Losses of many materials: each photograph's statistics are measured once.

The descriptor's Gram loss (losses/learned.py) and the wavelet loss (losses/wavelets.py), for slices
of one material at a time.
"""

from __future__ import annotations

from dataclasses import dataclass

import torch
import torch.nn.functional as F
from torch import Tensor

from solidtex_export.images.exemplar import random_symmetry
from solidtex_export.losses.descriptor.weights import Trained
from solidtex_export.losses.learned import GRAM_SOFTNESS, SILENT_SHARE, random_axes
from solidtex_export.losses.statistics import gram
from solidtex_export.losses.wavelets import WaveletLoss

ORIENTATIONS = 4  # pairs of random color axes and orientation that each photograph is measured in
LARGEST = 384  # side of the part of a photograph that is measured


@dataclass
class Measured:
    """Statistics of one photograph in one orientation: by layer, mean, gain and Gram matrix."""

    axes: Tensor
    layers: dict[str, tuple[Tensor, Tensor, Tensor]]


class DescriptorTargets:
    """Gram matrices of the learned descriptor for every material."""

    def __init__(self, trained: Trained, symmetry: str) -> None:
        self._network = trained.network
        self._floors = {n: d + SILENT_SHARE * d.mean() for n, d in trained.deviations.items()}
        self._symmetry = symmetry
        self._measured: list[list[Measured]] = []

    @torch.no_grad()
    def add(self, image: Tensor) -> None:
        part = image[None, :, :LARGEST, :LARGEST]
        self._measured.append([
            self._measure(random_symmetry(part, self._symmetry)) for _ in range(ORIENTATIONS)
        ])  # fmt: skip

    def _measure(self, image: Tensor) -> Measured:
        axes = random_axes(3).to(image.device)
        layers = {}
        for name, f in self._features(image, axes).items():
            f = f.float()
            mean = f.mean((0, 2, 3), keepdim=True)
            deviation = (f - mean).square().mean((0, 2, 3), keepdim=True).sqrt()
            gain = 1 / (deviation + self._floors[name].to(f.device).view(1, -1, 1, 1))
            layers[name] = (mean, gain, gram((f - mean) * gain))
        return Measured(axes, layers)

    def _features(self, images: Tensor, axes: Tensor) -> dict[str, Tensor]:
        network = self._network.to(images.device)
        return network.features(torch.einsum("ic,bcrs->birs", axes, images))

    def loss(self, index: int, slices: Tensor) -> Tensor:
        """Distance of slices [batch, 3, row, column] from the material of that index."""
        choices = self._measured[index]
        target = choices[int(torch.randint(len(choices), ()))]
        distances = []
        for name, f in self._features(slices, target.axes).items():
            mean, gain, expected = target.layers[name]
            f = (f.float() - mean) * gain
            distance = F.smooth_l1_loss(gram(f), expected, beta=GRAM_SOFTNESS)
            distances.append(distance + f.mean((0, 2, 3)).square().mean())
        return torch.stack(distances).mean()


class WaveletTargets:
    """Wavelet statistics of every material; a slice is compared alone, without running averages."""

    def __init__(self, size: int, symmetry: str) -> None:
        self._size, self._symmetry = size, symmetry
        self._losses: list[WaveletLoss] = []

    @torch.no_grad()
    def add(self, image: Tensor) -> None:
        self._losses.append(WaveletLoss(image[:, :LARGEST, :LARGEST], self._size, self._symmetry))

    def loss(self, index: int, slices: Tensor) -> Tensor:
        loss = self._losses[index]
        loss.forget()
        return loss(slices)
