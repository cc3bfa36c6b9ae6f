"""Opens a texture space or a learned start: a file, a shipped name, or the result of a training."""

from __future__ import annotations

import hashlib
import importlib.util
import json
import os
from pathlib import Path

import torch
from torch import Tensor

from solidtex_export.bare_name import is_bare_name
from solidtex_export.settings import validated
from solidtex_export.spaces.result import read_space, read_start
from solidtex_export.spaces.space_file import SUFFIX
from solidtex_export.spaces.space_reader import (
    PROGRAMS,
    OpenSpace,
    SpaceDocument,
    SpaceError,
    read_space_file,
)
from solidtex_export.spaces.start_file import LearnedStart, read_start_file


def open_space(path: Path) -> OpenSpace:
    """Open a space file, a shipped space by its bare name, or a result of solidtex-train-space.

    A folder that is no result, such as photographs in `stones`, hides no shipped space.
    """
    if path.is_dir() and ((path / "config.json").exists() or not is_bare_name(path)):
        return _open_result(path)
    return read_space_file(_shipped(path.name) if is_bare_name(path) else path)


def open_start(path: Path) -> LearnedStart:
    """Open a file, or a result folder of solidtex-train-space with a start preset."""
    return read_start(path, path.name, "") if path.is_dir() else read_start_file(path)


def _shipped(name: str) -> Path:
    """Path of a shipped space, searched where libsolidtex searches models."""
    folders = [Path(f) for f in os.environ.get("SOLIDTEX_MODEL_PATH", "").split(":") if f]
    folders += [Path(__file__).parents[3] / "models"]
    if (module := importlib.util.find_spec("solidtex")) and module.origin:
        folders += [Path(module.origin).parent / "share" / "solidtex" / "models"]
    for folder in folders:
        if (file := folder / f"{name}{SUFFIX}").is_file():
            return file
    searched = ", ".join(map(str, folders))
    there = sorted({file.stem for folder in folders for file in folder.glob(f"*{SUFFIX}")})
    raise SpaceError(
        f"--space: found no space named {name} in {searched}, expected"
        f" {', '.join([*there, PROGRAMS])} (a path needs a slash or the ending {SUFFIX})"
    )


def _open_result(folder: Path) -> OpenSpace:
    space = read_space(folder, folder.name, "")
    encoder = space.encoder

    @torch.no_grad()
    def encode(patches: Tensor) -> Tensor:
        return encoder.code(encoder.summary(patches))

    checkpoint = (folder / "checkpoint.pt").read_bytes()
    document = json.loads(json.dumps(space.document()))
    return OpenSpace(
        folder,
        hashlib.sha256(checkpoint).hexdigest(),
        validated(SpaceDocument, document, str(folder)),
        space.network(),
        encode,
        space.critic,
    )
