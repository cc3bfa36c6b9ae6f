"""Building blocks of all families: coordinates, spectral Gaussian noise, warps, profiles.

A field is [count, size, size]. Lengths are in pixels.
"""

from __future__ import annotations

import math

import torch
import torch.nn.functional as F
from torch import Tensor

from solidtex_export.research.procedural.draw import Draw


def noise(draw: Draw, scale: Tensor, exponent: Tensor, stretch: float = 1.0) -> Tensor:
    """Gaussian noise, spectrum flat below 1/scale and falling as frequency^-exponent above it.

    Structures are up to `stretch` times longer along a random direction. Zero mean, unit variance.
    """
    frequency = _frequencies(draw, stretch)
    return _filtered(draw, (frequency.square() + scale.pow(-2)).pow(-exponent / 2))


def band_noise(draw: Draw, wavelength: Tensor, octaves: Tensor, stretch: float = 1.0) -> Tensor:
    """Gaussian noise around one wavelength, with a bandwidth in octaves."""
    frequency = _frequencies(draw, stretch)
    distance = torch.log2(frequency.clamp_min(1e-6) * wavelength) / octaves
    return _filtered(draw, torch.exp(-0.5 * distance.square()))


def _frequencies(draw: Draw, stretch: float) -> Tensor:
    """Lengths of the frequency vectors in cycles per pixel, in random stretched axes."""
    fy = torch.fft.fftfreq(draw.size).view(1, -1, 1)
    fx = torch.fft.rfftfreq(draw.size).view(1, 1, -1)
    angle = draw.uniform(0, math.pi)
    ratio = draw.log_uniform(1, stretch) if stretch > 1 else torch.ones(draw.count, 1, 1)
    along = (fx * angle.cos() + fy * angle.sin()) * ratio.sqrt()
    across = (fy * angle.cos() - fx * angle.sin()) / ratio.sqrt()
    return torch.hypot(along, across)


def _filtered(draw: Draw, amplitude: Tensor) -> Tensor:
    white = torch.fft.rfft2(draw.normal(draw.count, draw.size, draw.size))
    return standard(torch.fft.irfft2(white * amplitude, s=(draw.size, draw.size)))


def standard(field: Tensor) -> Tensor:
    """Zero mean and unit variance."""
    field = field - field.mean((1, 2), keepdim=True)
    return field / (field.square().mean((1, 2), keepdim=True).sqrt() + 1e-6)


def ranks(field: Tensor) -> Tensor:
    """Standard normal values to uniform ones in 0 ... 1."""
    return torch.special.ndtr(field)


def frame(draw: Draw, stretch: float = 1.0, warp: float = 0.5) -> tuple[Tensor, Tensor]:
    """Coordinates (u, v) in pixels: turned, stretched along u, bent by noise.

    Bends of up to `warp` times their own wavelength / 2 pi, in half of the images.
    """
    axis = torch.arange(draw.size, dtype=torch.float32) + 1000.0
    angle = draw.uniform(0, 2 * math.pi)
    x, y = axis.view(1, 1, -1), axis.view(1, -1, 1)
    ratio = draw.log_uniform(1, stretch) if stretch > 1 else torch.ones(draw.count, 1, 1)
    u = (x * angle.cos() + y * angle.sin()) / ratio
    v = y * angle.cos() - x * angle.sin()
    if warp > 0:
        scale = draw.log_uniform(8, 80)
        amount = draw.chance(0.5) * draw.uniform(0, warp) * scale / (2 * math.pi)
        exponent = draw.uniform(2, 4)
        u = u + amount * noise(draw, scale, exponent)
        v = v + amount * noise(draw, scale, exponent)
    return u, v


def wave(phase: Tensor, sharpness: Tensor) -> Tensor:
    """A profile of period 1 in 0 ... 1: a sine, sharpened towards a square wave."""
    return torch.sigmoid(torch.sin(2 * math.pi * phase) * sharpness)


def saw(phase: Tensor, rise: Tensor) -> Tensor:
    """A profile of period 1 that rises to 1 during `rise` of it and falls during the rest."""
    t = phase - phase.floor()
    return torch.minimum(t / rise, (1 - t) / (1 - rise))


def smooth_step(edge: Tensor, field: Tensor, softness: Tensor) -> Tensor:
    return torch.sigmoid((field - edge) / softness)


def blur(images: Tensor, sigma: float) -> Tensor:
    """Gaussian blur of [batch, channel, rows, columns], mirrored at the border."""
    radius = max(1, math.ceil(2.5 * sigma))
    x = torch.arange(-radius, radius + 1, dtype=images.dtype)
    kernel = torch.exp(-0.5 * (x / sigma).square())
    kernel = kernel / kernel.sum()
    flat = images.flatten(0, 1).unsqueeze(1)
    flat = F.conv2d(F.pad(flat, (radius, radius, 0, 0), "reflect"), kernel.view(1, 1, 1, -1))
    flat = F.conv2d(F.pad(flat, (0, 0, radius, radius), "reflect"), kernel.view(1, 1, -1, 1))
    return flat.view_as(images)
