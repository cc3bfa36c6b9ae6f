"""Settings from TOML: one reader, one base of typed tables, one format of messages."""

from __future__ import annotations

import json
import tomllib
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Annotated, Any, TypeVar, get_args

from pydantic import AfterValidator, BaseModel, ConfigDict, Strict, ValidationError
from pydantic.fields import FieldInfo
from pydantic_core import ErrorDetails, PydanticCustomError

T = TypeVar("T")
Model = TypeVar("Model", bound="Settings")

Array = Annotated[tuple[T, ...], Strict(False)]
"""TOML and JSON have lists where Python has tuples."""
Pair = Annotated[tuple[T, T], Strict(False)]


class SettingsError(ValueError):
    """Invalid settings: the file, the field, found, expected."""


class Settings(BaseModel):
    """Base of tables: no unknown key, no missing key, no conversion except integers to floats."""

    model_config = ConfigDict(strict=True, extra="forbid", frozen=True, allow_inf_nan=False)


def within(low: float, high: float) -> AfterValidator:
    """Validator of a number's bounds."""

    def check(value: float) -> float:
        if not low <= value <= high:
            raise expected(f"{low:g} to {high:g}")
        return value

    return AfterValidator(check)


def expected(what: str) -> PydanticCustomError:
    """Error that the validator of one field raises."""
    return PydanticCustomError("expected", "expected {what}", {"what": what})


def wrong(where: str, found: Any, what: str) -> PydanticCustomError:
    """Error that the validator of a table raises for one of its fields."""
    sentence = f"{where}: found {show(found)}, expected {what}"
    return PydanticCustomError("wrong", "{sentence}", {"sentence": sentence})


def check_table(model: type[Settings], values: Any, where: str) -> None:
    """Validate an inner table whose values are kept as they are."""
    try:
        model.model_validate(values)
    except ValidationError as error:
        sentence = f"{where}.{_sentence(model, error.errors()[0])}"
        raise PydanticCustomError("wrong", "{sentence}", {"sentence": sentence}) from error


def show(value: Any) -> str:
    """JSON text of a value, short enough for a message."""
    text = json.dumps(value, default=str)
    return text if len(text) <= 80 else text[:77] + "..."


def read_toml(path: Path | Traversable) -> dict[str, Any]:
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError as error:
        raise SettingsError(f"{path}: found no such file, expected a TOML file") from error
    except (OSError, UnicodeDecodeError, RecursionError, tomllib.TOMLDecodeError) as error:
        raise SettingsError(f"{path}: found no readable TOML ({error}), expected some") from error


def validated(model: type[Model], values: Any, label: str) -> Model:
    """Validate the table; an error begins with `label` and names the first wrong field."""
    try:
        return model.model_validate(values)
    except ValidationError as error:
        first = error.errors()[0]
        raise SettingsError(f"{label}: {_sentence(model, first)}") from error


_KINDS = {
    "bool": "true or false",
    "int": "an integer",
    "float": "a number",
    "finite_number": "a number",
    "string": "a string",
    "tuple": "an array",
    "list": "an array",
    "dict": "a table",
    "model": "a table",
}


def _sentence(model: type[Settings], error: ErrorDetails) -> str:
    where = ".".join(map(str, error["loc"]))
    if error["type"] == "wrong":
        inside = error["ctx"]["sentence"]
        return f"{where}.{inside}" if where else inside
    if error["type"] == "missing":
        return f"{where}: found nothing, expected this key"
    if error["type"] == "extra_forbidden":
        known = ", ".join(_keys(_table(model, error["loc"][:-1])))
        return f"{where}: found an unknown key, expected {known}"
    return f"{where}: found {show(error['input'])}, expected {_expected(error)}"


def _expected(error: ErrorDetails) -> str:
    context = error.get("ctx", {})
    if error["type"] == "expected":
        return str(context["what"])
    if error["type"] == "literal_error":
        return "one of " + str(context["expected"]).replace("'", "").replace(" or ", ", ")
    if error["type"] == "too_long":
        return f"an array of {context['max_length']}"
    kind = error["type"].removesuffix("_type").removesuffix("_parsing")
    return _KINDS.get(kind, error["msg"])


def _table(model: type[Settings], path: tuple[int | str, ...]) -> type[Settings]:
    """The model of a table inside another. Names and places in a group of tables are passed."""
    for key in path:
        field = _keys(model).get(str(key))
        model = (field and _settings_of(field.annotation)) or model
    return model


def _keys(model: type[Settings]) -> dict[str, FieldInfo]:
    return {field.alias or name: field for name, field in model.model_fields.items()}


def _settings_of(annotation: Any) -> type[Settings] | None:
    """The model in a type such as dict[str, Loss], tuple[Entry, ...] or Photographs | None."""
    if isinstance(annotation, type) and issubclass(annotation, Settings):
        return annotation
    return next(filter(None, map(_settings_of, get_args(annotation))), None)
