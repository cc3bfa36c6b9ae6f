"""Reads a result folder of solidtex-train-space."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Any

from solidtex_export.export.training_result import read_checkpoint
from solidtex_export.settings import validated
from solidtex_export.spaces.encoder import make_encoder
from solidtex_export.spaces.settings import SpaceRecipe, StartRecipe
from solidtex_export.spaces.space_file import Photograph, Space
from solidtex_export.spaces.start_file import COLORS, LearnedStart, StartDocument, check_state
from solidtex_export.spaces.trainer import PATCH, make_generator
from solidtex_export.training.result import ResultError


def read_space(folder: Path, name: str, license: str) -> Space:
    """Read config.json and checkpoint.pt without executing anything in them."""
    config, state, training = read_training(folder, "space")
    path = folder / "checkpoint.pt"
    recipe = validated(SpaceRecipe, config["recipe"], str(folder / "config.json"))
    generator = make_generator(recipe)
    encoder = make_encoder(recipe.encoder, recipe.code)
    try:
        generator.load_state_dict(state["generator"])
        encoder.load_state_dict(state["encoder"])
        pairs = zip(config["photographs"], state["codes"], state["colors"], strict=True)
        photographs = [Photograph(record, code, colors) for record, code, colors in pairs]
    except (KeyError, TypeError, ValueError, RuntimeError) as error:
        raise ResultError(f"{path}: does not fit config.json ({error})") from error
    return Space(
        name,
        recipe,
        config["resolution"],
        PATCH,
        generator,
        encoder,
        photographs,
        license,
        training,
        state["critic"]["model"] if state["critic"] else None,
    )


def read_start(folder: Path, name: str, license: str) -> LearnedStart:
    """Read the result of a start preset."""
    config, state, training = read_training(folder, "start")
    path = folder / "checkpoint.pt"
    recipe = validated(StartRecipe, config["recipe"], str(folder / "config.json"))
    document = StartDocument(
        name=name,
        generator={"kind": recipe.generator.kind, **recipe.generator.sizes},
        directions=recipe.directions,
        resolution=config["resolution"],
        photographs=tuple(config["photographs"]),
        license=license,
        training=training,
    )
    tensors = {k: v for k, v in state["generator"].items() if k not in COLORS}
    check_state(path, document, tensors)
    digest = hashlib.sha256(path.read_bytes()).hexdigest()
    return LearnedStart(folder, digest, document, tensors)


def read_training(folder: Path, kind: str) -> tuple[dict[str, Any], dict[str, Any], dict[str, Any]]:
    """The configuration, the checkpoint, and the record of the training for the file."""
    path = folder / "config.json"
    config = read_config(path)
    if config["kind"] != kind:
        raise ResultError(f"{path}: kind: found {json.dumps(config['kind'])}, expected a {kind}")
    state = read_checkpoint(folder / "checkpoint.pt", ResultError)
    training = {k: config[k] for k in ("preset", "recipe", "seed")}
    training |= {"step": state["step"], "seconds": round(state["seconds"])}
    return config, state, training


def read_config(path: Path) -> dict[str, Any]:
    try:
        config = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise ResultError(
            f"{path}: found no readable JSON ({error}), expected a result of solidtex-train-space"
        ) from error
    if not isinstance(config, dict) or config.get("kind") not in ("space", "start", "alanov"):
        raise ResultError(f"{path}: kind: expected a result of solidtex-train-space")
    return config
