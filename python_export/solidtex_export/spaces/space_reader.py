"""Reads a texture space from its file, `NAME.solidtex-space`."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import torch
from pydantic import Field
from safetensors import SafetensorError, safe_open
from torch import Tensor

from solidtex_export.export.file_format.model_file import METADATA_KEY as MODEL_KEY
from solidtex_export.settings import Array, Settings, SettingsError, validated, within
from solidtex_export.spaces.generators import ConditionedLattice, ConditionedSampler
from solidtex_export.spaces.settings import LatticeSettings, SamplerSettings, Size
from solidtex_export.spaces.space_file import METADATA_KEY

MAX_BYTES = 1 << 28
PROGRAMS = "a file of solidtex-export-space or a result of solidtex-train-space"

Encode = Callable[[Tensor], Tensor]
"""Patches [n, 3, side, side] -> codes [n, code]."""


class SpaceError(ValueError):
    """A space that cannot be used: the file, the field, found, expected."""


class StyleSizes(Settings):
    width: Size
    slope: Annotated[float, within(0, 1)]


class SamplerSizes(Settings):
    octaves: Annotated[int, within(1, 256)]
    hidden_layers: Annotated[int, within(2, 64)]
    width: Size
    slope: Annotated[float, within(0, 1)]
    transforms: Literal["bounded", "linear"]


class Noise(Settings):
    scheme: Literal["solidtex-1"]


class SpaceDocument(Settings):
    """Document of a space (docs/space-format.md)."""

    version: Literal[1]
    name: str
    family: Literal["lattice", "sampler"]
    channels: Array[Literal["albedo.r", "albedo.g", "albedo.b"]]
    color_space: Literal["srgb"]
    colors: Literal["photograph", "network"]
    patch: Annotated[int, within(8, 4096)]
    resolution: Annotated[int, within(8, 65536)]
    code: Size
    directions: Literal["xyz", "xy"]
    noise: Noise
    lattice: LatticeSettings | None = None
    sampler: SamplerSizes | None = None
    style: StyleSizes
    photographs: Annotated[Array[dict[str, str]], Field(min_length=1)]
    license: str = ""
    training: dict[str, Any]


@dataclass(frozen=True)
class OpenSpace:
    """A space that was read. `tensors` are float32, without the encoder."""

    path: Path
    sha256: str
    document: SpaceDocument
    tensors: Mapping[str, np.ndarray]
    encode: Encode
    critic: Mapping[str, Tensor] | None = None
    """Weights of the critic that the space was trained with; a file has none."""


def read_space_file(path: Path) -> OpenSpace:
    if not path.is_file():
        raise SpaceError(f"{path}: found no such file, expected {PROGRAMS}")
    size = path.stat().st_size
    if size > MAX_BYTES:
        raise SpaceError(f"{path}: found {size} bytes, expected at most {MAX_BYTES}")
    data = path.read_bytes()
    try:
        with safe_open(path, "np") as file:
            metadata = file.metadata() or {}
            tensors = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118
    except (SafetensorError, TypeError, ValueError) as error:
        raise SpaceError(
            f"{path}: found no whole safetensors file ({error}), expected {PROGRAMS} (copy or"
            " download a file again that is cut short)"
        ) from error
    document = _document(path, metadata)
    encoder = tensors.pop("encoder", None)
    if encoder is None or encoder.dtype != np.uint8 or encoder.ndim != 1:
        raise SpaceError(f"{path}: tensor encoder: expected the bytes of an ONNX file")
    _check_tensors(path, tensors, expected_shapes(document, str(path)))
    encode = _onnx_encoder(path, encoder.tobytes(), document)
    return OpenSpace(path, hashlib.sha256(data).hexdigest(), document, tensors, encode)


def _document(path: Path, metadata: Mapping[str, str]) -> SpaceDocument:
    if list(metadata) != [METADATA_KEY]:
        found = ", ".join(metadata) or "none"
        if MODEL_KEY in metadata:
            raise SpaceError(f"{path}: this is a model, expected a texture space, {PROGRAMS}")
        raise SpaceError(f"{path}: metadata: found {found}, expected {METADATA_KEY}")
    try:
        values = json.loads(metadata[METADATA_KEY])
    except ValueError as error:
        raise SpaceError(f"{path}: document: found no JSON ({error}), expected some") from error
    version = values.get("version") if isinstance(values, dict) else None
    if version != 1:
        raise SpaceError(
            f"{path}: version: found {json.dumps(version)}, expected 1: another version of"
            " solidtex wrote this space"
        )
    try:
        document = validated(SpaceDocument, values, str(path))
    except SettingsError as error:
        raise SpaceError(str(error)) from error
    if getattr(document, document.family) is None or (document.lattice and document.sampler):
        raise SpaceError(
            f"{path}: expected one of the tables lattice and sampler, that of the family"
            f" {document.family}"
        )
    return document


def expected_shapes(document: SpaceDocument, label: str) -> dict[str, tuple[int, ...]]:
    """Shapes of all tensors but the encoder."""
    count, code = len(document.photographs), document.code
    generator: ConditionedLattice | ConditionedSampler
    try:
        with torch.device("meta"):
            if document.lattice is not None:
                generator = ConditionedLattice(document.lattice, code, document.style.width)
            else:
                assert document.sampler is not None
                sizes = SamplerSettings(**document.sampler.model_dump())
                generator = ConditionedSampler(sizes, code, document.style.width)
            shapes = {n: tuple(t.shape) for n, t in generator.tensors().items()}
    except ValueError as error:
        raise SpaceError(f"{label}: {document.family}.{error}") from error
    shapes["codes"] = (count, code)
    if document.colors == "photograph":
        shapes["colors"] = (count, 3, 4)
    return shapes


def _check_tensors(
    path: Path, tensors: Mapping[str, np.ndarray], shapes: Mapping[str, tuple[int, ...]]
) -> None:
    for name in sorted(tensors.keys() | shapes.keys()):
        if name not in tensors or name not in shapes:
            found, wanted = ("nothing", "one") if name in shapes else ("one", "none")
            raise SpaceError(f"{path}: tensor {name}: found {found}, expected {wanted}")
        values = tensors[name]
        if values.dtype != np.float32 or values.shape != shapes[name]:
            raise SpaceError(
                f"{path}: tensor {name}: found {values.dtype} {list(values.shape)}, expected"
                f" float32 {list(shapes[name])}"
            )
        if not np.isfinite(values).all():
            raise SpaceError(f"{path}: tensor {name}: found values that are not finite")


def _onnx_encoder(path: Path, data: bytes, document: SpaceDocument) -> Encode:
    os.environ.setdefault("ORT_DISABLE_TELEMETRY", "1")  # else it reports its use to Microsoft
    try:
        import onnxruntime
    except ModuleNotFoundError as error:
        raise SpaceError(
            f"{path}: found no Python package 'onnxruntime', expected it for the encoder"
            " (in a clone: pip install './python_export[spaces]')"
        ) from error
    side, code = document.patch, document.code
    try:
        session = onnxruntime.InferenceSession(data, providers=["CPUExecutionProvider"])
    except Exception as error:  # onnxruntime raises many kinds
        reason = (str(error) or type(error).__name__).splitlines()[0]
        raise SpaceError(f"{path}: tensor encoder: found no usable ONNX ({reason})") from error
    inputs, outputs = session.get_inputs(), session.get_outputs()
    shapes = [(v.name, v.shape[1:]) for v in (*inputs, *outputs)]
    wanted = [("patches", [3, side, side]), ("codes", [code])]
    if shapes != wanted:
        raise SpaceError(f"{path}: tensor encoder: found {shapes}, expected {wanted}")

    def encode(patches: Tensor) -> Tensor:
        return torch.from_numpy(session.run(None, {"patches": patches.float().numpy()})[0])

    return encode
