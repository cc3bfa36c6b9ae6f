"""Textures made of Voronoi cells (Worley 1996); each function returns two fields in 0 ... 1."""

from __future__ import annotations

import math
from typing import NamedTuple

import torch
from torch import Tensor

from solidtex_export.research.procedural.draw import Draw
from solidtex_export.research.procedural.fields import frame, noise, ranks, smooth_step, wave
from solidtex_export.research.procedural.noises import Fields

PERIOD = 64  # cells after which the random points repeat


class Voronoi(NamedTuple):
    """Distances to the nearest and second nearest point in cell sides, and of the cell itself:"""

    first: Tensor
    second: Tensor
    du: Tensor  # the offset from its point
    dv: Tensor
    value: Tensor  # two random numbers in 0 ... 1
    other: Tensor


def table(draw: Draw) -> Tensor:
    """One random number in 0 ... 1 of each cell: [count, PERIOD^2]."""
    return draw.unit(draw.count, PERIOD * PERIOD)


def cell_index(column: Tensor, row: Tensor) -> Tensor:
    """Where a table keeps the cell of these whole-numbered coordinates."""
    return (row.remainder(PERIOD) * PERIOD + column.remainder(PERIOD)).long()


def looked_up(values: Tensor, index: Tensor) -> Tensor:
    """Entries of a table, in the shape of `index` [count, rows, columns]."""
    return values.gather(1, index.flatten(1)).view(index.shape)


def voronoi(draw: Draw, u: Tensor, v: Tensor, jitter: Tensor) -> Voronoi:
    """Cells of one random point in each unit square of (u, v); looks at the 3 x 3 next squares."""
    x = 0.5 + jitter[:, 0] * (table(draw) - 0.5)
    y = 0.5 + jitter[:, 0] * (table(draw) - 0.5)
    column, row = u.floor(), v.floor()
    s, t = u - column, v - row
    first = second = torch.full_like(u, math.inf)
    nearest = torch.zeros(u.shape, dtype=torch.long)
    for i in (-1, 0, 1):
        for j in (-1, 0, 1):
            index = cell_index(column + i, row + j)
            distance = torch.hypot(s - i - looked_up(x, index), t - j - looked_up(y, index))
            second = torch.minimum(second, torch.maximum(first, distance))
            nearest = torch.where(distance < first, index, nearest)
            first = torch.minimum(first, distance)
    du = _wrapped(u - nearest % PERIOD - looked_up(x, nearest))
    dv = _wrapped(v - nearest.div(PERIOD, rounding_mode="floor") - looked_up(y, nearest))
    values, others = looked_up(table(draw), nearest), looked_up(table(draw), nearest)
    return Voronoi(first, second, du, dv, values, others)


def _wrapped(offset: Tensor) -> Tensor:
    """An offset modulo PERIOD, the one that is nearest to zero."""
    return offset - PERIOD * torch.round(offset / PERIOD)


def _cells(draw: Draw, low: float, high: float, stretch: float = 3.0) -> tuple[Voronoi, Tensor]:
    side = draw.log_uniform(low, high)
    u, v = frame(draw, stretch, warp=0.8)
    return voronoi(draw, u / side, v / side, draw.uniform(0.3, 1)), side


def bubbles(draw: Draw) -> Fields:
    """Domes or pits around the points."""
    cells, _ = _cells(draw, 6, 36)
    return (cells.first / 0.9).pow(draw.log_uniform(0.5, 2)).clamp(0, 1), cells.value


def cracks(draw: Draw) -> Fields:
    """Walls between the cells, of one width in pixels."""
    cells, side = _cells(draw, 8, 40)
    width = draw.log_uniform(0.6, 6) / side
    wall = smooth_step(width, cells.second - cells.first, draw.log_uniform(0.01, 0.1))
    return wall, cells.value * draw.chance(0.6)


def mosaic(draw: Draw) -> Fields:
    """Cells of one value each."""
    cells, _ = _cells(draw, 5, 36)
    return cells.value, cells.other


def crystals(draw: Draw) -> Fields:
    """Cells with stripes or gradients, in a direction of their own."""
    cells, side = _cells(draw, 10, 44)
    angle = 2 * math.pi * cells.other
    along = (cells.du * angle.cos() + cells.dv * angle.sin()) * side
    stripes = wave(along / draw.log_uniform(3, 14) + cells.value, draw.log_uniform(0.5, 8))
    slope = (0.5 + along / side / 2).clamp(0, 1)
    striped = draw.chance(0.5)
    inner = striped * stripes + (1 - striped) * slope
    return torch.lerp(cells.value, inner, draw.uniform(0.2, 0.9)), cells.other


def minerals(draw: Draw) -> Fields:
    """Granite: grains of two to four kinds, speckled inside."""
    cells, _ = _cells(draw, 4, 30, stretch=2)
    kinds = draw.integer(2, 4)
    share = draw.log_uniform(0.4, 2.5)  # of the kinds, unequal
    kind = (cells.value.pow(share) * kinds).floor().clamp(max=3) / (kinds - 1)
    grain = ranks(noise(draw, draw.log_uniform(1, 10), draw.uniform(0.8, 3)))
    depth = draw.uniform(0, 0.4)
    return torch.lerp(kind.clamp(0, 1), grain, depth), torch.lerp(cells.other, grain, 0.5)


def cobbles(draw: Draw) -> Fields:
    """Rounded pebbles with dark joints."""
    cells, _ = _cells(draw, 10, 40, stretch=2)
    dome = (1 - torch.exp(-draw.log_uniform(2, 12) * (cells.second - cells.first))).clamp(0, 1)
    return dome * (0.6 + 0.4 * cells.value), cells.other
