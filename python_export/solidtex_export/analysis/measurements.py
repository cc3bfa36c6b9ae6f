"""Measurements on the photographs of a training, each made at most once."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property

from solidtex_export.analysis.grain import grain_ratio, grain_width
from solidtex_export.analysis.lines import line_elongation
from solidtex_export.analysis.symmetry import Distances, Symmetry, symmetry_of
from solidtex_export.images.exemplar import Exemplar


class Measurements:
    """Measurements on photographs that serve `directions`; `descriptor` loads a distance."""

    def __init__(
        self,
        exemplars: Sequence[Exemplar],
        directions: str,
        descriptor: Callable[[], Distances],
    ) -> None:
        self.exemplars = exemplars
        self.directions = directions
        self._descriptor = descriptor

    @property
    def turns(self) -> bool:
        """Whether directions of one photograph differ by a quarter turn."""
        return len(self.exemplars) == 1 and self.directions == "xyz"

    @property
    def most_symmetric(self) -> str:
        """The largest set of orientations in which a photograph may look right."""
        return "all" if self.turns else "flips"

    @cached_property
    def symmetry(self) -> Symmetry:
        return symmetry_of(self.exemplars, self._descriptor(), self.turns)

    @cached_property
    def line_elongation(self) -> float:
        return line_elongation(self.exemplars)

    @cached_property
    def grain_width(self) -> float:
        """Grain width of the first photograph, in pixels."""
        return grain_width(self.exemplars[0])

    @cached_property
    def grain(self) -> float:
        """Grain ratio of the first photograph."""
        return grain_ratio(self.exemplars[0])
