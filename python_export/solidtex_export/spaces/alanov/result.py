"""Reads a result folder of an Alanov preset, and makes a model of one of its codes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn
from torch.optim.swa_utils import AveragedModel

from solidtex_export.export.file_format.model_file import VERSION, ModelFile
from solidtex_export.export.verification.networks import Network
from solidtex_export.images.channels import COLOR
from solidtex_export.settings import validated
from solidtex_export.spaces.alanov.export import (
    SCHEME,
    Wave,
    fold_generator,
    generator_network,
    random_phases,
    waves_of,
)
from solidtex_export.spaces.alanov.networks import (
    MEASURED_BATCHES,
    Encoder,
    Generator,
    networks_of,
)
from solidtex_export.spaces.alanov.settings import AlanovRecipe
from solidtex_export.spaces.result import read_training
from solidtex_export.training.result import ResultError

PHASES = ["phase.0", "phase.1"]  # probabilities of the lower and the higher label of a volume
LARGEST_BATCH = 8  # of codes of either kind
LEAST_PATCH, MOST_PIXELS = 16, 1 << 14  # of a texture space: docs/space-format.md


@dataclass
class AlanovResult:
    """A training; `codes` [material, code] are those of `photographs`, means of their crops'."""

    folder: Path
    recipe: AlanovRecipe
    generator: Generator
    encoder: Encoder
    codes: Tensor
    crop_codes: Tensor
    photographs: list[dict[str, str]]
    resolution: int
    training: dict[str, Any]

    def measure(self) -> None:
        """Measure batch normalization as in training: half of the codes are the prior's."""
        torch.manual_seed(0)
        count = min(self.recipe.crops.batch, LARGEST_BATCH)
        batches = []
        for _ in range(MEASURED_BATCHES):
            prior = torch.randn(count, self.recipe.code)
            chosen = self.crop_codes[torch.randint(len(self.crop_codes), (count,))]
            batches.append(torch.cat([prior, chosen]))
        self.generator.measure(torch.stack(batches), self.recipe.crops.size)

    def index_of(self, material: str | None) -> int:
        """Index of the material of that name; None is the only one."""
        names = [record["name"] for record in self.photographs]
        if material is None and len(names) == 1:
            return 0
        if material not in names:
            raise ResultError(
                f"--material: found {material or 'nothing'}, expected one of {', '.join(names)}"
            )
        return names.index(material)

    def verifiable_model(
        self, name: str, license: str, code: Tensor, phases: int
    ) -> tuple[ModelFile, Network]:
        """The model of a code, and the network that it must equal.

        phases: Random seed of the phases of periodic patterns.
        """
        self.measure()
        drawn = random_phases(self.recipe.noise.periodic, phases)
        waves = waves_of(self.generator, code, drawn)
        network = generator_network(self.generator, code, waves)
        return self.model(name, license, code, waves), network

    def model(self, name: str, license: str, code: Tensor, waves: Sequence[Wave]) -> ModelFile:
        """The generator with one code as a lattice model."""
        architecture, tensors = fold_generator(self.generator, code, waves)
        is_color = self.recipe.dimensions == 2
        document = {
            "version": VERSION,
            "name": name,
            "family": "field",
            "channels": list(COLOR) if is_color else PHASES,
            "color_space": "srgb" if is_color else "data",
            "noise": {"scheme": SCHEME},
            "field": architecture,
            "training": self.training | {"code": code.tolist(), "photographs": self.photographs},
            **({"license": license} if license else {}),
        }
        return ModelFile(document, tensors)

    def encoder_space(self, name: str, license: str) -> tuple[dict[str, Any], dict[str, Any]]:
        """Document and tensors of a texture space that is the encoder alone, to find textures."""
        from solidtex_export.spaces.encoder_onnx import alanov_encoder_onnx  # of the extra onnx

        if self.recipe.dimensions == 3:
            raise ResultError(
                f"{self.folder}: found a training on volumes, expected one on photographs for a"
                " texture space; --material NAME -o NAME.solidtex writes a model"
            )
        side = self.recipe.crops.size
        if side < LEAST_PATCH or self.resolution > MOST_PIXELS:
            raise ResultError(
                f"{self.folder}: found crops of {side} pixels and photographs of {self.resolution},"
                f" expected at least {LEAST_PATCH} and at most {MOST_PIXELS} for a texture space;"
                " train with another crops.size or --resolution"
            )
        document = {
            "version": 1,
            "name": name,
            "family": "none",
            "channels": list(COLOR),
            "color_space": "srgb",
            "colors": "network",
            "patch": side,
            "resolution": self.resolution,
            "code": self.recipe.code,
            "directions": "xyz",
            "photographs": self.photographs,
            **({"license": license} if license else {}),
            "training": self.training,
        }
        onnx = alanov_encoder_onnx(self.encoder, side, self.recipe.code)
        codes = self.codes.float().numpy()
        return document, {"codes": codes, "encoder": np.frombuffer(onnx, np.uint8)}


def read_alanov(folder: Path) -> AlanovResult:
    """Read config.json and checkpoint.pt without executing anything in them."""
    config, state, training = read_training(folder, "alanov")
    recipe = validated(AlanovRecipe, config["recipe"], str(folder / "config.json"))
    generator, encoder = Generator(recipe), Encoder(recipe)
    try:
        if state.get("averages"):
            model = AveragedModel(nn.ModuleDict({"generator": generator, "encoder": encoder}))
            model.load_state_dict(state["averages"])
            generator, encoder = networks_of(model.module)
        else:
            generator.load_state_dict(state["generator"])
            encoder.load_state_dict(state["encoder"])
        codes, photographs = state["material_codes"], config["photographs"]
        resolution = config["resolution"]
        crop_codes = state.get("crop_codes", codes)  # older trainings have none
        shapes = tuple(codes.shape), tuple(crop_codes.shape[1:])
        if shapes != ((len(photographs), recipe.code), (recipe.code,)):
            raise ValueError(f"found codes of shape {shapes[0]}, of crops [n, *{shapes[1]}]")
    except (AttributeError, KeyError, TypeError, ValueError, RuntimeError) as error:
        raise ResultError(
            f"{folder / 'checkpoint.pt'}: does not fit config.json ({error})"
        ) from error
    generator.eval()
    encoder.eval()
    return AlanovResult(
        folder, recipe, generator, encoder, codes, crop_codes, photographs, resolution, training
    )
