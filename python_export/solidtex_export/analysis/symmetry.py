"""Orientations in which a photograph looks equally right.

A photograph with light from one side, or with horizontal layers, looks wrong flipped or turned.
Statistics averaged over such orientations describe no image. The measure is the descriptor distance
between the photograph and its flipped and turned copies, relative to the distance from its
surrogates. docs/experiments/symmetry.md has figures.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

from torch import Tensor

from solidtex_export.analysis.structure import MeasuredImage

MIN_LIMIT, MAX_LIMIT = 2.5, 10.0
"""Limits of that ratio. Marble has a weak orientation bias and a ratio of 2; light shows beside
clear outlines too.
"""
DRAWS = 8  # the descriptor turns channels at random


class Symmetry(NamedTuple):
    """Orientations, named as for --symmetry, and the measured ratios."""

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
    """Symmetry that all photographs have. Quarter turns count only if a photograph `turns` between
    its directions.
    """

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
