"""What is to be compared: a TOML file that lists exemplars and methods."""

from __future__ import annotations

import re
import tomllib
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

from solidtex_export.export.verification.model_output import OutputError
from solidtex_export.research.solids.materials import SOLIDS

SKIMAGE = "skimage:"
NAME = "[a-z0-9][a-z0-9-]*"


class PlanError(OutputError):
    """What is wrong with a plan: the file, the field, found, expected."""


@dataclass(frozen=True)
class Entry:
    """An exemplar: a photograph or a cut through an analytic solid, and how it is trained on.

    `photo` is a file, looked for beside the plan unless another folder is given, or skimage:NAME, a
    picture that comes with scikit-image; `solid` the name of an analytic solid. The others are
    options of solidtex-train, None for its defaults; `pixels` is the side of a solid's exemplar.
    """

    name: str
    photo: str | None = None
    solid: str | None = None
    pixels: int = 256
    size: int | None = None
    resolution: int | None = None
    crop: list[int] | None = None
    directions: str | None = None
    symmetry: str | None = None


@dataclass(frozen=True)
class Plan:
    """All pairs of `exemplar` and `methods`, each trained for `minutes`; `note` heads the table."""

    minutes: float
    methods: tuple[str, ...]
    exemplars: tuple[Entry, ...]
    note: str = ""


def read_plan(path: Path) -> Plan:
    try:
        document = tomllib.loads(path.read_text())
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise PlanError(f"{path}: found no readable TOML ({error}), expected a plan") from error
    note = document.pop("note", "")
    if not isinstance(note, str):
        raise PlanError(f"{path}: note: found {note}, expected text")
    _check_keys(path, "the plan", document, {"minutes", "methods", "exemplar"})
    minutes, methods = document["minutes"], document["methods"]
    if type(minutes) not in (int, float) or not minutes > 0:
        raise PlanError(f"{path}: minutes: found {minutes}, expected more than 0")
    if not methods or not all(re.fullmatch(NAME, str(m)) for m in methods):
        raise PlanError(f"{path}: methods: found {methods}, expected names")
    entries = tuple(_entry(path, i, value) for i, value in enumerate(document["exemplar"]))
    names = [entry.name for entry in entries]
    if len(set(names)) < len(names) or not names:
        raise PlanError(f"{path}: exemplar: found the names {names}, expected different ones")
    return Plan(float(minutes), tuple(methods), entries, note.strip())


def _entry(path: Path, index: int, values: dict[str, Any]) -> Entry:
    where = f"exemplar[{index}]"
    known = {field.name for field in fields(Entry)}
    unknown = set(values) - known
    if unknown:
        raise PlanError(
            f"{path}: {where}: found {', '.join(sorted(unknown))}, expected only"
            f" {', '.join(sorted(known))}"
        )
    entry = Entry(**{"name": "", **values})
    if not re.fullmatch(NAME, entry.name):
        raise PlanError(f"{path}: {where}.name: found {entry.name!r}, expected small letters")
    if (entry.photo is None) == (entry.solid is None):
        raise PlanError(f"{path}: {where}: expected one of photo and solid")
    if entry.solid is not None and entry.solid not in SOLIDS:
        raise PlanError(
            f"{path}: {where}.solid: found {entry.solid}, expected one of {', '.join(SOLIDS)}"
        )
    return entry


def _check_keys(path: Path, where: str, values: dict[str, Any], expected: set[str]) -> None:
    if set(values) != expected:
        raise PlanError(
            f"{path}: {where}: found {', '.join(sorted(values)) or 'nothing'}, expected"
            f" {', '.join(sorted(expected))}"
        )


def photograph(entry: Entry, folder: Path) -> Path:
    """The file of an exemplar that is a photograph."""
    assert entry.photo is not None
    if entry.photo.startswith(SKIMAGE):
        from skimage.data import data_dir

        return Path(data_dir) / f"{entry.photo.removeprefix(SKIMAGE)}.png"
    return folder / entry.photo
