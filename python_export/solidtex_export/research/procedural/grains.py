"""Textures with a direction: fibers, growth rings, ripples; two fields in 0 ... 1 each."""

from __future__ import annotations

import torch
from torch import Tensor

from solidtex_export.research.procedural.draw import Draw
from solidtex_export.research.procedural.fields import (
    frame,
    noise,
    ranks,
    saw,
    smooth_step,
    wave,
)
from solidtex_export.research.procedural.noises import Fields


def _streaks(draw: Draw, v: Tensor, width: Tensor) -> Tensor:
    """Noise that depends on v alone, smooth over `width` pixels; zero mean, unit variance."""
    values = draw.normal(draw.count, 4096)
    t = (v / width).remainder(4095)
    low = t.floor().clamp(max=4094)
    index = low.long().flatten(1)
    a, b = values.gather(1, index).view_as(v), values.gather(1, index + 1).view_as(v)
    t = t - low
    return torch.lerp(a, b, t * t * (3 - 2 * t)) * 1.15


def fibers(draw: Draw) -> Fields:
    """Streaks of finite length, of two widths."""
    long = noise(draw, draw.log_uniform(3, 20), draw.uniform(1.5, 3), stretch=30)
    _, v = frame(draw, warp=0.3)
    thin = _streaks(draw, v, draw.log_uniform(1, 5))
    mixed = torch.lerp(long, thin, draw.uniform(0, 0.8))
    return ranks(mixed * 1.3), ranks(thin)


def rings(draw: Draw) -> Fields:
    """Wood: growth rings around a far or near center, crossed by pores."""
    u, v = frame(draw, stretch=6, warp=0.5)
    distance = draw.log_uniform(40, 800)
    radius = torch.hypot(u - u.mean((1, 2), keepdim=True), v - v[:, :1, :1] + distance)
    pitch = draw.log_uniform(5, 28)
    wander = noise(draw, draw.log_uniform(20, 80), draw.uniform(2, 4)) * draw.uniform(0, 0.5)
    ring = saw(radius / pitch + wander, draw.uniform(0.55, 0.97)).pow(draw.log_uniform(0.5, 3))
    pores = noise(draw, draw.log_uniform(2, 6), draw.uniform(1, 3), stretch=20)
    pores = smooth_step(draw.uniform(0.5, 2), pores, draw.log_uniform(0.05, 0.4))
    return torch.lerp(ring, pores, draw.uniform(0, 0.5)), pores


def plank(draw: Draw) -> Fields:
    """Wood: unequal streaks along the grain, with short dark pores."""
    _, v = frame(draw, warp=0.6)
    width = draw.log_uniform(2, 12)
    base = _streaks(draw, v, width) + draw.uniform(0, 1) * _streaks(draw, v, width * 4)
    pores = noise(draw, draw.log_uniform(2, 5), draw.uniform(1, 2), stretch=25)
    pores = smooth_step(draw.uniform(0.6, 2), pores, draw.log_uniform(0.05, 0.4))
    return ranks(base * 0.8) * (1 - draw.uniform(0, 0.8) * pores), pores


def ripples(draw: Draw) -> Fields:
    """Sand: waves that fork."""
    u, _ = frame(draw, warp=1.2)
    phase = u / draw.log_uniform(5, 28)
    wander = noise(draw, draw.log_uniform(12, 50), draw.uniform(2, 4)) * draw.uniform(0, 0.4)
    profile = saw(phase + wander, draw.uniform(0.2, 0.8)).pow(draw.log_uniform(0.5, 2))
    return profile, ranks(noise(draw, draw.log_uniform(1, 12), draw.uniform(0.5, 3)))


def brushed(draw: Draw) -> Fields:
    """Metal: hairlines of one direction, or of two that cross."""
    lines = []
    for _ in range(2):
        _, v = frame(draw, warp=0.1)
        lines.append(_streaks(draw, v, draw.log_uniform(0.8, 4)))
    crossed = torch.lerp(lines[0], lines[1], draw.chance(0.5) * draw.uniform(0.2, 0.8))
    cloud = noise(draw, draw.log_uniform(3, 40), draw.uniform(1, 3))
    return ranks(torch.lerp(crossed, cloud, draw.uniform(0, 0.5)) * 1.2), ranks(cloud)


def weave(draw: Draw) -> Fields:
    """Cloth: threads that pass over and under each other."""
    u, v = frame(draw, stretch=1.5, warp=0.3)
    side = draw.log_uniform(3, 16)
    u, v = u / side, v / side
    repeat = draw.integer(2, 4)
    over = ((u.floor() + v.floor() * draw.integer(1, 2)).remainder(repeat) < 1).float()
    across = (u - u.floor() - 0.5).abs()
    along = (v - v.floor() - 0.5).abs()
    thread = torch.where(over > 0, across, along)
    height = (1 - (2 * thread).pow(draw.log_uniform(1.5, 6))).clamp(0, 1)
    tone = torch.lerp(height, over, draw.uniform(0, 0.6))
    return tone, wave(u + v, torch.ones(())) * draw.chance(0.3)
