"""Plan of a comparison: a TOML file that lists exemplars and presets."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import AfterValidator, Field, field_validator, model_validator

from solidtex_export.research.solids.materials import SOLIDS
from solidtex_export.settings import (
    Array,
    Settings,
    SettingsError,
    expected,
    read_toml,
    validated,
    wrong,
)
from solidtex_export.spaces.photographs import find_sources

SKIMAGE = "skimage:"
NAME = "[a-z0-9][a-z0-9-]*"
CHOSEN = "default"  # leaves the preset to solidtex-train
DIRECTIONS = {"vertical-grain": "xy", "layered": "xy"}
"""Training directions of a list's hints; others are trained in all directions."""


def _named(name: str) -> str:
    if not re.fullmatch(NAME, name):
        raise expected("small letters, digits and -")
    return name


Name = Annotated[str, AfterValidator(_named)]


class PlanError(SettingsError):
    """An invalid plan: the file, the field, found, expected."""


class Entry(Settings):
    """An exemplar: a photograph or a cut through an analytic solid, with training options.

    `photo` is a file, looked for beside the plan unless another folder is given, or skimage:NAME,
    an image of scikit-image; `solid` is the name of an analytic solid. The others are options of
    solidtex-train, None for its defaults; `pixels` is the side of a solid's exemplar.
    """

    name: Name
    photo: str | None = None
    solid: str | None = None
    pixels: int = 256
    size: int | None = None
    resolution: int | None = None
    crop: Array[int] | None = None
    directions: str | None = None
    symmetry: str | None = None

    @model_validator(mode="after")
    def _one_source(self) -> Entry:
        if (self.photo is None) == (self.solid is None):
            raise wrong("photo", self.photo, "one of photo and solid")
        if self.solid is not None and self.solid not in SOLIDS:
            raise wrong("solid", self.solid, f"one of {', '.join(SOLIDS)}")
        return self


class Photographs(Settings):
    """Exemplars from a folder: all images of `folder`, or the rows of a CSV file of one `split`.

    Both are inside the folder of the photographs. The CSV has the columns file and licence, and
    optionally split and direction (isotropic, vertical-grain, layered). `count` takes so many of
    them, evenly spread over the list. The others are options of solidtex-train.
    """

    folder: str = "."
    list: str | None = None
    split: str = "validation"
    count: int | None = None
    size: int | None = None
    resolution: int | None = None


class Method(Settings):
    """Settings of a method whose name is not that of a preset."""

    preset: str = CHOSEN
    set: Array[str] = ()
    """Overrides as for solidtex-train --set."""
    options: Array[str] = ()
    """Further options of solidtex-train."""


class Plan(Settings):
    """All pairs of exemplars and `methods`; `title` and `note` head the page.

    Each is trained for `minutes` on a clock, for `processor_minutes` of processor time, or for
    `steps`.
    """

    title: str = "Fidelity of the presets"
    minutes: float | None = None
    processor_minutes: float | None = None
    steps: int | None = None
    methods: Array[Name]
    named_methods: dict[str, Method] = Field(alias="method", default={})
    exemplars: Array[Entry] = Field(alias="exemplar", default=())
    photographs: Photographs | None = None
    note: str = ""

    @field_validator("minutes", "processor_minutes", "steps")
    @classmethod
    def _some_time(cls, amount: float | None) -> float | None:
        if amount is not None and amount <= 0:
            raise expected("more than 0")
        return amount

    @model_validator(mode="after")
    def _one_budget(self) -> Plan:
        given = {name: amount for name, amount in self.budgets.items() if amount is not None}
        if len(given) != 1:
            raise wrong("minutes", given or None, "one of minutes, processor_minutes and steps")
        if not self.exemplars and self.photographs is None:
            raise wrong("exemplar", [], "exemplars or photographs")
        return self

    @property
    def budgets(self) -> dict[str, float | None]:
        """The three keys, one of which is given."""
        return self.model_dump(include={"minutes", "processor_minutes", "steps"})

    @property
    def budget(self) -> str:
        """What each training gets, in words."""
        if self.steps is not None:
            return f"{self.steps} steps"
        minutes = self.processor_minutes if self.minutes is None else self.minutes
        text = f"{minutes:g} minute" + ("" if minutes == 1 else "s")
        return text if self.minutes is not None else f"{text} of processor time"

    def method(self, name: str) -> Method:
        return self.named_methods.get(name) or Method(preset=name)

    @field_validator("methods")
    @classmethod
    def _some_methods(cls, methods: tuple[str, ...]) -> tuple[str, ...]:
        if not methods:
            raise expected("names of presets")
        return methods

    @field_validator("exemplars")
    @classmethod
    def _different_names(cls, entries: tuple[Entry, ...]) -> tuple[Entry, ...]:
        names = [entry.name for entry in entries]
        if len(set(names)) < len(names):
            raise wrong("name", names, "different ones")
        return entries

    @field_validator("note")
    @classmethod
    def _without_margins(cls, note: str) -> str:
        return note.strip()


def read_plan(path: Path, folder: Path | None = None) -> Plan:
    """Read a plan; its photographs are in `folder`, or else beside it."""
    try:
        document: dict[str, Any] = read_toml(path)
        plan = validated(Plan, document, str(path))
    except SettingsError as error:
        raise PlanError(str(error)) from error
    if plan.photographs is None:
        return plan
    listed = entries_of(plan.photographs, folder or path.parent)
    return plan.model_copy(update={"exemplars": (*plan.exemplars, *listed)})


def entries_of(photographs: Photographs, folder: Path) -> list[Entry]:
    files = folder / photographs.folder
    source = files if photographs.list is None else folder / photographs.list
    if not source.exists():
        raise PlanError(f"{source}: found no such file, expected photographs (--photos FOLDER)")
    sources = find_sources([source], files, photographs.split)
    if photographs.count is not None:
        steps = np.linspace(0, len(sources) - 1, min(photographs.count, len(sources)))
        sources = [sources[round(i)] for i in steps]
    return [
        Entry(
            name=re.sub("[^a-z0-9]+", "-", source.path.stem.lower()).strip("-"),
            photo=str(source.path.relative_to(folder)),
            size=photographs.size,
            resolution=photographs.resolution,
            directions=DIRECTIONS.get(source.direction),
        )
        for source in sources
    ]


def photograph(entry: Entry, folder: Path) -> Path:
    """The file of an exemplar that is a photograph."""
    assert entry.photo is not None
    if entry.photo.startswith(SKIMAGE):
        import skimage.data

        name = entry.photo.removeprefix(SKIMAGE)
        return Path(skimage.data.__file__).with_name(f"{name}.png")
    return folder / entry.photo
