"""Numbers of a shader: weights in the order of their use, transforms in fixed point, fading."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction

import numpy as np

from solidtex_export.export.file_format.checks import ModelFileError
from solidtex_export.export.file_format.model_file import ModelFile
from solidtex_export.export.verification import noise

MAX_ENTRY = 2**15
"""Entries of transforms have to be smaller: about 2^30 texels are in reach."""

Tensors = Mapping[str, np.ndarray]

TRANSFORM_WORDS = 3 * (2 + 3 * 3)
OCTAVE_WORDS = 4 + TRANSFORM_WORDS
OCTAVE_FLOATS = 9 + 3


def packed_weights(model: ModelFile) -> np.ndarray:
    """Layer by layer, for each four outputs: their biases, then their weights input by input.

    The constant input of layer 0 is folded into its bias, as in the engine.
    """
    tensors = model.tensors
    layers = model.document["sampler"]["hidden_layers"]
    blocks = [_packed(tensors["hidden.0.noise"], _folded_bias(tensors))]
    for l in range(1, layers):
        parts = [tensors[f"hidden.{l}.weight"]]
        if l + 1 < layers:
            parts.append(tensors[f"hidden.{l}.noise"])
        blocks.append(_packed(np.concatenate(parts, axis=1), tensors[f"hidden.{l}.bias"]))
    blocks.append(_packed(tensors["output.weight"], tensors["output.bias"]))
    return np.concatenate(blocks)


def _folded_bias(tensors: Tensors) -> np.ndarray:
    weight, bias = (tensors[f"hidden.0.{part}"].astype(np.float64) for part in ("weight", "bias"))
    return (bias + weight @ tensors["constant"].astype(np.float64)).astype(np.float32)


def _packed(weight: np.ndarray, bias: np.ndarray) -> np.ndarray:
    columns = np.concatenate([bias[:, None], weight], axis=1)
    columns = np.pad(columns, ((0, -len(columns) % 4), (0, 0)))
    return columns.reshape(-1, 4, columns.shape[1]).swapaxes(1, 2).reshape(-1, 4)


def octave_words(model: ModelFile, seed: int) -> np.ndarray:
    """OCTAVE_WORDS words per octave: the key of its noise, then its transform in fixed point."""
    words = [
        [*(int(word) for word in noise.solidtex_1_key(seed, octave, 0)), *_fixed_point(transform)]
        for octave, transform in enumerate(model.tensors["transforms"])
    ]
    return np.array(words, np.uint32).ravel()


def _fixed_point(transform: np.ndarray) -> list[int]:
    """Words of a transform, row by row: a start of two words, then three words per entry.

    An entry has 32 bits before and 48 bits after the point, and a sum 32 and 32. Whole texels are
    given plus 2^31, so that they are never negative; the start takes that off again.
    """
    words = []
    for row in transform:
        entries = [round(Fraction(float(entry)) * 2**48) for entry in row]
        start = -sum(entries) << 31 >> 16
        words += [start >> 32 & 0xFFFFFFFF, start & 0xFFFFFFFF]
        for entry in entries:
            words += [entry >> 48 & 0xFFFFFFFF, entry >> 16 & 0xFFFFFFFF, entry & 0xFFFF]
    return words


def check_transforms(model: ModelFile) -> None:
    largest = float(np.abs(model.tensors["transforms"]).max())
    if largest >= MAX_ENTRY:
        raise ModelFileError(
            f"transforms: found an entry of {largest:g}, expected less than {MAX_ENTRY} for a"
            " shader's 32-bit integers; train the model with coarser octaves"
        )


def octave_floats(model: ModelFile) -> np.ndarray:
    """OCTAVE_FLOATS numbers per octave: its transform, then three terms of its fading.

    In the mean over a cube whose half edge is r an octave is divided by det(I + s T T') with
    s = r^2 / 2 (engine/sampler/octave_fade.h): 1 plus a polynomial of s with these terms.
    """
    rows = []
    for transform in model.tensors["transforms"].astype(np.float64):
        square = transform.T @ transform
        pairs = 0.5 * (np.trace(square) ** 2 - np.trace(square @ square))
        volume = np.linalg.det(transform) ** 2
        rows.append([*transform.ravel(), np.trace(square), pairs, volume])
    return np.clip(np.array(rows), -1e15, 1e15).astype(np.float32).ravel()
