"""In which orientations a photograph looks just as right, where the user does not say.

Losses that see slices and photograph in random orientations keep a solid from leaning as one
photograph happens to. But a photograph that is lit from one side, or whose layers lie, looks wrong
turned, and its statistics averaged over all orientations belong to no picture: lit pebbles came out
as noise, and as pebbles in the photograph's own orientation.

Measured as the distance by our descriptor (losses/learned.py) of the photograph from itself flipped
and turned, beside that from pictures of its tones and spectrum alone (analysis/surrogate.py): what
is farther from its own flipped copy than from these has more to lose by being flipped than all its
outlines are. Between LEAST and MOST that distance is the limit. At 256 pixels:

                        flipped      turned    random phases
    granites            0.1, 1.1     0.1       1.5, 0.5
    marble, rust        1.7, 0.1     2.0, 0.2  1.2, 4.6
    cracked soil        0.7          0.9       2.0
    slanting grain      2.2          0.9       1.7
    rock with crevices  2.3          0.9       2.0
    grass               4.3          6.6       5.2
    lichen, lit         8.3          25        11
    red-cracked rock    3.3          0.7       2.7
    ochre rock, lit     5.5          4.2       4.8
    stone wall, lit     4.8          8.9       3.0
    rock in layers      1.8          20        2.6
    bedded sandstone    0.3          3.9       1.7
    lit pebbles         67           0.3       15
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import torch
from torch import Tensor

from solidtex_export.analysis.structure import Distance, mean_distance, seen, surrogate_distance
from solidtex_export.images.exemplar import Exemplar

LEAST, MOST = 2.5, 10.0
"""Of the limit: marble leans a little and has 2; light shows beside clear outlines too."""
DRAWS = 8  # the descriptor turns channels at random


class Symmetry(NamedTuple):
    """Orientations, named as for --symmetry, and what was found on the photograph."""

    name: str
    reason: str


class _Difference(NamedTuple):
    value: float
    limit: float

    def reason(self, moved: str) -> str:
        side = "at least" if self.counts else "below"
        return f"differs by {self.value:.1f} when {moved}, {side} {self.limit:.1f}"

    @property
    def counts(self) -> bool:
        return self.value >= self.limit


def symmetry_of(exemplars: Sequence[Exemplar], turns: bool, distance: Distance) -> Symmetry:
    """Of all `exemplars` alike, the same in every call. Whether they may be turned by a quarter is
    asked only if one of them `turns` from direction to direction."""
    images = [seen(exemplar) for exemplar in exemplars]
    limits = [_limit(image, distance) for image in images]

    def difference(moved: Callable[[Tensor], list[Tensor]]) -> _Difference:
        farthest = [_farthest(moved(image), image, distance) for image in images]
        each = map(_Difference, farthest, limits)
        return max(each, key=lambda d: d.value / d.limit)

    flipped = difference(lambda i: [i.flip(1), i.flip(2)])
    if flipped.counts:
        return Symmetry("none", flipped.reason("flipped"))
    if not turns:
        return Symmetry("flips", flipped.reason("flipped"))
    turned = difference(lambda i: [i.transpose(1, 2)])
    return Symmetry("flips" if turned.counts else "all", turned.reason("turned"))


def _limit(image: Tensor, distance: Distance) -> float:
    with torch.random.fork_rng(devices=[]), torch.no_grad():
        far = surrogate_distance(image, distance, torch.manual_seed(0))
        return min(max(LEAST, far), MOST)


def _farthest(copies: list[Tensor], image: Tensor, distance: Distance) -> float:
    with torch.random.fork_rng(devices=[]), torch.no_grad():
        torch.manual_seed(0)
        return max(mean_distance([copy] * DRAWS, image, distance) for copy in copies)
