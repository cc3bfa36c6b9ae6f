"""Configuration of a training: all inputs of its result, saved as `config.json`."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import computed_field

from solidtex_export.generators.settings import Family
from solidtex_export.images.exemplar import Exemplar
from solidtex_export.settings import Array, Settings
from solidtex_export.training.recipe import FineTuning, Recipe
from solidtex_export.training.start import SpaceRecord


class FileRecord(Settings):
    """File that the training read; the hash distinguishes files of the same name."""

    file: str
    sha256: str
    maps: dict[str, dict[str, str]] | None = None
    """Maps of a photograph, by name."""
    reading: dict[str, Any] | None = None
    """Requested conversion of a photograph's values, if any."""


class Config(Settings):
    """A fully resolved training; `minutes` or `steps` limits it."""

    version: Literal[4] = 4
    """Version of the layout and of trained bits. Version 1, without this key, had an array of
    losses and unresolved keys. Version 2 had other bits. Version 3 had other bits, an initial
    phase and settings of initial weights.
    """
    preset: str
    reasons: Array[str]
    """Reasons for the measured choices of preset and symmetry."""
    family: Family
    size: int
    resolution: int
    crop: Array[int] | None = None
    directions: str
    seed: int
    minutes: float | None = None
    clock: Literal["wall", "processor"] = "wall"
    """What `minutes` are: time that passes, or processor time of all threads."""
    steps: int | None = None
    exemplars: Array[FileRecord]
    channels: Array[str]
    color_space: str
    license: str
    source: str
    generator: dict[str, Any]
    """Kind and constructor arguments of the generator."""
    recipe: Recipe
    features: FileRecord | None = None
    """Weights of VGG-19 or SqueezeNet, if used."""
    descriptor: FileRecord | None = None
    """Weights of the learned descriptor, if used."""
    space: SpaceRecord | None = None
    """Texture space, or learned start, that the training starts from."""
    fine_tuned: FineTuning | None = None
    """Trained part of the space's weights; such a model cannot be mixed."""

    @computed_field  # type: ignore[prop-decorator]
    @property
    def symmetry(self) -> str:
        return self.recipe.slicing.symmetry

    def document(self) -> dict[str, Any]:
        return self.model_dump(mode="json", exclude_none=True)

    def exemplar_index(self, direction: str) -> int:
        """Index of the exemplar of a direction."""
        return 0 if len(self.exemplars) == 1 else self.directions.index(direction)


def exemplar_records(exemplars: list[Exemplar]) -> tuple[FileRecord, ...]:
    """File names and hashes of the photographs and their maps."""
    return tuple(FileRecord(**e.record()) for e in exemplars)
