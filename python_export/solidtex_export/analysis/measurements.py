"""Measurements on the photographs of a training, each made at most once."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property

from solidtex_export.analysis.grain import grain_ratio
from solidtex_export.analysis.lines import line_elongation
from solidtex_export.analysis.structure import Distance, MeasuredImage
from solidtex_export.analysis.symmetry import Symmetry, symmetry_of
from solidtex_export.images.channels import groups
from solidtex_export.images.exemplar import Exemplar


class Measurements:
    """Measurements on photographs that serve `directions`; `descriptor` makes the distance."""

    def __init__(
        self, exemplars: Sequence[Exemplar], directions: str, descriptor: Callable[[], Distance]
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

    @property
    def has_maps(self) -> bool:
        return len(groups(self.exemplars[0].channels)) > 1

    @cached_property
    def symmetry(self) -> Symmetry:
        return symmetry_of(self._images, self.turns)

    @cached_property
    def line_elongation(self) -> float:
        return line_elongation(self.exemplars)

    @cached_property
    def grain(self) -> float:
        """Grain ratio of the first photograph."""
        return grain_ratio(self.exemplars[0])

    @cached_property
    def structure_score(self) -> float:
        """Structure score of the first photograph."""
        return self._images[0].structure_score

    @cached_property
    def _images(self) -> list[MeasuredImage]:
        distance = self._descriptor()
        return [MeasuredImage(exemplar, distance) for exemplar in self.exemplars]
