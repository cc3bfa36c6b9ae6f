"""Power spectra of slices, in bands of frequency and direction.

After "Texture synthesis through convolutional neural networks and spectrum constraints" (Liu,
Gousseau and Xia 2016), but with bands instead of single frequencies, which would repeat the
photograph. Each band is weighted with the square root of its power, so that its gradient with
respect to a slice has the same length for the same ratio: docs/experiments/spectrum.md.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import torch
from torch import Tensor

from solidtex_export.losses.filled import filled_channels
from solidtex_export.losses.wavelets import orientations, squares

BANDS = 8  # up to half a wave per texel, of rows and of columns
LEAST_SIDE = 128  # smaller slices are padded to it, or bands would have no waves
FLOOR = 0.02  # deviation of invisible noise in a whitened channel: half of rounding's
TILES = 5  # of the photograph, each way, at most


class Bands(NamedTuple):
    """Rectangular bands of the frequencies of `torch.fft.rfft2`."""

    rows: Tensor
    """Share of each row in the mean of a band [2 * BANDS, row]. Waves that rise to the right have
    bands of their own.
    """
    columns: Tensor
    """Share of each column in the mean of a band [BANDS, column]."""


class _Target(NamedTuple):
    """Target spectrum for slices of one size."""

    bands: Bands
    logarithm: Tensor
    """Logarithm of the photograph's mean power [channel, band of rows, band of columns]."""
    weight: Tensor
    """Weights of the same shape, with sum 1."""


class SpectrumLoss:
    """Compares slices with one exemplar [channel, rows, columns], both of whitened values.

    The target is averaged over the orientations of `symmetry`.
    """

    def __init__(self, exemplar: Tensor, symmetry: str) -> None:
        self._filled = filled_channels(exemplar)
        self._exemplar = exemplar[self._filled]
        self._symmetry = symmetry
        self._targets: dict[int, _Target] = {}

    def __call__(self, slices: Tensor) -> Tensor:
        """Mean squared difference of the logarithm of the joint power of `slices` [batch, channel,
        side, side].
        """
        side = slices.shape[2]
        with torch.autocast(slices.device.type, enabled=False):
            if side not in self._targets:
                self._targets[side] = self._measure(side)
            target = self._targets[side]
            found = power(slices.float()[:, self._filled], target.bands)
            return (target.weight * (found.log() - target.logarithm).square()).sum()

    def _measure(self, side: int) -> _Target:
        bands = bands_of(side, self._exemplar.device)
        copies = orientations(self._exemplar, self._symmetry)
        mean = torch.stack([power(_tiles(c, side), bands) for c in copies]).mean(0)
        return _Target(bands, mean.log(), mean.sqrt() / mean.sqrt().sum())


def power(images: Tensor, bands: Bands, floor: float = FLOOR) -> Tensor:
    """Mean power of `images` [batch, channel, side, side] plus that of noise of deviation `floor`.

    The result is [channel, band of rows, band of columns]; white noise has its variance in each
    band. A window fades the borders: opposite borders of an image that does not repeat would meet
    in an edge, which has all frequencies along the axes.
    """
    row = torch.hann_window(images.shape[2], device=images.device)
    window = torch.outer(row, row)
    mean = (images * window).sum((2, 3), keepdim=True) / window.sum()
    waves = torch.fft.rfft2((images - mean) * window, s=2 * [bands.rows.shape[1]])
    powers = (waves.real.square() + waves.imag.square()).mean(0) / window.square().sum()
    return bands.rows @ powers @ bands.columns.T + floor * floor


def bands_of(side: int, device: torch.device | None = None) -> Bands:
    """Bands of images of that side, padded to LEAST_SIDE."""
    side = max(side, LEAST_SIDE)
    rows, columns = torch.fft.fftfreq(side), torch.fft.rfftfreq(side)
    down, across = ((2 * BANDS * w.abs()).floor().clamp_max(BANDS - 1) for w in (rows, columns))
    down = down + BANDS * (rows < 0)
    return Bands(_shares(down, 2 * BANDS).to(device), _shares(across, BANDS).to(device))


def _shares(numbers: Tensor, count: int) -> Tensor:
    """Weights [number, element] for means over the elements with the same number."""
    members = (numbers == torch.arange(count)[:, None]).float()
    return members / members.sum(1, keepdim=True)


def _tiles(image: Tensor, side: int) -> Tensor:
    """Square tiles [tile, channel, side, side], overlapping by half or more if TILES allows it."""
    counts = [min(TILES, 1 + math.ceil(2 * (n - side) / side)) for n in image.shape[1:]]
    return torch.stack(squares(image, side, *counts))
