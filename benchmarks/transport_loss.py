"""A loss that carries patches of slices to those of the photograph (docs/experiments/ablation.md).

Houdard, Leclaire, Papadakis and Rabin 2023, "A generative model for texture synthesis based on
optimal transport between feature distributions": the semi-dual form of optimal transport. A patch
of the photograph has a potential. A patch of a slice belongs to the one whose squared distance less
its potential is smallest; potentials rise where patches are left out and fall where they are used
too often, and are kept from step to step.

    --set losses.transport.kind=transport_loss:transport    (this folder in PYTHONPATH)
"""

from __future__ import annotations

import torch
import torch.nn.functional as F
from torch import Tensor

SIDE = 7  # of a patch, in pixels of its octave
OCTAVES = range(1, 4)
FAKES, REALS = 1536, 2048  # patches of each octave
REAL_CALLS = 16  # in which the photograph's patches are collected
RATE = 0.02  # of potentials, relative to the mean squared distance


class Transport:
    """Patches of the photograph, and their potentials, of one octave."""

    def __init__(self) -> None:
        self.reals = torch.empty(0)
        self.potentials = torch.empty(0)
        self.calls = 0

    def collect(self, images: Tensor) -> None:
        found = random_patches(images, REALS // REAL_CALLS)
        self.reals = torch.cat([self.reals.to(found), found])
        self.potentials = torch.cat([self.potentials.to(found), found.new_zeros(len(found))])

    def __call__(self, images: Tensor) -> Tensor:
        self.calls += 1
        fakes = random_patches(images, FAKES)
        with torch.no_grad():
            squared = torch.cdist(fakes, self.reals).square() / fakes.shape[1]
            nearest = (squared - self.potentials).argmin(1)
            used = torch.bincount(nearest, minlength=len(self.reals)) / len(fakes)
            step = RATE * squared.mean()
            self.potentials += step * (1 - len(self.reals) * used)
        return (fakes - self.reals[nearest]).square().mean()


_octaves = {octave: Transport() for octave in OCTAVES}  # a training is a process of its own


def random_patches(images: Tensor, count: int) -> Tensor:
    """Patches at random places, at most the given number: [patch, value]."""
    windows = images.unfold(2, SIDE, 1).unfold(3, SIDE, 1).permute(0, 2, 3, 1, 4, 5)
    places = torch.randperm(windows.shape[:3].numel())[:count].to(images.device)
    return windows[torch.unravel_index(places, windows.shape[:3])].flatten(1)


def transport(slices: Tensor, reals: Tensor) -> Tensor:
    """Sum over octaves of mean squared distances of patches that belong together."""
    with torch.autocast(slices.device.type, enabled=False):
        losses = []
        for octave, distance in _octaves.items():
            if distance.calls < REAL_CALLS:
                distance.collect(F.avg_pool2d(reals.float(), 2**octave))
            losses.append(distance(F.avg_pool2d(slices.float(), 2**octave)))
    return torch.stack(losses).sum()
