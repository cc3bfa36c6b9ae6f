"""File of a learned start, `NAME.solidtex-start`: weights of an ordinary generator."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import torch
from pydantic import Field
from safetensors import SafetensorError, safe_open
from safetensors.torch import save
from torch import Tensor

from solidtex_export.generators.build import build_generator
from solidtex_export.generators.settings import family_of
from solidtex_export.settings import Array, Settings, SettingsError, validated, within
from solidtex_export.spaces.space_reader import SpaceError
from solidtex_export.training.recipe import GeneratorSettings
from solidtex_export.whole_file import write_whole

METADATA_KEY = "solidtex-start"
SUFFIX = ".solidtex-start"
PROGRAMS = "a file of solidtex-export-space or a start of solidtex-train-space"
COLORS = ("color_mean", "color_basis")


class StartDocument(Settings):
    """Document of the file. Colors are the photograph's own axes (spaces/colors.py)."""

    version: Literal[1] = 1
    name: str
    generator: dict[str, Any]
    """Kind and sizes."""
    directions: Literal["xyz", "xy"]
    resolution: Annotated[int, within(8, 65536)]
    photographs: Annotated[Array[dict[str, str]], Field(min_length=1)]
    license: str
    training: dict[str, Any]


@dataclass(frozen=True)
class LearnedStart:
    path: Path
    sha256: str
    document: StartDocument
    state: Mapping[str, Tensor]


def write_start(path: Path, start: LearnedStart) -> None:
    document = start.document.model_dump_json()
    tensors = {k: v.contiguous() for k, v in start.state.items() if k not in COLORS}
    write_whole(path, save(tensors, {METADATA_KEY: document}))


def read_start_file(path: Path) -> LearnedStart:
    if not path.is_file():
        raise SpaceError(f"{path}: found no such file, expected {PROGRAMS}")
    try:
        with safe_open(path, "pt") as file:
            metadata = file.metadata() or {}
            state = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118
        values = json.loads(metadata[METADATA_KEY])
    except (KeyError, SafetensorError, TypeError, ValueError) as error:
        raise SpaceError(f"{path}: found no whole start ({error}), expected {PROGRAMS}") from error
    try:
        document = validated(StartDocument, values, str(path))
    except SettingsError as error:
        raise SpaceError(str(error)) from error
    check_state(path, document, state)
    return LearnedStart(path, hashlib.sha256(path.read_bytes()).hexdigest(), document, state)


def check_state(path: Path, document: StartDocument, state: Mapping[str, Tensor]) -> None:
    """Refuse tensors that are not those of the generator, or not finite."""
    settings = {k: v for k, v in document.generator.items() if k != "kind"}
    named = {"kind": document.generator.get("kind"), "sizes": settings}
    kind = validated(GeneratorSettings, named, f"{path}: generator").kind
    try:
        with torch.device("meta"):
            expected = build_generator(family_of(kind), document.generator).state_dict()
    except (TypeError, ValueError) as error:
        raise SpaceError(f"{path}: generator: {error}") from error
    for name in sorted(expected.keys() | state.keys()):
        if name in COLORS:
            continue
        if name not in state or name not in expected:
            found, wanted = ("nothing", "one") if name in expected else ("one", "none")
            raise SpaceError(f"{path}: tensor {name}: found {found}, expected {wanted}")
        value, like = state[name], expected[name]
        if value.shape != like.shape or value.dtype != like.dtype or not value.isfinite().all():
            raise SpaceError(
                f"{path}: tensor {name}: found {value.dtype} {list(value.shape)}, expected finite"
                f" {like.dtype} {list(like.shape)}"
            )
