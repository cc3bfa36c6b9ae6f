"""Converts a model of the sampler family to a function in a shading language."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from solidtex_export.export.file_format.model_file import ModelFile
from solidtex_export.export.shader.emitter import TEXTURE_WIDTH, Precision, Storage, half_words
from solidtex_export.export.shader.languages import EMITTERS
from solidtex_export.export.shader.network import sampler_program
from solidtex_export.export.shader.program import Program

BY_SUFFIX = {emitter.suffix: emitter for emitter in EMITTERS}


@dataclass(frozen=True)
class Shader:
    text: str
    data: np.ndarray | None
    """Contents of the buffer, uint32, or of the texture, [row, column, 4]; None for constants."""


def shader(
    model: ModelFile,
    suffix: str,
    name: str,
    storage: Storage,
    precision: Precision,
    seed: int = 0,
    corrects_means: bool = True,
) -> Shader:
    """Functions `name` and `name`_at in the language of files with this suffix.

    Without the engine, which measures the material, means over footprints cannot be corrected.
    """
    program = sampler_program(model, name, seed, corrects_means)
    emitter = BY_SUFFIX[suffix](program, storage, precision)
    if storage == "constant":
        return Shader(emitter.text(), None)
    make = _texture if storage == "texture" else _buffer
    return Shader(emitter.text(), make(program, precision, emitter.per_element))


def _buffer(program: Program, precision: Precision, per_element: int) -> np.ndarray:
    words = program.words()
    words = np.pad(words, (0, -len(words) % per_element)).reshape(-1, per_element)
    weights = program.weights.view("<u4") if precision == "float" else half_words(program.weights)
    return np.concatenate([words, weights]).astype("<u4")


def _texture(program: Program, precision: Precision, per_element: int) -> np.ndarray:
    words = program.words()
    parts = [words & 0x7FF, words >> 11 & 0x7FF, words >> 22, np.zeros_like(words)]
    texels = np.concatenate([np.stack(parts, axis=1), program.weights])
    texels = np.pad(texels, ((0, -len(texels) % TEXTURE_WIDTH), (0, 0)))
    return texels.reshape(-1, TEXTURE_WIDTH, 4).astype("<f2" if precision == "half" else "<f4")


def function_name(path: Path) -> str:
    """Name of the function in a file: solidtex_granite for granite.wgsl."""
    return "solidtex_" + re.sub(r"_+", "_", re.sub(r"\W", "_", path.stem, flags=re.ASCII)).lower()
