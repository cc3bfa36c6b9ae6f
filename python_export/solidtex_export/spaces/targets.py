"""Losses of many materials: each photograph's statistics are measured once.

The descriptor's Gram loss (losses/learned.py) and the wavelet loss (losses/wavelets.py), for slices
of one material at a time.
"""

from __future__ import annotations

import torch
from torch import Tensor

from solidtex_export.images.exemplar import random_symmetry
from solidtex_export.losses.descriptor.weights import SHIPPED, load_weights
from solidtex_export.losses.learned import LearnedDescriptor, Measured
from solidtex_export.losses.wavelets import WaveletLoss
from solidtex_export.spaces.settings import LossSettings, SlicingSettings

ORIENTATIONS = 2  # pairs of random color axes and orientation that each photograph is measured in
LARGEST = 384  # side of the part of a photograph that is measured


class DescriptorTargets:
    """Statistics of the learned descriptor's features for every material."""

    def __init__(self, descriptor: LearnedDescriptor, symmetry: str) -> None:
        self._descriptor, self._symmetry = descriptor, symmetry
        self._measured: list[list[Measured]] = []

    def add(self, image: Tensor) -> None:
        part = image[None, :, :LARGEST, :LARGEST]
        turned = (random_symmetry(part, self._symmetry) for _ in range(ORIENTATIONS))
        self._measured.append([self._descriptor.measure(one) for one in turned])

    def loss(self, index: int, slices: Tensor) -> Tensor:
        """Distance of slices [batch, 3, row, column] from the material of that index."""
        choices = self._measured[index]
        return self._descriptor.distance(slices, choices[int(torch.randint(len(choices), ()))])


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


Targets = DescriptorTargets | WaveletTargets


def load_descriptor(losses: LossSettings) -> LearnedDescriptor | None:
    """The descriptor of the losses, if one of them needs it."""
    return LearnedDescriptor(load_weights(SHIPPED[losses.network])) if losses.descriptor else None


def make_targets(
    losses: LossSettings, slicing: SlicingSettings, descriptor: LearnedDescriptor | None
) -> dict[str, tuple[float, Targets]]:
    """Weight and targets of each loss, by name, of no material yet."""
    found: dict[str, tuple[float, Targets]] = {}
    if descriptor is not None:
        found["descriptor"] = (losses.descriptor, DescriptorTargets(descriptor, slicing.symmetry))
    if losses.wavelets:
        found["wavelets"] = (losses.wavelets, WaveletTargets(slicing.size, slicing.symmetry))
    return found
