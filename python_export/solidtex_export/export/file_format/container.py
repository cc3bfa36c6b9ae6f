"""The safetensors container: bytes to metadata and tensors, every extent checked first."""

import json
import math
from typing import Any

import numpy as np
import safetensors
import safetensors.numpy

from solidtex_export.export.file_format.checks import (
    Fields,
    ModelFileError,
    Shape,
    check_name,
    fail,
    show,
)

MAX_HEADER_BYTES = 16 << 20
MAX_DATA_BYTES = 512 << 20
MAX_FILE_BYTES = 8 + MAX_HEADER_BYTES + MAX_DATA_BYTES
MAX_JSON_DEPTH = 32
MAX_TENSOR_RANK = 5


def parse_json(label: str, what: str, text: str) -> Any:
    """Strict JSON that begins with "{": no duplicate keys, no NaN, bounded depth."""
    if not text.startswith("{"):
        raise fail(label, what, f"text that begins {show(text[:8])}", 'a JSON object, "{" first')
    try:
        value = json.loads(
            text,
            object_pairs_hook=lambda pairs: _unique_object(label, what, pairs),
            parse_int=_finite_int,
            parse_float=_finite_float,
            parse_constant=_refuse_constant,
        )
        too_deep = _is_deeper_than(value, MAX_JSON_DEPTH)
        json.dumps(value, ensure_ascii=False).encode()  # refuses unpaired surrogates
    except RecursionError:
        too_deep = True
    except ModelFileError:
        raise
    except ValueError as error:
        raise ModelFileError(f"{label}: {what}: found invalid JSON ({error})") from error
    if too_deep:
        raise fail(label, what, "deeply nested JSON", f"a depth of at most {MAX_JSON_DEPTH}")
    return value


def parse_container(label: str, data: bytes) -> tuple[dict[str, str], dict[str, np.ndarray]]:
    """The string metadata and the float32 tensors of a safetensors file."""
    header, data_bytes = _parse_header(label, data)
    metadata = header.pop("__metadata__", {})
    if not isinstance(metadata, dict) or not all(isinstance(v, str) for v in metadata.values()):
        raise fail(label, "__metadata__", show(metadata), "an object of strings")
    extents = sorted(_extent(label, name, entry, data_bytes) for name, entry in header.items())
    _check_contiguous(label, extents, data_bytes)
    try:
        return metadata, safetensors.numpy.load(data)
    except safetensors.SafetensorError as error:
        raise ModelFileError(f"{label}: header: found what safetensors refuses: {error}") from error


def _parse_header(label: str, data: bytes) -> tuple[dict[str, Any], int]:
    if len(data) < 8:
        raise fail(label, "header length", f"a file of {len(data)} bytes", "at least 8 bytes")
    header_bytes = int.from_bytes(data[:8], "little")
    limit = min(len(data) - 8, MAX_HEADER_BYTES)
    if header_bytes > limit:
        expected = f"at most {limit} bytes (file size, and a limit of {MAX_HEADER_BYTES})"
        raise fail(label, "header length", f"{header_bytes} bytes", expected)
    data_bytes = len(data) - 8 - header_bytes
    if data_bytes > MAX_DATA_BYTES:
        raise fail(label, "tensor data", f"{data_bytes} bytes", f"at most {MAX_DATA_BYTES}")
    try:
        text = data[8 : 8 + header_bytes].decode()
    except UnicodeDecodeError as error:
        raise fail(label, "header", f"invalid UTF-8 ({error})", "UTF-8 text") from error
    return parse_json(label, "header", text), data_bytes


def _extent(label: str, name: str, entry: Any, data_bytes: int) -> tuple[int, int, str]:
    """Where the tensor lies in the data; its size must be that of its shape."""
    where = f"tensor {show(name)}"
    check_name(label, where, name)
    fields = Fields(label, where, entry)
    fields.allow_only(("dtype", "shape", "data_offsets"))
    fields.choice("dtype", ("F32",))
    shape = _shape(fields)
    offsets = fields.array("data_offsets", 2, 2)
    if any(type(offset) is not int or not 0 <= offset <= data_bytes for offset in offsets):
        raise fields.wrong("data_offsets", f"two integers from 0 to {data_bytes}")
    begin, end = offsets
    expected_bytes = 4 * math.prod(shape)
    if end - begin != expected_bytes:
        found = f"{show(offsets)}, {end - begin} bytes"
        expected = f"{expected_bytes} bytes for shape {show(shape)}"
        raise fail(label, fields.path("data_offsets"), found, expected)
    return begin, end, name


def _shape(fields: Fields) -> Shape:
    shape = fields.array("shape", 1, MAX_TENSOR_RANK)
    if any(type(size) is not int or size < 1 for size in shape):
        raise fields.wrong("shape", "positive integers")
    if 4 * math.prod(shape) > MAX_DATA_BYTES:
        raise fields.wrong("shape", f"a tensor of at most {MAX_DATA_BYTES} bytes")
    return tuple(shape)


def _check_contiguous(label: str, extents: list[tuple[int, int, str]], data_bytes: int) -> None:
    position = 0
    for begin, end, name in extents:
        if begin != position:
            problem = "a hole before" if begin > position else "an overlap at"
            found = f"{problem} byte {begin} of the tensor data"
            raise fail(label, f"tensor {show(name)}", found, f"to begin at byte {position}")
        position = end
    if position != data_bytes:
        found = f"{data_bytes - position} bytes after the last tensor"
        raise fail(label, "tensor data", found, "none")


def _unique_object(label: str, what: str, pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    result = dict(pairs)
    if len(result) != len(pairs):
        keys = [key for key, _ in pairs]
        repeated = next(key for key in keys if keys.count(key) > 1)
        raise fail(label, what, f"key {show(repeated)} twice in one object", "unique keys")
    return result


def _is_deeper_than(value: Any, limit: int) -> bool:
    layer = [value]
    for _ in range(limit):
        layer = [child for parent in layer for child in _children(parent)]
    return any(isinstance(value, dict | list) for value in layer)


def _children(value: Any) -> list[Any]:
    if isinstance(value, dict):
        return list(value.values())
    return value if isinstance(value, list) else []


def _finite_float(text: str) -> float:
    value = float(text)
    if not math.isfinite(value):
        raise ValueError(f"number out of range: {text[:20]}")
    return value


def _finite_int(text: str) -> int:
    _finite_float(text)
    return int(text)


def _refuse_constant(text: str) -> Any:
    raise ValueError(f"{text} is no JSON number")
