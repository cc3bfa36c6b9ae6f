"""What a training is: everything that decides its result, saved as `config.json`."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import computed_field

from solidtex_export.images.exemplar import Exemplar
from solidtex_export.settings import Array, Settings
from solidtex_export.training.recipe import Recipe


class FileRecord(Settings):
    """A file that the training read, so that another of the same name is not taken for it."""

    file: str
    sha256: str
    maps: dict[str, dict[str, str]] | None = None
    """Of a photograph, by name."""
    reading: dict[str, Any] | None = None
    """How the values of a photograph were read, where that was asked for."""


class Config(Settings):
    """A training; `minutes` or `steps` decides when it ends. Nothing in it is left to decide."""

    version: Literal[2] = 2
    """1, which had no such key, had losses in an array and keys that the photographs decided."""
    preset: str
    reasons: Array[str]
    """Why this preset and this symmetry, where they were measured."""
    family: Literal["field", "sampler"]
    size: int
    resolution: int
    crop: Array[int] | None = None
    directions: str
    seed: int
    minutes: float | None = None
    steps: int | None = None
    exemplars: Array[FileRecord]
    channels: Array[str]
    color_space: str
    license: str
    source: str
    generator: dict[str, Any]
    """Constructor arguments of the generator, and its kind."""
    recipe: Recipe
    vgg: FileRecord | None = None
    """The weights of VGG-19, where they are used."""
    descriptor: FileRecord | None = None
    """The weights of the learned descriptor, where they are used."""

    @computed_field  # type: ignore[prop-decorator]
    @property
    def symmetry(self) -> str:
        return self.recipe.slicing.symmetry

    def document(self) -> dict[str, Any]:
        return self.model_dump(mode="json", exclude_none=True)

    def exemplar_index(self, direction: str) -> int:
        """Which exemplar a direction is compared with."""
        return 0 if len(self.exemplars) == 1 else self.directions.index(direction)


def exemplar_records(exemplars: list[Exemplar]) -> tuple[FileRecord, ...]:
    """File names and hashes of the photographs, and of their maps where they have any."""
    return tuple(FileRecord(**e.record()) for e in exemplars)
