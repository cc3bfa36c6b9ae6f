"""Pairs of crops of procedural textures; those of a step are a pure function of (seed, step)."""

from __future__ import annotations

import torch
from torch import Tensor

from solidtex_export.research.descriptor.variants import hardened
from solidtex_export.research.procedural import families
from solidtex_export.research.procedural.color import whitened

IMAGE = 160  # pixels, side of a texture
CROP = 64
BATCH = 16  # textures of one family generated together
KEPT_BATCHES = 2 * families.ROUND
STEPS_PER_BATCH = 2
TEXTURES = 40  # per step
VARIANTS = 24  # per step, almost alike some of the textures
HARD_SHARE = 0.6  # of the steps, with textures of a few families only
HARD_FAMILIES = 3
GRAY_SHARE = 0.15  # of the textures, reduced to their first principal axis
HELD_OUT_SEED = 2**31
HELD_OUT_PER_BATCH = 4


class Pool:
    """The most recent batches of whitened textures, in float16."""

    def __init__(self, seed: int, size: int = BATCH, kept: int = KEPT_BATCHES) -> None:
        """`size` textures a batch, of which `kept` are kept."""
        self._seed, self._size, self._kept = seed, size, kept
        self._batches: dict[int, Tensor] = {}

    def before(self, end: int) -> dict[int, Tensor]:
        """The last batches before that index, by index."""
        wanted = range(max(0, end - self._kept), end)
        self._batches = {i: self._kept_or_made(i) for i in wanted}
        return self._batches

    def _kept_or_made(self, index: int) -> Tensor:
        if index in self._batches:
            return self._batches[index]
        return whitened(families.batch(self._seed, index, self._size, IMAGE)).half()


def training_pairs(pool: Pool, seed: int, step: int) -> Tensor:
    """Crops [2n, 3, CROP, CROP]; i and i + n show the same texture, n = TEXTURES + VARIANTS."""
    batches = pool.before(families.ROUND + step // STEPS_PER_BATCH)
    generator = torch.Generator().manual_seed(seed * families.SEED_STRIDE + step)
    indices = list(batches)
    if torch.rand((), generator=generator) < HARD_SHARE:
        chosen = torch.randperm(families.ROUND, generator=generator)[:HARD_FAMILIES].tolist()
        indices = [i for i in indices if i % families.ROUND in chosen]
    picks = torch.randperm(len(indices) * BATCH, generator=generator)[:TEXTURES].tolist()
    images = torch.stack([batches[indices[p // BATCH]][p % BATCH] for p in picks]).float()
    return _pairs(images, generator)


def held_out_pairs() -> Tensor:
    """Crops as above of held-out textures, the same for every seed."""
    batches = [
        families.batch(HELD_OUT_SEED, i, HELD_OUT_PER_BATCH, IMAGE) for i in range(families.ROUND)
    ]
    generator = torch.Generator().manual_seed(HELD_OUT_SEED)
    return _pairs(whitened(torch.cat(batches)), generator)


def _pairs(images: Tensor, generator: torch.Generator) -> Tensor:
    images = torch.cat((images, hardened(images[:VARIANTS], generator)))
    images = _recolored(images, generator)
    crops = [_two_crops(image, generator) for image in images]
    return torch.stack([a for a, _ in crops] + [b for _, b in crops])


def _recolored(images: Tensor, generator: torch.Generator) -> Tensor:
    """Rotate the color axes of each image, so that color carries no information."""
    n = len(images)
    gray = (torch.rand(n, generator=generator) < GRAY_SHARE).float()
    keep = torch.ones(n, 3)
    keep[:, :2] -= gray[:, None]  # the last axis is the one of largest variance
    turns, _ = torch.linalg.qr(torch.randn(n, 3, 3, generator=generator))
    signs = torch.randn(n, 1, 3, generator=generator).sign()
    return ((turns * signs * keep[:, None]) @ images.flatten(2)).view_as(images)


def _two_crops(image: Tensor, generator: torch.Generator) -> tuple[Tensor, Tensor]:
    """One crop from each half, in the same random orientation."""

    def random(high: int) -> int:
        return int(torch.randint(high, (), generator=generator))

    if random(2):
        image = image.transpose(1, 2)
    half = IMAGE // 2
    crops = []
    for start in (0, half):
        r, c = random(IMAGE - CROP + 1), start + random(half - CROP + 1)
        crops.append(image[:, r : r + CROP, c : c + CROP])
    flips = [d for d in (1, 2) if random(2)]
    a, b = (crop.flip(flips) for crop in crops)
    return (a.transpose(1, 2), b.transpose(1, 2)) if random(2) else (a, b)
