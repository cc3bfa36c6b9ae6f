"""Reads, validates and writes `.solidtex` model files (docs/file-format.md)."""

import json
import os
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import safetensors.numpy

from solidtex_export.export.file_format.checks import (
    Fields,
    ModelFileError,
    Shape,
    check_name,
    fail,
    show,
)
from solidtex_export.export.file_format.container import MAX_FILE_BYTES, parse_container, parse_json
from solidtex_export.export.file_format.field import field_tensors
from solidtex_export.export.file_format.sampler import sampler_tensors
from solidtex_export.images.channels import MAX_CHANNELS
from solidtex_export.whole_file import write_whole

__all__ = ["ModelFile", "ModelFileError", "parse", "read", "serialize", "validate", "write"]

VERSION = 1
METADATA_KEY = "solidtex"
MAX_EXEMPLARS = 3
DOCUMENT_KEYS = (
    *("version", "name", "family", "channels", "color_space", "noise", "field", "sampler"),
    *("exemplar", "training", "license"),
)


@dataclass
class ModelFile:
    """The JSON document of a model and its float32 tensors, by name."""

    document: dict[str, Any]
    tensors: dict[str, np.ndarray]


def read(path: str | os.PathLike[str]) -> ModelFile:
    """Reads and validates a model file; raises ModelFileError for anything wrong with it."""
    try:
        size = os.stat(path).st_size
        if size > MAX_FILE_BYTES:
            raise fail(str(path), "file size", f"{size} bytes", f"at most {MAX_FILE_BYTES}")
        data = Path(path).read_bytes()
    except OSError as error:
        raise ModelFileError(f"{path}: cannot read: {error.strerror}") from error
    return parse(data, str(path))


def parse(data: bytes, label: str) -> ModelFile:
    """The same for bytes in memory; `label` stands for the file name in messages."""
    metadata, tensors = parse_container(label, data)
    if METADATA_KEY not in metadata:
        raise fail(label, f"__metadata__.{METADATA_KEY}", "nothing", "the model's JSON document")
    document = parse_json(label, f"__metadata__.{METADATA_KEY}", metadata[METADATA_KEY])
    model = ModelFile(document, tensors)
    validate(model, label)
    return model


def validate(model: ModelFile, label: str = "model") -> None:
    """Checks the document and that the tensors are exactly those it asks for."""
    document = Fields(label, "", model.document)
    document.integer("version", VERSION, VERSION)
    document.allow_only(DOCUMENT_KEYS)
    document.name("name")
    document.choice("color_space", ("srgb", "linear", "data"))
    _check_provenance(document)
    channel_count = _check_channels(document)
    shapes = _architecture_tensors(document, channel_count)
    _check_tensors(label, model.tensors, shapes)


def serialize(model: ModelFile, label: str = "model") -> bytes:
    """The bytes of the file, proven readable by reading them back."""
    validate(model, label)
    try:
        document = json.dumps(model.document, allow_nan=False, separators=(",", ":"))
    except (TypeError, ValueError) as error:
        raise ModelFileError(f"{label}: document: cannot be written as JSON: {error}") from error
    tensors = {name: np.ascontiguousarray(values) for name, values in model.tensors.items()}
    data = safetensors.numpy.save(tensors, metadata={METADATA_KEY: document})
    parse(data, label)
    return data


def write(path: str | os.PathLike[str], model: ModelFile) -> None:
    """Writes a valid model, or leaves what was there."""
    path = Path(path)
    write_whole(path, serialize(model, str(path)))


def _check_channels(document: Fields) -> int:
    channels = document.array("channels", 1, MAX_CHANNELS)
    for index, name in enumerate(channels):
        where = f"channels[{index}]"
        check_name(document.label, where, name)
        if name in channels[:index]:
            raise fail(document.label, where, show(name), "a name that no earlier channel has")
    return len(channels)


def _check_provenance(document: Fields) -> None:
    """Exemplar and licence say where a model comes from; both are optional."""
    if "license" in document:
        document.string("license")
    if "training" in document:
        document.child("training")
    if "exemplar" not in document:
        return
    if isinstance(document.value("exemplar"), list):
        for index, value in enumerate(document.array("exemplar", 1, MAX_EXEMPLARS)):
            _check_exemplar(Fields(document.label, f"exemplar[{index}]", value))
    else:
        _check_exemplar(document.child("exemplar"))


def _check_exemplar(exemplar: Fields) -> None:
    keys = ("file", "sha256", "license", "source")
    exemplar.allow_only(keys)
    for key in keys:
        if key in exemplar:
            exemplar.string(key)
    if "sha256" in exemplar and not re.fullmatch("[0-9a-f]{64}", exemplar.string("sha256")):
        raise exemplar.wrong("sha256", "64 lower-case hexadecimal digits")


def _architecture_tensors(document: Fields, channel_count: int) -> dict[str, Shape]:
    noise = document.child("noise")
    noise.allow_only(("scheme",))
    scheme = noise.choice("scheme", ("solidtex-1", "solidtexturenets"))
    family = document.choice("family", ("field", "sampler"))
    other = "sampler" if family == "field" else "field"
    if other in document:
        where, expected = other, f"only {family}, the key of the family"
        raise fail(document.label, where, "this key", expected)
    if family == "field":
        return field_tensors(document.child("field"), channel_count, scheme)
    if scheme != "solidtex-1":
        raise noise.wrong("scheme", '"solidtex-1": the sampler needs normal noise')
    return sampler_tensors(document.child("sampler"), channel_count)


def _check_tensors(
    label: str, tensors: Mapping[str, np.ndarray], shapes: Mapping[str, Shape]
) -> None:
    for name, shape in shapes.items():
        where = f"tensor {show(name)}"
        if name not in tensors:
            raise fail(label, where, "nothing", f"F32 of shape {show(shape)}")
        values = tensors[name]
        if values.dtype != np.float32:
            raise fail(label, where, f"type {values.dtype}", "float32")
        if values.shape != shape:
            raise fail(label, where, f"shape {show(values.shape)}", f"shape {show(shape)}")
        if not np.isfinite(values).all():
            index = int(np.flatnonzero(~np.isfinite(values))[0])
            found = f"{values.ravel()[index]} at element {index}"
            raise fail(label, where, found, "finite values")
    for name in tensors:
        if name not in shapes:
            found = f"shape {show(tensors[name].shape)}"
            raise fail(label, f"tensor {show(name)}", found, "no such tensor in this architecture")
