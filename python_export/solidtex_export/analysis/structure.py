"""How much of a photograph is outlines: what its tones and its spectrum do not tell.

It decides between our two families where the user does not. A sampler computes a point from noise
at that point alone: grains, specks and fibres come out sharp at any angle, outlines as blotches. A
lattice generator sees neighbours: it draws outlines, and is softer at 45 degrees.

Measured as the distance by our descriptor (losses/learned.py) from surrogates, which have the
photograph's tones and spectrum alone (analysis/surrogate.py), less that of its own halves. Tried
besides: the ratio of the two, by which a granite has more outlines than tissue, since its halves
are so much alike; distances by wavelets, in which veins on a mottled ground are nearer to a
surrogate than the photograph's parts are; kurtosis of octaves, which is large for specks too.
"""

from __future__ import annotations

from collections.abc import Callable

import torch
from torch import Tensor

from solidtex_export.analysis.grain import channel_axes, whiten
from solidtex_export.analysis.surrogate import surrogate
from solidtex_export.images.exemplar import Exemplar

Distance = Callable[[Tensor, Tensor], Tensor]
"""Of two whitened pictures [1, channel, rows, columns]."""

SURROGATES = 8  # with 4, rock and tissue differed by 3 from seed to seed
LARGEST = 256  # pixels on a side are looked at
SCALE = 1000.0  # of the shipped descriptor's distances


def outlines(exemplar: Exemplar, distance: Distance) -> float:
    """How much farther surrogates are from the photograph than its own halves are.

    About 0 where there are none, 30 for a brick's crumbs. Draws at random, the same in every call.
    """
    image = seen(exemplar)
    with torch.random.fork_rng(devices=[]), torch.no_grad():
        far = surrogate_distance(image, distance, torch.manual_seed(0))
        return far - mean_distance(_halves(image), image, distance)


def seen(exemplar: Exemplar) -> Tensor:
    """What is looked at of a photograph, whitened."""
    mean, basis = channel_axes([exemplar])
    return whiten(exemplar.image, mean, basis)[:, :LARGEST, :LARGEST]


def surrogate_distance(image: Tensor, distance: Distance, generator: torch.Generator) -> float:
    """How far a whitened picture is from others of its tones and spectrum alone."""
    others = [surrogate(image, generator) for _ in range(SURROGATES)]
    return mean_distance(others, image, distance)


def _halves(image: Tensor) -> list[Tensor]:
    rows, columns = (side // 2 for side in image.shape[1:])
    return [image[:, :rows], image[:, -rows:], image[:, :, :columns], image[:, :, -columns:]]


def mean_distance(pictures: list[Tensor], image: Tensor, distance: Distance) -> float:
    """Of whitened `pictures` from a whitened image, in thousandths."""
    return SCALE * sum(float(distance(p[None], image[None])) for p in pictures) / len(pictures)
