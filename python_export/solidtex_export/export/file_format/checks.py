"""Strict JSON, and checks of its fields, for files from a training or a user."""

import json
import math
from collections.abc import Sequence
from typing import Any

MAX_NAME_BYTES = 256

MAX_JSON_DEPTH = 32


class ModelFileError(ValueError):
    """An invalid model file: the file, the field or tensor, found, expected."""


def show(value: Any) -> str:
    """JSON text of a value, short enough for a message."""
    text = json.dumps(value, default=str)
    return text if len(text) <= 80 else text[:77] + "..."


def fail(label: str, where: str, found: str, expected: str) -> ModelFileError:
    return ModelFileError(f"{label}: {where}: found {found}, expected {expected}")


class Fields:
    """One JSON object of the document; every getter checks what it returns.

    `where` is the path of the object inside the document, "" for the document itself.
    """

    def __init__(self, label: str, where: str, value: Any) -> None:
        self.label = label
        self.where = where
        if not isinstance(value, dict):
            raise fail(label, where or "document", show(value), "an object")
        self._values = value

    def path(self, key: str) -> str:
        return f"{self.where}.{key}" if self.where else key

    def wrong(self, key: str, expected: str) -> ModelFileError:
        return fail(self.label, self.path(key), show(self._values[key]), expected)

    def allow_only(self, keys: Sequence[str]) -> None:
        for key in self._values:
            if key not in keys:
                known = ", ".join(keys)
                raise fail(self.label, self.path(key), "an unknown key", f"one of {known}")

    def __contains__(self, key: str) -> bool:
        return key in self._values

    def value(self, key: str) -> Any:
        if key not in self._values:
            raise fail(self.label, self.path(key), "nothing", "this required key")
        return self._values[key]

    def integer(self, key: str, low: int, high: int) -> int:
        value = self.value(key)
        if type(value) is not int or not low <= value <= high:
            raise self.wrong(key, f"an integer from {low} to {high}")
        return value

    def number(self, key: str, low: float, high: float) -> float:
        value = self.value(key)
        if type(value) not in (int, float) or not low <= value <= high:
            raise self.wrong(key, f"a number from {low:g} to {high:g}")
        return float(value)

    def string(self, key: str) -> str:
        value = self.value(key)
        if not isinstance(value, str):
            raise self.wrong(key, "a string")
        return value

    def choice(self, key: str, choices: Sequence[str]) -> str:
        value = self.value(key)
        if value not in choices:
            raise self.wrong(key, "one of " + ", ".join(show(choice) for choice in choices))
        return value

    def name(self, key: str) -> str:
        value = self.value(key)
        check_name(self.label, self.path(key), value)
        return value

    def array(self, key: str, low: int, high: int) -> list[Any]:
        value = self.value(key)
        if not isinstance(value, list):
            raise self.wrong(key, "an array")
        if not low <= len(value) <= high:
            expected = f"{low} to {high} entries"
            raise fail(self.label, self.path(key), f"{len(value)} entries", expected)
        return value

    def child(self, key: str) -> "Fields":
        return Fields(self.label, self.path(key), self.value(key))


def check_name(label: str, where: str, value: Any) -> None:
    """Names are printed, and passed through C strings: no control characters."""
    if (
        not isinstance(value, str)
        or not 1 <= len(value.encode()) <= MAX_NAME_BYTES
        or any(ord(c) < 0x20 or 0x7F <= ord(c) < 0xA0 for c in value)
    ):
        expected = f"a name of 1 to {MAX_NAME_BYTES} bytes without control characters"
        raise fail(label, where, show(value), expected)


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
