"""A picture of the same tones and the same spectrum as another, and nothing else of it.

"Improved surrogate data for nonlinearity tests" (Schreiber and Schmitz 1996): phases are drawn at
random, then tones and spectrum are enforced in turns. What a surrogate lacks is all that takes
phases that agree: outlines, veins, cracks, the flat inside of a pore.
"""

from __future__ import annotations

import torch
from torch import Tensor

ROUNDS = 8


def surrogate(image: Tensor) -> Tensor:
    """A random one of `image` [channel, row, column], of its size.

    The spectrum is that of the picture mirrored at its borders, which would else be outlines. All
    channels get the same phases, so that colours that go together still do.
    """
    rows, columns = image.shape[1:]
    mirrored = torch.cat([image, image.flip(2)], 2)
    mirrored = torch.cat([mirrored, mirrored.flip(1)], 1)
    spectrum = torch.fft.rfft2(mirrored)
    found = _inverse(spectrum * _phases(torch.randn(mirrored.shape[1:])), mirrored)
    for _ in range(ROUNDS):
        toned = _with_tones(found, mirrored)
        found = _inverse(spectrum.abs() * torch.sgn(torch.fft.rfft2(toned)), mirrored)
    return _with_tones(found, mirrored)[:, rows // 2 :, columns // 2 :][:, :rows, :columns]


def _phases(noise: Tensor) -> Tensor:
    return torch.sgn(torch.fft.rfft2(noise))


def _inverse(spectrum: Tensor, like: Tensor) -> Tensor:
    return torch.fft.irfft2(spectrum, s=like.shape[1:])


def _with_tones(image: Tensor, source: Tensor) -> Tensor:
    """The ranks of `image` and the values of `source`, channel by channel."""
    order = image.flatten(1).argsort(1)
    values = source.flatten(1).sort(1).values
    return torch.empty_like(values).scatter_(1, order, values).view_as(image)
