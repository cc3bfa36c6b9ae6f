"""Reads a method from a TOML file: by the name of a shipped one, or by a path."""

from __future__ import annotations

import dataclasses
import math
import tomllib
import types
import typing
from importlib import resources
from pathlib import Path
from typing import Any

from solidtex_export.export.file_format.checks import show
from solidtex_export.losses.descriptor.network import layer_names
from solidtex_export.training.preset import FEATURE_LOSSES, PLANES, Method

SUFFIX = ".toml"


class MethodError(ValueError):
    """What is wrong with a method: the file, the field, found, expected."""


def shipped() -> list[str]:
    """Names of the methods that come with the package."""
    folder = resources.files("solidtex_export") / "presets"
    return sorted(f.name[: -len(SUFFIX)] for f in folder.iterdir() if f.name.endswith(SUFFIX))


def load_method(name: str, overrides: list[str] | None = None) -> Method:
    """`name` of a shipped method or path of a TOML file; `overrides` are KEY.KEY=VALUE."""
    values = _tables(name)
    for override in overrides or []:
        _override(values, override)
    method = _read(Method, values, name, "")
    _check(method, name)
    return method


def _tables(name: str) -> dict[str, Any]:
    path = Path(name)
    if name in shipped():
        text = (resources.files("solidtex_export") / "presets" / f"{name}{SUFFIX}").read_text()
    elif path.suffix == SUFFIX and path.is_file():
        text = path.read_text()
    else:
        raise MethodError(
            f"--method: found {name}, expected one of {', '.join(shipped())} or a {SUFFIX} file"
        )
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise MethodError(f"{name}: found invalid TOML ({error})") from error


def _override(values: dict[str, Any], text: str) -> None:
    """Sets one value, `optimiser.learning_rate=0.01` or `losses.0.weight=2`."""
    key, equals, value = text.partition("=")
    try:
        parsed = tomllib.loads(f"value = {value}")["value"]
    except tomllib.TOMLDecodeError:
        parsed = value  # a bare word
    *path, last = key.split(".")
    if not equals or not last:
        raise MethodError(f"--set: found {text}, expected KEY.KEY=VALUE")
    table: Any = values
    try:
        for part in path:
            table = table[int(part)] if isinstance(table, list) else table.setdefault(part, {})
        table[last] = parsed
    except (AttributeError, IndexError, TypeError, ValueError) as error:
        raise MethodError(f"--set: found {text}, expected a key of the method") from error


def _read(kind: type, values: Any, label: str, where: str) -> Any:
    """A dataclass from a TOML table: no unknown key, no missing one, types and ranges right."""
    if not isinstance(values, dict):
        raise _wrong(label, where, values, "a table")
    fields = {f.name: f for f in dataclasses.fields(kind)}
    hints = typing.get_type_hints(kind)
    prefix = f"{where}." if where else ""
    for key in values:
        if key not in fields:
            known = ", ".join(fields)
            raise MethodError(f"{label}: {prefix}{key}: found an unknown key, expected {known}")
    for name, f in fields.items():
        needed = f.default is f.default_factory is dataclasses.MISSING
        if needed and name not in values:
            raise MethodError(f"{label}: {prefix}{name}: found nothing, expected this key")
    read = {
        name: _value(hints[name], value, fields[name].metadata, label, prefix + name)
        for name, value in values.items()
    }
    return kind(**read)


def _value(hint: Any, value: Any, limits: Any, label: str, where: str) -> Any:
    if isinstance(hint, types.UnionType):  # optional
        hint = next(h for h in typing.get_args(hint) if h is not type(None))
    if isinstance(hint, type) and dataclasses.is_dataclass(hint):
        return _read(hint, value, label, where)
    if typing.get_origin(hint) is tuple:
        inner = typing.get_args(hint)[0]
        if not isinstance(value, list):
            raise _wrong(label, where, value, "an array")
        return tuple(_value(inner, v, limits, label, f"{where}.{i}") for i, v in enumerate(value))
    if typing.get_origin(hint) is dict:
        if not isinstance(value, dict):
            raise _wrong(label, where, value, "a table")
        return dict(value)
    if hint is float and type(value) is int:
        value = float(value)
    if type(value) is not hint or (hint is float and not math.isfinite(value)):
        names = {bool: "true or false", int: "an integer", float: "a number", str: "a string"}
        raise _wrong(label, where, value, names[hint])
    if "choices" in limits and value not in limits["choices"]:
        raise _wrong(label, where, value, "one of " + ", ".join(limits["choices"]))
    if "range" in limits:
        low, high = limits["range"]
        if not low <= value <= high:
            raise _wrong(label, where, value, f"{low:g} to {high:g}")
    return value


def _wrong(label: str, where: str, found: Any, expected: str) -> MethodError:
    return MethodError(f"{label}: {where}: found {show(found)}, expected {expected}")


def _check(method: Method, label: str) -> None:
    """What one field alone cannot tell."""
    if not method.losses:
        raise MethodError(f"{label}: losses: found none, expected at least one")
    always = [t for t in method.losses if t.of_any_lines and t.with_maps]
    if not any((t.start, t.end) == (0, 1) for t in always):
        expected = "one with start = 0, end = 1, with_maps and lines of any length"
        raise MethodError(f"{label}: losses: found none that always counts, expected {expected}")
    for i, term in enumerate(method.losses):
        if term.end < term.start:
            raise _wrong(label, f"losses.{i}.end", term.end, f"at least its start, {term.start:g}")
        if term.kind in FEATURE_LOSSES and not term.layers:
            raise MethodError(f"{label}: losses.{i}.layers: found nothing, expected layer names")
    if method.slicing.free_share and "wavelets" not in {term.kind for term in always}:
        expected = "0 without the loss of wavelets"
        raise _wrong(label, "slicing.free_share", method.slicing.free_share, expected)
    for where in ("optimiser", "critic", "projected_critic"):
        betas = getattr(method, where).betas
        if len(betas) != 2:
            raise _wrong(label, f"{where}.betas", list(betas), "two numbers")
    if not method.critic.widths:
        raise _wrong(label, "critic.widths", [], "numbers")
    for where in ("critic", "projected_critic"):
        if not getattr(method, where).scales:
            raise _wrong(label, f"{where}.scales", [], "numbers")
    known, layers = layer_names(), method.projected_critic.layers
    if not layers or not set(layers) <= set(known):
        expected = f"some of {', '.join(known)}"
        raise _wrong(label, "projected_critic.layers", list(layers), expected)
    if method.early.steps and method.generator.statistics == "trained":
        expected = "0 where generator.statistics are trained all along"
        raise _wrong(label, "early.steps", method.early.steps, expected)
    if method.generator.kind != "lattice":
        kind = method.generator.kind
        for f in dataclasses.fields(method.start):
            if (value := getattr(method.start, f.name)) != f.default:
                expected = f"{f.default:g} for generator.kind {kind}"
                raise _wrong(label, f"start.{f.name}", value, expected)
    if method.family == "field" and method.grain.short_octaves:
        expected = "0 for this generator"
        raise _wrong(label, "grain.short_octaves", method.grain.short_octaves, expected)
    if method.family == "field" and method.slicing.planes != "axes":
        expected = "axes for this generator (oblique_share adds oblique slices)"
        raise _wrong(label, "slicing.planes", method.slicing.planes, expected)
    if method.family == "sampler" and method.slicing.oblique_share:
        expected = f"0 for this generator (planes: {', '.join(PLANES)})"
        raise _wrong(label, "slicing.oblique_share", method.slicing.oblique_share, expected)
