"""Plan of a comparison: a TOML file that lists exemplars and presets."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Annotated, Any

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

SKIMAGE = "skimage:"
NAME = "[a-z0-9][a-z0-9-]*"


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


class Plan(Settings):
    """All pairs of `exemplar` and `methods`, each trained for `minutes`; `note` heads the table."""

    minutes: float
    methods: Array[Name]
    exemplars: Array[Entry] = Field(alias="exemplar")
    note: str = ""

    @field_validator("minutes")
    @classmethod
    def _some_time(cls, minutes: float) -> float:
        if minutes <= 0:
            raise expected("more than 0")
        return minutes

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
        if len(set(names)) < len(names) or not names:
            raise wrong("name", names, "different ones")
        return entries

    @field_validator("note")
    @classmethod
    def _without_margins(cls, note: str) -> str:
        return note.strip()


def read_plan(path: Path) -> Plan:
    try:
        document: dict[str, Any] = read_toml(path)
        return validated(Plan, document, str(path))
    except SettingsError as error:
        raise PlanError(str(error)) from error


def photograph(entry: Entry, folder: Path) -> Path:
    """The file of an exemplar that is a photograph."""
    assert entry.photo is not None
    if entry.photo.startswith(SKIMAGE):
        from skimage.data import data_dir

        return Path(data_dir) / f"{entry.photo.removeprefix(SKIMAGE)}.png"
    return folder / entry.photo
