"""The orientations in which a photograph looks just as right.

A photograph that is lit from one side, or whose layers lie, looks wrong flipped or turned, and its
statistics averaged over such orientations belong to no picture. Measured as the distance by our
descriptor of the photograph from itself flipped and turned, beside that from its surrogates.
docs/experiments/symmetry.md has figures.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

from torch import Tensor

from solidtex_export.analysis.structure import MeasuredImage

MIN_LIMIT, MAX_LIMIT = 2.5, 10.0
"""Marble leans a little and has 2; light shows beside clear outlines too."""
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


def symmetry_of(images: Sequence[MeasuredImage], turns: bool) -> Symmetry:
    """Of all photographs alike. Whether they may be turned by a quarter is asked only if one of
    them `turns` from direction to direction."""

    def difference(moved: Callable[[Tensor], list[Tensor]]) -> _Difference:
        each = (_Difference(i.farthest(moved(i.pixels), DRAWS), _limit(i)) for i in images)
        return max(each, key=lambda d: d.value / d.limit)

    flipped = difference(lambda i: [i.flip(1), i.flip(2)])
    if flipped.counts:
        return Symmetry("none", flipped.reason("flipped"))
    if not turns:
        return Symmetry("flips", flipped.reason("flipped"))
    turned = difference(lambda i: [i.transpose(1, 2)])
    return Symmetry("flips" if turned.counts else "all", turned.reason("turned"))


def _limit(image: MeasuredImage) -> float:
    return min(max(MIN_LIMIT, image.surrogate_distance), MAX_LIMIT)
