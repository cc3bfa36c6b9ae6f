"""Textures made of many small shapes that hide each other; two fields in 0 ... 1 each."""

from __future__ import annotations

import math

import torch
from torch import Tensor

from solidtex_export.research.procedural.cells import cell_index, looked_up, table
from solidtex_export.research.procedural.draw import Draw
from solidtex_export.research.procedural.fields import frame, noise, ranks
from solidtex_export.research.procedural.noises import Fields


def _scatter(
    draw: Draw, onto: Fields, side: Tensor, radius: Tensor, aspect: Tensor, share: Tensor
) -> Fields:
    """One shape per square cell of `side` pixels, in a `share` of the cells, over what is there.

    The half axes are radius and radius * aspect in cell sides. Gives value and height.
    """
    value, height = onto
    u, v = frame(draw, warp=0.4)
    u, v = u / side, v / side
    column, row = u.floor(), v.floor()
    s, t = u - column, v - row
    x, y, tone = table(draw), table(draw), table(draw)
    tone = torch.where(table(draw) < share[:, 0], tone, torch.full_like(tone, -1))  # -1: no shape
    turn = torch.where(draw.chance(0.5) > 0, 1.0, 0.15)[:, 0]
    angle = draw.uniform(0, math.pi)[:, 0] + math.pi * turn * table(draw)
    scale = radius[:, 0] * (1 - draw.uniform(0, 0.6)[:, 0] * table(draw))
    cos, sin = angle.cos() / scale, angle.sin() / scale
    squareness = draw.uniform(0, 1) * draw.chance(0.5)
    softness = draw.uniform(0.3, 2) / (side * radius * aspect)
    for i in (-1, 0, 1):
        for j in (-1, 0, 1):
            index = cell_index(column + i, row + j)
            du, dv = s - i - looked_up(x, index), t - j - looked_up(y, index)
            c, d = looked_up(cos, index), looked_up(sin, index)
            along, across = (du * c + dv * d).abs(), (dv * c - du * d).abs() / aspect
            distance = torch.hypot(along, across)
            distance = torch.lerp(distance, torch.maximum(along, across), squareness)
            tones = looked_up(tone, index)
            cover = ((1 - distance) / softness).clamp(0, 1) * (tones >= 0)
            value = torch.lerp(value, tones, cover)
            height = torch.lerp(height, (1 - distance.square()).clamp_min(0).sqrt(), cover)
    return value, height


def _ground(draw: Draw) -> Fields:
    tone = draw.uniform(0, 1) + draw.uniform(0, 0.2) * noise(
        draw, draw.log_uniform(1, 30), draw.uniform(1, 3)
    )
    return tone.clamp(0, 1), torch.zeros_like(tone)


def _mixed(draw: Draw, shapes: Fields) -> Fields:
    """Show either height and tone, or tone only."""
    value, height = shapes
    return torch.lerp(value, height, draw.uniform(0, 1) * draw.chance(0.6)), height


def spheres(draw: Draw) -> Fields:
    """Round grains of one size."""
    side, one = draw.log_uniform(6, 28), torch.ones(draw.count, 1, 1)
    shapes = _scatter(draw, _ground(draw), side, draw.uniform(0.3, 0.6), one, draw.uniform(0.3, 1))
    return _mixed(draw, shapes)


def leaves(draw: Draw) -> Fields:
    """Dead leaves (Matheron 1968): layers of ellipses of several sizes."""
    shapes = _ground(draw)
    largest, ratio = draw.log_uniform(14, 48), draw.uniform(0.5, 0.9)
    for layer in range(4):
        side = (largest * ratio**layer).clamp_min(4)
        aspect, share = draw.uniform(0.35, 1), draw.uniform(0.3, 1)
        shapes = _scatter(draw, shapes, side, draw.uniform(0.3, 0.8), aspect, share)
    return _mixed(draw, shapes)


def chips(draw: Draw) -> Fields:
    """Terrazzo: one layer of large chips on fine speckle, or flakes."""
    fine = _scatter(draw, _ground(draw), draw.log_uniform(4, 9), draw.uniform(0.2, 0.6),
                    draw.uniform(0.4, 1), draw.uniform(0.1, 0.8))  # fmt: skip
    shapes = _scatter(draw, fine, draw.log_uniform(16, 50), draw.uniform(0.3, 0.7),
                      draw.uniform(0.3, 0.9), draw.uniform(0.3, 0.9))  # fmt: skip
    return _mixed(draw, shapes)


def strokes(draw: Draw) -> Fields:
    """Short fibers, in one or in all directions."""
    shapes = _ground(draw)
    for _ in range(2):
        side, aspect = draw.log_uniform(10, 40), draw.log_uniform(0.04, 0.2)
        shapes = _scatter(draw, shapes, side, draw.uniform(0.5, 0.9), aspect, draw.uniform(0.4, 1))
    return shapes[0], ranks(noise(draw, draw.log_uniform(1, 10), draw.uniform(1, 3)))
