"""Hard negatives: textures that differ from a given one in a single property.

docs/experiments/hard-negatives.md lists what else was tried.
"""

from __future__ import annotations

import torch
import torch.nn.functional as F
from torch import Tensor

from solidtex_export.research.procedural.fields import blur


def hardened(images: Tensor, generator: torch.Generator) -> Tensor:
    """A variant of each image [count, 3, rows, columns]; kinds alternate."""
    kinds = (scrambled, zoomed, softened, embossed)
    parts = [kind(images[i :: len(kinds)], generator) for i, kind in enumerate(kinds)]
    return torch.cat([_renormalized(part, images[i :: len(kinds)]) for i, part in enumerate(parts)])


def scrambled(images: Tensor, generator: torch.Generator) -> Tensor:
    """Draw random phases, the same for all colors; the spectrum stays."""
    rows, columns = images.shape[2:]
    white = torch.fft.rfft2(torch.randn(len(images), 1, rows, columns, generator=generator))
    return torch.fft.irfft2(torch.fft.rfft2(images) * white / white.abs(), s=(rows, columns))


def zoomed(images: Tensor, generator: torch.Generator) -> Tensor:
    """Magnify 1.2 to 1.5 times."""
    factor = 1.2 + 0.3 * float(torch.rand((), generator=generator))
    side = round(images.shape[2] / factor)
    return F.interpolate(
        images[:, :, :side, :side], images.shape[2:], mode="bicubic", align_corners=False
    )


def softened(images: Tensor, generator: torch.Generator) -> Tensor:
    """Blur or sharpen slightly."""
    strength = _per_image(images, generator, (-0.6, 0.9))
    return torch.lerp(images, blur(images, 0.9), strength)


def embossed(images: Tensor, generator: torch.Generator) -> Tensor:
    """Light from one side."""
    offsets = ((0, 1), (1, 0), (1, 1), (1, -1))
    offset = offsets[int(torch.randint(4, (), generator=generator))]
    slope = images - images.roll(offset, (2, 3))
    return images + slope * _per_image(images, generator, (0.4, 1.2))


def _per_image(images: Tensor, generator: torch.Generator, ends: tuple[float, float]) -> Tensor:
    t = torch.rand(len(images), 1, 1, 1, generator=generator)
    return ends[0] + (ends[1] - ends[0]) * t


def _renormalized(images: Tensor, like: Tensor) -> Tensor:
    """Match the mean and deviation of each channel of `like`."""

    def moments(x: Tensor) -> tuple[Tensor, Tensor]:
        return x.mean((2, 3), keepdim=True), x.std((2, 3), keepdim=True)

    (mean, deviation), (old, scale) = moments(like), moments(images)
    return (images - old) * (deviation / (scale + 1e-6)) + mean
