"""Converts fields to camera-like colors and to whitened values."""

from __future__ import annotations

import math

import torch
from torch import Tensor

from solidtex_export.research.procedural.draw import Draw
from solidtex_export.research.procedural.fields import blur, noise
from solidtex_export.research.procedural.noises import Fields

RAMP_STOPS = 6
MIN_AXIS_RATIO = 0.15  # of the largest deviation, as in training on photographs


def colored(draw: Draw, fields: Fields) -> Tensor:
    """Images [count, 3, size, size] in 0 ... 1."""
    first, second = fields
    image = _ramp(draw, first.clamp(0, 1).pow(draw.log_uniform(0.6, 1.7)))
    tint = draw.normal(draw.count, 3, 1, 1) * (0.12 * draw.chance(0.7)).unsqueeze(1)
    image = image + tint * (second - 0.5).unsqueeze(1)
    image = image + (_shading(draw, first) * draw.chance(0.3)).unsqueeze(1)
    return _seen(draw, image).clamp(0, 1)


def _ramp(draw: Draw, t: Tensor) -> Tensor:
    """Random color gradient from dark to light with curvature."""
    n = draw.count
    ends = draw.unit(n, 2, 3) * 0.8 + 0.1
    gray = ends.mean(2, keepdim=True)
    ends = torch.lerp(gray, ends, draw.uniform(0, 1) * draw.chance(0.7))
    stops = torch.linspace(0, 1, RAMP_STOPS).view(1, -1, 1)
    table = torch.lerp(ends[:, :1], ends[:, 1:], stops)
    bends = draw.normal(n, RAMP_STOPS, 3) * draw.uniform(0, 0.25) * draw.chance(0.6)
    table = table + bends
    position = t * (RAMP_STOPS - 1)
    low = position.floor().clamp(max=RAMP_STOPS - 2)
    index = low.long().flatten(1)
    colors = []
    for channel in table.unbind(2):
        a, b = channel.gather(1, index), channel.gather(1, index + 1)
        colors.append(torch.lerp(a.view_as(t), b.view_as(t), position - low))
    return torch.stack(colors, dim=1)


def _shading(draw: Draw, height: Tensor) -> Tensor:
    """Light from one side, with the first field as relief."""
    down = torch.diff(height, dim=1, prepend=height[:, :1])
    right = torch.diff(height, dim=2, prepend=height[:, :, :1])
    angle = draw.uniform(0, 2 * math.pi)
    slope = right * angle.cos() + down * angle.sin()
    return torch.tanh(slope * draw.log_uniform(1, 5)) * draw.uniform(0.1, 0.4)


def _seen(draw: Draw, image: Tensor) -> Tensor:
    """Blur of the lens, shared by the batch, then film grain of random size."""
    if draw.one_of(2):
        image = blur(image, 0.4 + 0.8 * float(draw.unit()))
    grain = noise(draw, draw.log_uniform(0.5, 4), draw.uniform(1, 3))
    strength = draw.chance(0.5) * draw.log_uniform(0.005, 0.08)
    hues = draw.normal(draw.count, 3, *image.shape[2:])
    faint = draw.chance(0.4) * draw.log_uniform(0.003, 0.03)
    return image + (strength * grain).unsqueeze(1) + faint.unsqueeze(1) * hues


def whitened(images: Tensor) -> Tensor:
    """Values of unit variance along the principal axes of each image's colors."""
    flat = images.flatten(2)
    flat = flat - flat.mean(2, keepdim=True)
    values, vectors = torch.linalg.eigh(flat @ flat.transpose(1, 2) / flat.shape[2])
    deviations = values.clamp_min(1e-8).sqrt()
    deviations = torch.maximum(deviations, MIN_AXIS_RATIO * deviations.amax(1, keepdim=True))
    return ((vectors / deviations.unsqueeze(1)).transpose(1, 2) @ flat).view_as(images)
