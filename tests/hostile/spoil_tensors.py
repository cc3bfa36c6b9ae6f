"""One wrong tensor, or one wrong entry of the safetensors header."""

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from base_files import Header, Tensors

SpoiledTensors = tuple[str, str, Callable[[Tensors], None], tuple[str, ...]]
SpoiledHeader = tuple[str, str, Callable[[Header], None], tuple[str, ...]]


def spoiled_tensors() -> Iterator[SpoiledTensors]:
    yield "nan", "field", _poison("conv.weight", np.nan), ("conv.weight", "nan", "finite")
    yield "infinity", "field", _poison("conv.bias", np.inf), ("conv.bias", "inf", "finite")
    yield "minus_infinity", "sampler", _poison("transforms", -np.inf), ("transforms", "-inf")
    yield "nan_last", "sampler", _poison("output.bias", np.nan), ("output.bias", "nan", "element 1")
    yield "tensor_missing", "field", _remove("conv.bias"), ("conv.bias", "nothing", "[3]")
    yield "sampler_missing", "sampler", _remove("hidden.1.noise"), ("hidden.1.noise", "nothing")
    yield "tensor_extra", "field", _add("conv.momentum", (3,)), ("conv.momentum", "no such tensor")
    yield "noise_of_last_layer", "sampler", _add("hidden.2.noise", (5, 2)), ("hidden.2.noise",)
    yield "tensors_none", "field", lambda tensors: tensors.clear(), ("deconv.weight", "nothing")
    swapped = _reshape("conv.weight", (6, 3, 3, 3, 3))
    yield "shape_swapped", "field", swapped, ("conv.weight", "[6, 3, 3, 3, 3]", "[3, 6, 3, 3, 3]")
    yield "shape_flat", "field", _reshape("conv.weight", (486,)), ("conv.weight", "[486]")
    yield "shape_square", "sampler", _reshape("transforms", (4, 9)), ("transforms", "[4, 9]")


def _poison(name: str, value: float) -> Callable[[Tensors], None]:
    def change(tensors: Tensors) -> None:
        tensors[name].flat[-1] = value

    return change


def _remove(name: str) -> Callable[[Tensors], None]:
    return lambda tensors: tensors.__delitem__(name)


def _add(name: str, shape: tuple[int, ...]) -> Callable[[Tensors], None]:
    return lambda tensors: tensors.update({name: np.zeros(shape, np.float32)})


def _reshape(name: str, shape: tuple[int, ...]) -> Callable[[Tensors], None]:
    return lambda tensors: tensors.update({name: tensors[name].reshape(shape)})


def spoiled_headers() -> Iterator[SpoiledHeader]:
    yield from _dtypes()
    yield from _shapes()
    yield from _offsets()
    yield from _metadata()


def _put(tensor: str, key: str, value: Any) -> Callable[[Header], None]:
    return lambda header: header[tensor].update({key: value})


def _dtypes() -> Iterator[SpoiledHeader]:
    yield "dtype_half", "field", _put("conv.bias", "dtype", "F16"), ("conv.bias", '"F16"', "F32")
    yield "dtype_integer", "field", _put("conv.bias", "dtype", "I32"), ("conv.bias", '"I32"')
    yield "dtype_unknown", "field", _put("conv.bias", "dtype", "Q4"), ("conv.bias", '"Q4"')
    yield "dtype_number", "field", _put("conv.bias", "dtype", 4), ("conv.bias", "found 4")
    no_dtype = lambda header: header["conv.bias"].pop("dtype")  # noqa: E731
    yield "dtype_missing", "field", no_dtype, ("conv.bias", "dtype", "nothing")
    yield "entry_key", "field", _put("conv.bias", "stride", 1), ("conv.bias", "stride", "unknown")
    entry_array = lambda header: header.update({"conv.bias": [0, 12]})  # noqa: E731
    yield "entry_array", "field", entry_array, ("conv.bias", "an object")


def _shapes() -> Iterator[SpoiledHeader]:
    def shape(value: Any) -> Callable[[Header], None]:
        return _put("conv.bias", "shape", value)

    yield "shape_negative", "field", shape([-3]), ("conv.bias", "shape", "[-3]")
    yield "shape_two_negative", "field", shape([-1, -3]), ("conv.bias", "shape", "[-1")
    yield "shape_zero", "field", shape([0]), ("conv.bias", "shape", "[0]")
    yield "shape_float", "field", shape([3.0]), ("conv.bias", "shape", "[3.0]")
    yield "shape_huge", "field", shape([2**62]), ("conv.bias", "shape", str(2**62))
    yield "shape_beyond_64_bit", "field", shape([2**70]), ("conv.bias", "shape")
    yield "product_overflow", "field", shape([2**32, 2**32]), ("conv.bias", "shape")
    wrap = [2**31, 2**31, 4, 3]  # times four bytes it wraps to 0
    yield "product_wraps", "field", shape(wrap), ("conv.bias", "shape")
    yield "shape_scalar", "field", shape([]), ("conv.bias", "shape", "0 entries")
    yield "shape_rank", "field", shape([1] * 40 + [3]), ("conv.bias", "shape", "41 entries")
    yield "shape_string", "field", shape("3"), ("conv.bias", "shape", '"3"')
    yield "shape_size", "field", shape([4]), ("conv.bias", "data_offsets", "16 bytes")


def _offsets() -> Iterator[SpoiledHeader]:
    def offsets(value: Any) -> Callable[[Header], None]:
        return _put("deconv.weight", "data_offsets", value)

    where = ("deconv.weight", "data_offsets")
    yield "offsets_reversed", "field", offsets([1024, 0]), where
    yield "offsets_negative", "field", offsets([-1024, 0]), where
    yield "offsets_float", "field", offsets([0.0, 1024.0]), where
    yield "offsets_overflow", "field", offsets([2**64 - 1024, 2**64]), where
    yield "offsets_wrap", "field", offsets([2**63, 2**63 + 1024]), where
    yield "offsets_beyond_file", "field", offsets([10**6, 10**6 + 1024]), where
    yield "offsets_three", "field", offsets([0, 512, 1024]), (*where, "3 entries")
    yield "offsets_missing", "field", lambda h: h["deconv.weight"].pop("data_offsets"), where
    yield "overlap", "field", _shift("conv.bias", -4), ("conv.bias", "overlap")
    yield "same_extent", "field", _same_extent, ("tensor", "overlap")
    yield "hole", "field", _shift("scaled.shift", 4, room=True), ("scaled.shift", "hole")
    yield "unaccounted_bytes", "field", lambda h: h.pop("scaled.shift"), ("tensor data", "12 bytes")


def _shift(tensor: str, distance: int, room: bool = False) -> Callable[[Header], None]:
    def change(header: Header) -> None:
        begin, end = header[tensor]["data_offsets"]
        if room:  # the last tensor: shorter, so that it stays inside the file
            header[tensor]["shape"] = [2]
            end -= 4
        header[tensor]["data_offsets"] = [begin + distance, end + distance]

    return change


def _same_extent(header: Header) -> None:
    header["scaled.shift"]["data_offsets"] = header["scaled.scale"]["data_offsets"]


def _metadata() -> Iterator[SpoiledHeader]:
    yield "metadata_missing", "field", lambda h: h.pop("__metadata__"), ("__metadata__.solidtex",)
    yield "metadata_empty", "field", _metadata_is({}), ("__metadata__.solidtex", "nothing")
    yield "metadata_array", "field", _metadata_is(["solidtex"]), ("__metadata__", "an object")
    nested = {"solidtex": {"version": 1}}
    yield "metadata_not_string", "field", _metadata_is(nested), ("__metadata__", "strings")
    for name, text, words in (
        ("document_empty", "", ("begins",)),
        ("document_not_json", "{version: 1}", ("invalid JSON",)),
        ("document_array", "[1]", ("begins",)),
        ("document_nan", '{"version": NaN}', ("invalid JSON",)),
        ("document_infinite_number", '{"version": 1e999}', ("invalid JSON",)),
        ("document_duplicate_key", '{"version": 1, "version": 1}', ("twice", '"version"')),
        ("document_trailing", '{"version": 1} {}', ("invalid JSON",)),
        ("document_truncated", '{"version": 1', ("invalid JSON",)),
        ("document_surrogate", '{"name": "\\ud800"}', ("invalid JSON",)),
        ("document_deep", '{"a":' * 100_000, ("deeply nested", "32")),
    ):
        document = _metadata_is({"solidtex": text})
        yield name, "field", document, ("__metadata__.solidtex", *words)


def _metadata_is(value: Any) -> Callable[[Header], None]:
    return lambda header: header.update({"__metadata__": value})
