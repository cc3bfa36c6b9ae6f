"""Reads a result folder of solidtex-train-space."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import torch

from solidtex_export.losses.descriptor.weights import SHIPPED, load_weights
from solidtex_export.settings import validated
from solidtex_export.spaces.encoder import make_encoder
from solidtex_export.spaces.settings import SpaceRecipe
from solidtex_export.spaces.space_file import Photograph, Space
from solidtex_export.spaces.trainer import PATCH, make_generator
from solidtex_export.training.result import ResultError


def read_space(folder: Path, name: str, license: str) -> Space:
    """Read config.json and checkpoint.pt without executing anything in them."""
    config = _config(folder / "config.json")
    path = folder / "checkpoint.pt"
    try:
        state = torch.load(path, map_location="cpu", weights_only=True)
    except Exception as error:  # torch raises many kinds for a damaged or unsafe file
        reason = str(error).splitlines()[0]
        raise ResultError(f"{path}: found no checkpoint that loads safely ({reason})") from error
    recipe = validated(SpaceRecipe, config["recipe"], str(folder / "config.json"))
    generator = make_generator(recipe)
    trained = load_weights(SHIPPED) if recipe.uses_descriptor else None
    encoder = make_encoder(recipe.encoder, recipe.code, trained)
    try:
        generator.load_state_dict(state["generator"])
        encoder.load_state_dict(state["encoder"])
        pairs = zip(config["photographs"], state["codes"], state["colors"], strict=True)
        photographs = [Photograph(record, code, colors) for record, code, colors in pairs]
    except (KeyError, TypeError, ValueError, RuntimeError) as error:
        raise ResultError(f"{path}: does not fit config.json ({error})") from error
    training = {k: config[k] for k in ("preset", "recipe", "seed")}
    training |= {"step": state["step"], "seconds": round(state["seconds"])}
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
    )


def _config(path: Path) -> dict[str, Any]:
    try:
        config = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise ResultError(
            f"{path}: found no readable JSON ({error}), expected a result of solidtex-train-space"
        ) from error
    if not isinstance(config, dict) or config.get("kind") != "space":
        raise ResultError(f"{path}: kind: expected a result of solidtex-train-space")
    return config
