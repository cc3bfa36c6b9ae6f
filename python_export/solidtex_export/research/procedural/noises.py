"""Textures made of Gaussian noise; each function returns two fields in about 0 ... 1."""

from __future__ import annotations

import torch
from torch import Tensor

from solidtex_export.research.procedural.draw import Draw
from solidtex_export.research.procedural.fields import (
    band_noise,
    frame,
    noise,
    ranks,
    saw,
    smooth_step,
    wave,
)

Fields = tuple[Tensor, Tensor]


def clouds(draw: Draw) -> Fields:
    first = noise(draw, draw.log_uniform(2, 40), draw.uniform(0.8, 4), stretch=4)
    second = noise(draw, draw.log_uniform(2, 40), draw.uniform(0.8, 4), stretch=4)
    return ranks(first), ranks(second)


def bands(draw: Draw) -> Fields:
    """Noise of one size, as of leather or of foam."""
    first = band_noise(draw, draw.log_uniform(4, 30), draw.uniform(0.15, 0.6), stretch=3)
    second = band_noise(draw, draw.log_uniform(3, 20), draw.uniform(0.15, 0.8), stretch=3)
    return ranks(first), ranks(second)


def ridges(draw: Draw) -> Fields:
    """Thin lines where noise crosses zero."""
    base = noise(draw, draw.log_uniform(8, 50), draw.uniform(2, 4), stretch=4)
    line = (1 - base.abs() / draw.uniform(0.3, 2)).clamp_min(0).pow(draw.log_uniform(0.5, 3))
    return line, ranks(base)


def turbulence(draw: Draw) -> Fields:
    scale, gain = draw.log_uniform(12, 40), draw.uniform(0.35, 0.8)
    total, weight = torch.zeros(()), torch.ones(())
    for octave in range(4):
        layer = band_noise(draw, scale / 2**octave, torch.full_like(scale, 0.5))
        total, weight = total + weight * layer.abs(), weight * gain
    total = total / total.amax((1, 2), keepdim=True)
    return total, ranks(noise(draw, draw.log_uniform(2, 20), draw.uniform(1, 3)))


def veins(draw: Draw) -> Fields:
    """Marble: stripes bent by noise."""
    u, _ = frame(draw, warp=0)
    bend = noise(draw, draw.log_uniform(10, 60), draw.uniform(1.5, 3), stretch=3)
    phase = u / draw.log_uniform(8, 40) + bend * draw.log_uniform(0.1, 1.5)
    line = saw(phase, draw.uniform(0.1, 0.9)).pow(draw.log_uniform(0.4, 5))
    return line, ranks(noise(draw, draw.log_uniform(2, 30), draw.uniform(1, 3)))


def blobs(draw: Draw) -> Fields:
    """Two phases, with sharp or soft interfaces."""
    banded = draw.chance(0.5)
    wavelength = draw.log_uniform(5, 36)
    field = banded * band_noise(draw, wavelength, draw.uniform(0.15, 0.5), stretch=3)
    field = field + (1 - banded) * noise(draw, wavelength, draw.uniform(1.5, 4), stretch=3)
    softness = draw.log_uniform(0.02, 0.3)
    phase = smooth_step(draw.uniform(-1.1, 1.1), field, softness)
    return phase, ranks(noise(draw, draw.log_uniform(1, 12), draw.uniform(0.5, 3)))


def contours(draw: Draw) -> Fields:
    """Lines of equal height, as in agate."""
    field = noise(draw, draw.log_uniform(16, 60), draw.uniform(2.5, 4), stretch=3)
    phase = field * draw.log_uniform(0.7, 4)
    return wave(phase, draw.log_uniform(1, 20)), ranks(field)


def speckle(draw: Draw) -> Fields:
    """Sparse spots of two kinds on a calm ground."""
    spots = []
    for _ in range(2):
        field = band_noise(draw, draw.log_uniform(2.5, 14), draw.uniform(0.2, 0.7), stretch=2)
        spots.append(smooth_step(draw.uniform(0.8, 2.2), field, draw.log_uniform(0.03, 0.3)))
    ground = ranks(noise(draw, draw.log_uniform(2, 40), draw.uniform(1, 3)))
    mixed = torch.lerp(ground * draw.uniform(0, 0.4), torch.ones(()), spots[0])
    return mixed, spots[1]
