"""One wrong place in the bytes: truncations, the header's length, its text."""

import struct
from collections.abc import Callable, Iterator

from base_files import pack

Spoiled = tuple[str, str, Callable[[bytes], bytes], tuple[str, ...]]


def spoiled_bytes() -> Iterator[Spoiled]:
    yield from _truncations()
    yield from _header_lengths()
    yield from _header_texts()
    yield "trailing_byte", "field", lambda data: data + b"\0", ("tensor data", "1 bytes after")
    yield "trailing_file", "sampler", lambda data: data + data, ("tensor data", "bytes after")


def _header_size(data: bytes) -> int:
    return int(struct.unpack("<Q", data[:8])[0])


def _truncations() -> Iterator[Spoiled]:
    yield "empty", "field", lambda data: b"", ("header length", "0 bytes")
    yield "four_bytes", "field", lambda data: data[:4], ("header length", "4 bytes")
    yield "only_length", "field", lambda data: data[:8], ("header length",)
    yield "in_header", "field", lambda data: data[:100], ("header length",)
    at_data = lambda data: data[: 8 + _header_size(data)]  # noqa: E731
    yield "no_tensor_data", "field", at_data, ("tensor", "data_offsets")
    in_data = lambda data: data[: 8 + _header_size(data) + 50]  # noqa: E731
    yield "in_tensor_data", "sampler", in_data, ("tensor", "data_offsets")
    yield "last_byte_missing", "field", lambda data: data[:-1], ("scaled.shift", "cut short")


def _length(value: int) -> Callable[[bytes], bytes]:
    return lambda data: struct.pack("<Q", value) + data[8:]


def _header_lengths() -> Iterator[Spoiled]:
    yield "length_zero", "field", _length(0), ("header", "begins")
    yield "length_one_short", "field", lambda d: _length(_header_size(d) - 1)(d), ("header", "JSON")
    yield "length_huge", "field", _length(1 << 40), ("header length", str(1 << 40))
    yield "length_overflow", "field", _length(2**64 - 1), ("header length", str(2**64 - 1))
    yield "length_wraps", "field", _length(2**64 - 8), ("header length", str(2**64 - 8))
    big = pack(b"{" + b" " * (16 << 20) + b"}", b"")
    yield "length_over_limit", "field", lambda data: big, ("header length", str(16 << 20))


def _text(change: Callable[[bytes], bytes]) -> Callable[[bytes], bytes]:
    """Changes the header's text and keeps its length right."""

    def apply(data: bytes) -> bytes:
        size = _header_size(data)
        return pack(change(data[8 : 8 + size]), data[8 + size :])

    return apply


def _header_texts() -> Iterator[Spoiled]:
    yield (
        "header_not_utf8",
        "field",
        _text(lambda t: t.replace(b"conv", b"c\xff\xfev")),
        ("header",),
    )
    yield "header_binary", "field", _text(lambda t: b"\x00\x01\x02" * 50), ("header", "begins")
    yield "header_not_json", "field", _text(lambda t: b"{hello}"), ("header", "invalid JSON")
    yield "header_array", "field", _text(lambda t: b"[" + t + b"]"), ("header", "begins")
    yield "header_space_first", "field", _text(lambda t: b" " + t), ("header", "begins")
    yield "header_zero_padded", "field", _text(lambda t: t + b"\0\0"), ("header",)
    yield "header_deep", "field", _text(lambda t: b'{"a":' * 100_000), ("header", "deeply nested")
    deep_array = _text(lambda t: b'{"a":' + b"[" * 100_000 + b"]" * 100_000 + b"}")
    yield "header_deep_array", "field", deep_array, ("header", "deeply nested")
    extra = b'{"conv.bias": {"dtype": "F32", "shape": [3], "data_offsets": [0, 12]}, '
    yield "tensor_duplicate", "field", _text(lambda t: extra + t[1:]), ("conv.bias", "twice")
    meta = b'{"__metadata__": {"solidtex": "{}"}, '
    yield "metadata_duplicate", "field", _text(lambda t: meta + t[1:]), ("__metadata__", "twice")
    wide = _text(lambda t: b'{"' + b"n" * 300 + b'": {"dtype": "F32"}, ' + t[1:])
    yield "tensor_name_long", "field", wide, ("tensor", "nnn", "256")
    pickle = b"\x80\x04\x95\x1a\x00\x00\x00\x00\x00\x00\x00\x8c\x05posix\x94\x8c\x06system\x94."
    yield "pickle", "field", lambda data: pickle, ("header length",)
