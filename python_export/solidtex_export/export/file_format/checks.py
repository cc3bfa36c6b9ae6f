"""Small checks shared by the parts of the model file reader, and their one error type."""

import json
from collections.abc import Sequence
from typing import Any

MAX_NAME_BYTES = 256

Shape = tuple[int, ...]


class ModelFileError(ValueError):
    """What is wrong with a model file: the file, the field or tensor, found, expected."""


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
        or any(ord(character) < 0x20 or ord(character) == 0x7F for character in value)
    ):
        expected = f"a name of 1 to {MAX_NAME_BYTES} bytes without control characters"
        raise fail(label, where, show(value), expected)
