"""Writes a texture space as one file, `NAME.solidtex-space` (docs/space-format.md)."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from safetensors.numpy import save
from torch import Tensor

from solidtex_export.images.channels import COLOR
from solidtex_export.spaces.encoder import ConvolutionEncoder, DescriptorEncoder
from solidtex_export.spaces.generators import ConditionedLattice, ConditionedSampler
from solidtex_export.spaces.photographs import NETWORK_MEAN, NETWORK_SCALE
from solidtex_export.spaces.settings import SpaceRecipe
from solidtex_export.whole_file import write_whole

METADATA_KEY = "solidtex-space"
SUFFIX = ".solidtex-space"


@dataclass(frozen=True)
class Photograph:
    """A training photograph: its record, its code, and its colors [3, 4] (basis and mean)."""

    record: dict[str, str]
    code: Tensor
    colors: Tensor


@dataclass(frozen=True)
class Space:
    """A trained space."""

    name: str
    recipe: SpaceRecipe
    resolution: int
    patch: int
    generator: ConditionedLattice | ConditionedSampler
    encoder: DescriptorEncoder | ConvolutionEncoder
    photographs: Sequence[Photograph]
    license: str
    training: dict[str, Any]
    critic: Mapping[str, Tensor] | None = None
    """Weights of the critic; they are not part of the file."""

    def document(self) -> dict[str, Any]:
        recipe = self.recipe
        return {
            "version": 1,
            "name": self.name,
            "family": recipe.family,
            "channels": list(COLOR),
            "color_space": "srgb",
            "colors": recipe.colors,
            "patch": self.patch,
            "resolution": self.resolution,
            "code": recipe.code,
            "directions": recipe.directions,
            "noise": {"scheme": "solidtex-1"},
            recipe.family: self.generator.document(),
            "style": {"width": recipe.style_width, "slope": 0.2},
            "photographs": [p.record for p in self.photographs],
            **({"license": self.license} if self.license else {}),
            "training": self.training,
        }

    def tensors(self) -> dict[str, np.ndarray]:
        """Tensors of the file: those of the network, and the encoder's ONNX file."""
        from solidtex_export.spaces.encoder_onnx import encoder_onnx  # of the extra onnx

        encoder = encoder_onnx(self.encoder, self.patch, self.recipe.colors == "network")
        return self.network() | {"encoder": np.frombuffer(encoder, np.uint8)}

    def network(self) -> dict[str, np.ndarray]:
        """Tensors of the file without the encoder."""
        found = dict(self.generator.tensors())
        found["codes"] = torch.stack([p.code for p in self.photographs])
        if self.recipe.colors == "network":  # values of -1 ... 1 become colors of 0 ... 1
            last = "last_conv" if self.recipe.family == "lattice" else "output"
            found[f"{last}.weight"] = NETWORK_SCALE * found[f"{last}.weight"]
            found[f"{last}.bias"] = NETWORK_MEAN + NETWORK_SCALE * found[f"{last}.bias"]
        else:
            found["colors"] = torch.stack([p.colors for p in self.photographs])
        return {
            name: np.ascontiguousarray(value.detach().float().cpu().numpy())
            for name, value in found.items()
        }


def write_space(path: Path, document: dict[str, Any], tensors: dict[str, np.ndarray]) -> None:
    """Write the document and the tensors of a space, those of docs/space-format.md."""
    metadata = {METADATA_KEY: json.dumps(document, separators=(",", ":"))}
    write_whole(path, save(tensors, metadata))
