"""Orientations in which a photograph looks equally right.

A photograph with light from one side, or with horizontal layers, looks wrong flipped or turned.
Statistics averaged over such orientations describe no image. The measure is the descriptor distance
between the photograph and its flipped and turned copies: docs/experiments/ablation.md.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import torch
from torch import Tensor

from solidtex_export.analysis.grain import channel_axes, whiten
from solidtex_export.images.exemplar import Exemplar

Distances = Callable[[Tensor], Tensor]
"""Distances of all other whitened images [image, channel, row, column] from the first."""

LIMIT = 4.0  # thousandths of the shipped descriptor's distance
DRAWS = 4  # the descriptor turns channels at random
LARGEST = 192  # pixels: side of the square that is looked at


class Symmetry(NamedTuple):
    """Orientations, named as for --symmetry, and the measured distances."""

    name: str
    reason: str


def symmetry_of(exemplars: Sequence[Exemplar], distances: Distances, turns: bool) -> Symmetry:
    """Symmetry that all photographs have. Quarter turns count only if a photograph `turns` between
    its directions.
    """
    found = torch.stack([_differences(exemplar, distances) for exemplar in exemplars])
    flipped, turned = found.amax(0).tolist()
    if flipped >= LIMIT:
        return Symmetry("none", f"differs by {flipped:.1f} when flipped, at least {LIMIT:g}")
    if not turns:
        return Symmetry("flips", f"differs by {flipped:.1f} when flipped, below {LIMIT:g}")
    if turned >= LIMIT:
        return Symmetry("flips", f"differs by {turned:.1f} when turned, at least {LIMIT:g}")
    return Symmetry("all", f"differs by {max(flipped, turned):.1f} when turned, below {LIMIT:g}")


@torch.no_grad()
def _differences(exemplar: Exemplar, distances: Distances) -> Tensor:
    """Distances of the flipped and of the turned photograph.

    Draws at random, the same in every call, and leaves the global random generator unchanged.
    """
    mean, basis = channel_axes([exemplar])
    side = min(LARGEST, *exemplar.image.shape[1:])
    image = whiten(exemplar.image[:, :side, :side], mean, basis)
    copies = torch.stack([image, image.flip(1), image.flip(2), image.transpose(1, 2)])
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(0)
        found = torch.stack([distances(copies) for _ in range(DRAWS)]).mean(0)
    return 1000 * torch.stack([found[:2].max(), found[2]])
