"""Regular textures: bricks, hexagons, dots; two fields in 0 ... 1 each."""

from __future__ import annotations

import torch
from torch import Tensor

from solidtex_export.research.procedural.cells import cell_index, looked_up, table
from solidtex_export.research.procedural.draw import Draw
from solidtex_export.research.procedural.fields import frame, noise, ranks, smooth_step
from solidtex_export.research.procedural.noises import Fields

ROW = 3**0.5  # distance of the rows of a honeycomb's one lattice, in cell widths


def bricks(draw: Draw) -> Fields:
    """Rows of bricks, each shifted against the last; stretched squares are planks."""
    u, v = frame(draw, warp=0.25)
    height = draw.log_uniform(6, 24)
    length = height * draw.log_uniform(1, 4)
    row = (v / height).floor()
    u = u / length + row * draw.uniform(0, 0.5)
    tile = cell_index(u.floor(), row)
    across = (0.5 - (u - u.floor() - 0.5).abs()) * length
    along = (0.5 - (v / height - row - 0.5).abs()) * height
    return _joined(draw, torch.minimum(across, along), tile)


def hexagons(draw: Draw) -> Fields:
    """Honeycomb: of two rectangular lattices of centers, the nearer one."""
    u, v = frame(draw, stretch=2, warp=0.3)
    side = draw.log_uniform(7, 30)
    u, v = u / side, v / side / ROW
    even = torch.stack((u.round(), v.round()))
    odd = torch.stack(((u - 0.5).round() + 0.5, (v - 0.5).round() + 0.5))
    point = torch.stack((u, v))
    step = torch.tensor([1.0, ROW]).view(2, 1, 1, 1)
    nearer = ((point - even) * step).square().sum(0) < ((point - odd) * step).square().sum(0)
    center = torch.where(nearer, even, odd)
    du, dv = ((point - center) * step).abs()
    edge = 0.5 - torch.maximum(du, 0.5 * du + 0.5 * ROW * dv)
    tile = cell_index(2 * center[0], 2 * center[1])
    return _joined(draw, edge * side, tile)


def _joined(draw: Draw, edge: Tensor, tile: Tensor) -> Fields:
    """Tiles of random tone with joints; `edge` is the distance to a joint's middle in pixels."""
    width = draw.log_uniform(0.7, 3)
    inside = smooth_step(width, edge, draw.log_uniform(0.15, 1))
    bevel = (edge / draw.log_uniform(2, 10)).clamp(0, 1)
    tone = torch.lerp(
        torch.full_like(edge, 0.6), looked_up(table(draw), tile), draw.uniform(0, 0.8)
    )
    tone = tone * torch.lerp(torch.ones(()), bevel, draw.chance(0.4))
    rough = ranks(noise(draw, draw.log_uniform(1, 10), draw.uniform(0.8, 3)))
    face = torch.lerp(tone, rough, draw.uniform(0, 0.4))
    return inside * (0.2 + 0.8 * face), torch.lerp(looked_up(table(draw), tile), rough, 0.5)
