"""All families and their mixtures."""

from __future__ import annotations

from collections.abc import Callable

import torch
from torch import Tensor

from solidtex_export.research.procedural import cells, grains, noises, packings, tilings
from solidtex_export.research.procedural.color import colored
from solidtex_export.research.procedural.draw import Draw
from solidtex_export.research.procedural.fields import band_noise, noise, smooth_step
from solidtex_export.research.procedural.noises import Fields

FAMILIES: tuple[Callable[[Draw], Fields], ...] = (
    noises.clouds,
    cells.minerals,
    grains.fibers,
    packings.leaves,
    noises.blobs,
    cells.cracks,
    grains.rings,
    packings.strokes,
    noises.ridges,
    cells.crystals,
    grains.plank,
    packings.spheres,
    noises.veins,
    cells.mosaic,
    grains.ripples,
    packings.chips,
    noises.speckle,
    cells.cobbles,
    grains.brushed,
    tilings.bricks,
    noises.turbulence,
    cells.bubbles,
    grains.weave,
    tilings.hexagons,
    noises.contours,
    noises.bands,
)
MIXTURES = 10  # in this many batches of a round, a second family is mixed in
ROUND = len(FAMILIES) + MIXTURES
SEED_STRIDE = 1_000_003  # more than any number of batches


def batch(seed: int, index: int, count: int, size: int) -> Tensor:
    """Batch `index` of the endless set: `count` images [count, 3, size, size] of one family."""
    draw = Draw(seed * SEED_STRIDE + index, count, size)
    place = index % ROUND
    if place < len(FAMILIES):
        return colored(draw, FAMILIES[place](draw))
    return colored(draw, mixture(draw))


def mixture(draw: Draw) -> Fields:
    """Two families, in patches or added."""
    one = FAMILIES[draw.one_of(len(FAMILIES))](draw)
    two = FAMILIES[draw.one_of(len(FAMILIES))](draw)
    patched = draw.chance(0.5)
    mask = noise(draw, draw.log_uniform(8, 40), draw.uniform(1.5, 4))
    if draw.one_of(2):
        mask = band_noise(draw, draw.log_uniform(12, 40), draw.uniform(0.2, 0.5))
    mask = smooth_step(draw.uniform(-1, 1), mask, draw.log_uniform(0.03, 0.3))
    weight = patched * mask + (1 - patched) * draw.uniform(0.2, 0.8)
    return torch.lerp(one[0], two[0], weight), torch.lerp(one[1], two[1], weight)
