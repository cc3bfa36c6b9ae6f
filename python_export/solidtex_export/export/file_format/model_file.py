"""Reads and writes `.solidtex` model files (docs/file-format.md).

The engine checks every file that is read or written, so there is one set of rules.
"""

import json
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import safetensors.numpy

from solidtex_export.bare_name import is_bare_name
from solidtex_export.export.file_format.checks import ModelFileError, fail, show
from solidtex_export.export.verification import engine
from solidtex_export.whole_file import write_whole

__all__ = [
    "ModelFile",
    "ModelFileError",
    "loaded",
    "parse",
    "read",
    "serialize",
    "validate",
    "write",
]

VERSION = 1
METADATA_KEY = "solidtex"
IN_MEMORY = "model in memory: "
"""Name of a model without a file in the engine's messages."""


@dataclass
class ModelFile:
    """JSON document and float32 tensors, by name, of a model."""

    document: dict[str, Any]
    tensors: dict[str, np.ndarray]


def read(path: str | os.PathLike[str]) -> ModelFile:
    """Read a model file that the engine accepts; raise ModelFileError for any other.

    A bare name ("granite-grey") that is no file is that of an installed model.
    """
    given = Path(path)
    model = path if is_bare_name(given) else given.absolute()
    with engine.checking(ModelFileError), engine.open_model(model) as texture:
        found = Path(texture.path)
    return loaded(found.read_bytes())


def parse(data: bytes, label: str) -> ModelFile:
    """Read a model from memory; `label` stands for the file name in messages."""
    try:
        with engine.checking(ModelFileError):
            engine.open_bytes(data).close()
    except ModelFileError as error:
        raise ModelFileError(f"{label}: {str(error).removeprefix(IN_MEMORY)}") from error
    return loaded(data)


def loaded(data: bytes) -> ModelFile:
    """Document and tensors of a file, without a check."""
    header = json.loads(data[8 : 8 + int.from_bytes(data[:8], "little")])
    document = json.loads(header["__metadata__"][METADATA_KEY])
    return ModelFile(document, safetensors.numpy.load(data))


def validate(model: ModelFile, label: str = "model") -> None:
    """Check that the model can be written and read."""
    serialize(model, label)


def serialize(model: ModelFile, label: str = "model") -> bytes:
    """Bytes of the file, checked by the engine."""
    try:
        document = json.dumps(model.document, allow_nan=False, separators=(",", ":"))
        json.dumps(model.document, ensure_ascii=False).encode()  # refuses unpaired surrogates
    except (TypeError, ValueError) as error:
        raise ModelFileError(f"{label}: document: cannot be written as JSON: {error}") from error
    for name, values in model.tensors.items():
        if values.dtype != np.float32:
            raise fail(label, f"tensor {show(name)}", f"type {values.dtype}", "float32")
    tensors = {name: np.ascontiguousarray(values) for name, values in model.tensors.items()}
    data = safetensors.numpy.save(tensors, metadata={METADATA_KEY: document})
    parse(data, label)
    return data


def write(path: str | os.PathLike[str], model: ModelFile) -> None:
    """Write a valid model; on failure an existing file stays unchanged."""
    path = Path(path)
    write_whole(path, serialize(model, str(path)))
