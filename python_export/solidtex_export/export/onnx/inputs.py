"""Noise inputs with which an exported ONNX graph returns libsolidtex's values.

`metadata` is that of the ONNX model: `session.get_modelmeta().custom_metadata_map` of ONNX Runtime,
or `{p.key: p.value for p in model.metadata_props}` of the onnx package. This module needs neither.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from solidtex_export.export.places import check_box, check_points, check_seed
from solidtex_export.export.verification import noise
from solidtex_export.export.verification.reference import octave_noise

METADATA_KEY = "solidtex"
DOCUMENT_VERSION = 1

Inputs = dict[str, np.ndarray]
"""float32 arrays by the name of the graph's input."""


class InputError(ValueError):
    """Noise inputs that cannot be computed for an ONNX model; places and seeds raise ValueError."""


def block_inputs(metadata: Mapping[str, str], origin: Sequence[int], seed: int = 0) -> Inputs:
    """Noise of the block whose first voxel is `origin`, for the lattice family.

    `origin` must differ from the origin of the export by multiples of the graph's alignment.
    """
    document = _document(metadata, "field")
    exported, step = document["box"]["lo"], document["alignment"]
    size = [high - low for low, high in zip(exported, document["box"]["hi"], strict=True)]
    origin, _ = check_box(origin, size)
    check_seed(seed)
    shift = [o - e for o, e in zip(origin, exported, strict=True)]
    if any(s % step for s in shift):
        raise InputError(
            f"origin: found {list(origin)}, expected {exported} plus multiples of {step};"
            " solidtex-export-onnx --origin exports for others"
        )
    return {node["name"]: _block(document, node, shift, seed) for node in document["inputs"]}


def point_inputs(metadata: Mapping[str, str], positions: ArrayLike, seed: int = 0) -> Inputs:
    """Octave values at positions [point, 3] in texels, for the sampler family."""
    document = _document(metadata, "sampler")
    points = np.asarray(positions, dtype=np.float64)
    if points.ndim != 2 or points.shape[1] != 3:
        raise InputError(f"positions: found shape {points.shape}, expected (count, 3)")
    check_points(points)
    check_seed(seed)
    scheme = document["noise"]["scheme"]
    octaves = [
        octave_noise(scheme, seed, level, points @ transform.T)
        for level, transform in enumerate(np.array(document["transforms"]))
    ]
    (node,) = document["inputs"]
    return {node["name"]: np.stack(octaves, axis=-1).astype(np.float32)}


def _block(
    document: dict[str, Any], node: dict[str, Any], shift: list[int], seed: int
) -> np.ndarray:
    lo, hi = ([v + (s >> node["level"]) for v, s in zip(node[end], shift, strict=True)]
              for end in ("lo", "hi"))  # fmt: skip
    if "waves" in node:
        return noise.waves(node["waves"], lo, hi).astype(np.float32)[None]
    scheme, channels = document["noise"]["scheme"], node["channels"]
    values = noise.block(scheme, node["distribution"], seed, node["level"], channels, lo, hi)
    return values.astype(np.float32)[None]


def _document(metadata: Mapping[str, str], family: str) -> dict[str, Any]:
    if METADATA_KEY not in metadata:
        raise InputError(f"metadata: found no key {METADATA_KEY!r}, expected an ONNX model of"
                         " solidtex-export-onnx")  # fmt: skip
    document = json.loads(metadata[METADATA_KEY])
    if document["version"] != DOCUMENT_VERSION:
        raise InputError(f"metadata: found version {document['version']}, expected"
                         f" {DOCUMENT_VERSION}")  # fmt: skip
    if document["family"] != family:
        names = {"field": "lattice", "sampler": "sampler"}
        raise InputError(f"metadata: found a model of the {names[document['family']]} family,"
                         f" expected the {names[family]} family")  # fmt: skip
    return document
