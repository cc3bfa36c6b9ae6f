"""Reads a result folder of solidtex-train: configuration and network."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import torch

from solidtex_export.export.file_format.checks import Fields, ModelFileError, parse_json
from solidtex_export.export.lattice_state import StateError, check_lattice_state
from solidtex_export.generators.build import KIND_OF_FAMILY, Generator, build_generator
from solidtex_export.generators.lattice import BaseLattice
from solidtex_export.images.channels import COLOR, MAX_CHANNELS
from solidtex_export.state_file import reason


@dataclass
class TrainingResult:
    """A finished or interrupted training."""

    family: str
    config: dict[str, Any]
    progress: dict[str, float]
    generator: Generator
    finished: bool = True

    @property
    def has_phases(self) -> bool:
        return isinstance(self.generator, BaseLattice) and self.generator.softmax

    @property
    def channels(self) -> list[str]:
        return list(self.config.get("channels", COLOR))

    @property
    def color_space(self) -> str:
        return self.config.get("color_space", "srgb")


def read_result(folder: Path) -> TrainingResult:
    """Read config.json and checkpoint.pt without executing anything in them."""
    config_path, checkpoint_path = folder / "config.json", folder / "checkpoint.pt"
    for path in (config_path, checkpoint_path):
        if not path.is_file():
            raise StateError(f"{path}: found no such file, expected a result of solidtex-train")
    config = _read_config(config_path)
    checkpoint = read_checkpoint(checkpoint_path)
    try:
        generator = _generator(config, checkpoint["generator"])
    except StateError as error:
        raise StateError(f"{checkpoint_path}: {error}") from error
    progress: dict[str, float] = {k: checkpoint[k] for k in ("step", "seconds") if k in checkpoint}
    finished = bool(checkpoint.get("finished", True))
    return TrainingResult(config["family"], config, progress, generator, finished)


def _read_config(path: Path) -> dict[str, Any]:
    try:
        config = parse_json(str(path), "file", path.read_text())
    except UnicodeDecodeError as error:
        raise ModelFileError(f"{path}: found invalid UTF-8 ({error})") from error
    fields = Fields(str(path), "", config)
    fields.choice("family", tuple(KIND_OF_FAMILY))
    fields.child("generator")
    exemplars = fields.array("exemplars", 1, 3)
    for index, value in enumerate(exemplars):
        exemplar = Fields(str(path), f"exemplars[{index}]", value)
        exemplar.string("file")
        exemplar.string("sha256")
    if "channels" in fields:
        fields.array("channels", 1, MAX_CHANNELS)
        fields.choice("color_space", ("srgb", "linear", "data"))
    return config


def read_checkpoint(path: Path, error: type[ValueError] = StateError) -> dict[str, Any]:
    """Read a checkpoint with a generator; raises `error` for any other file."""
    try:
        checkpoint = torch.load(path, map_location="cpu", weights_only=True)
    except Exception as cause:  # torch raises many kinds for a damaged or unsafe file
        raise error(f"{path}: found no checkpoint that loads safely ({reason(cause)})") from cause
    if not isinstance(checkpoint, dict) or not isinstance(checkpoint.get("generator"), dict):
        raise error(f"{path}: generator: found no state dict, expected one")
    return checkpoint


def _generator(config: dict[str, Any], state: dict[str, Any]) -> Generator:
    family, sizes = config["family"], config["generator"]
    if sizes.get("kind", KIND_OF_FAMILY[family]) == "lattice":
        check_lattice_state(state)
    try:
        generator = build_generator(family, sizes)
        generator.load_state_dict(state)
    except (TypeError, ValueError, RuntimeError) as error:
        raise StateError(f"generator: does not fit config.json: {error}") from error
    return generator.eval()
