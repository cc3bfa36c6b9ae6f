"""Surrogates: images with the color distribution and the spectrum of another, and nothing else.

"Improved surrogate data for nonlinearity tests" (Schreiber and Schmitz 1996): phases are drawn at
random, then color distribution and spectrum are enforced in turns. A surrogate lacks everything
that needs phases to agree: outlines, veins, cracks, the flat inside of a pore.
"""

from __future__ import annotations

import torch
from torch import Tensor

ROUNDS = 8


def surrogate(image: Tensor, generator: torch.Generator) -> Tensor:
    """A random surrogate of `image` [channel, row, column], of the same size.

    The spectrum is that of the image mirrored at its borders, which would otherwise act as
    outlines. All channels get the same phases, which keeps the correlations of colors.
    """
    rows, columns = image.shape[1:]
    mirrored = torch.cat([image, image.flip(2)], 2)
    mirrored = torch.cat([mirrored, mirrored.flip(1)], 1)
    tones = mirrored.flatten(1).sort(1).values
    amplitudes = torch.fft.rfft2(mirrored).abs()
    found = scrambled(mirrored[None], generator)[0]
    for _ in range(ROUNDS):
        phases = torch.sgn(torch.fft.rfft2(_with_tones(found, tones)))
        found = torch.fft.irfft2(amplitudes * phases, s=mirrored.shape[1:])
    return _with_tones(found, tones)[:, rows // 2 :, columns // 2 :][:, :rows, :columns]


def _with_tones(image: Tensor, tones: Tensor) -> Tensor:
    """Values `tones` [channel, pixel], sorted, in the rank order of `image`, channel by channel."""
    order = image.flatten(1).argsort(1)
    return torch.empty_like(tones).scatter_(1, order, tones).view_as(image)


def scrambled(images: Tensor, generator: torch.Generator) -> Tensor:
    """Image of the same spectrum without structure: random phases, the same for all colors."""
    rows, columns = images.shape[2:]
    white = torch.fft.rfft2(torch.randn(len(images), 1, rows, columns, generator=generator))
    return torch.fft.irfft2(torch.fft.rfft2(images) * white / white.abs(), s=(rows, columns))
