"""A surrogate: a picture of the same tones and the same spectrum as another, and nothing else.

"Improved surrogate data for nonlinearity tests" (Schreiber and Schmitz 1996): phases are drawn at
random, then tones and spectrum are enforced in turns. What a surrogate lacks is all that takes
phases that agree: outlines, veins, cracks, the flat inside of a pore.
"""

from __future__ import annotations

import torch
from torch import Tensor

ROUNDS = 8


def surrogate(image: Tensor, generator: torch.Generator) -> Tensor:
    """A random one of `image` [channel, row, column], of its size.

    The spectrum is that of the picture mirrored at its borders, which would else be outlines. All
    channels get the same phases, so that colors that go together still do.
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
    """The ranks of `image` and the sorted values `tones` [channel, pixel], channel by channel."""
    order = image.flatten(1).argsort(1)
    return torch.empty_like(tones).scatter_(1, order, tones).view_as(image)


def scrambled(images: Tensor, generator: torch.Generator) -> Tensor:
    """The same spectrum and no structure: random phases, the same for all colors."""
    rows, columns = images.shape[2:]
    white = torch.fft.rfft2(torch.randn(len(images), 1, rows, columns, generator=generator))
    return torch.fft.irfft2(torch.fft.rfft2(images) * white / white.abs(), s=(rows, columns))
