"""Reads recipes: by the name of a shipped preset, or by the path of a TOML file."""

from __future__ import annotations

import tomllib
from importlib import resources
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any

from solidtex_export.settings import SettingsError, read_toml, show, validated
from solidtex_export.training.recipe import Recipe

SUFFIX = ".toml"
RENAMED = {
    "optimiser": "optimizer",
    "optimizer.equalised": "per_layer_scaling",
    "critic.equalised": "equalized_learning_rate",
    "critic.memory": "replay_buffer",
    "projected_critic.memory": "replay_buffer",
    "losses.tones": "color_distribution",
}
"""Accepted names of older keys, by table."""
RENAMED_PRESETS = {
    "lattice-grains": "lattice",
    "lattice-outlines": "lattice",
    "lattice-lines": "lattice",
    "lattice-lines-maps": "lattice",
    "lattice-fibers": "lattice",
    "lattice-fibers-maps": "lattice",
    "lattice-veins": "lattice",
    "lattice-veins-maps": "lattice",
}
"""Accepted names of older presets."""
MEASURED = ("line_length", "line_length_below", "with_maps")
"""Refused older keys that made a table depend on the photographs."""
REMOVED = (
    "initial_phase",
    "early",
    "init",
    "start",
    "losses.patches",
    "optimizer.beta_with_critic",
)
"""Refused older keys of what the benchmark did not justify."""


class PresetError(SettingsError):
    """An invalid preset: the file, the field, found, expected."""


def shipped() -> list[str]:
    """Names of the presets that come with the package."""
    files = (f.name for f in _folder().iterdir())
    return sorted(name.removesuffix(SUFFIX) for name in files if name.endswith(SUFFIX))


def load_recipe(name: str, overrides: list[str] | None = None) -> Recipe:
    """Load `name` of a shipped preset or path of a TOML file; `overrides` are KEY.KEY=VALUE."""
    try:
        values = _tables(name, Path(), ())
        for override in overrides or []:
            values = _merged(values, _override(override, values))
        return validated(Recipe, values, name)
    except PresetError:
        raise
    except SettingsError as error:
        raise PresetError(str(error)) from error


def _folder() -> Traversable:
    return resources.files("solidtex_export") / "presets"


def _tables(name: str, beside: Path, extending: tuple[str, ...]) -> dict[str, Any]:
    """Tables of a preset, merged over those of the preset that it extends."""
    name = RENAMED_PRESETS.get(name, name)
    path: Path | Traversable = beside / name
    if name in shipped():
        path = _folder() / f"{name}{SUFFIX}"
    elif not (name.endswith(SUFFIX) and path.is_file()):
        where = f"{extending[-1]}: extends" if extending else "--preset"
        names = ", ".join(shipped())
        raise PresetError(f"{where}: found {name}, expected one of {names} or a {SUFFIX} file")
    name = str(path) if isinstance(path, Path) else name
    if name in extending:
        raise PresetError(f"{extending[-1]}: extends: found {name}, expected no circle")
    values = _renamed(read_toml(path), name)
    description, parent = values.pop("description", ""), values.pop("extends", None)
    if not isinstance(description, str):  # for those who read the file
        raise PresetError(f"{name}: description: found {show(description)}, expected a string")
    if parent is None:
        return values
    if not isinstance(parent, str):
        raise PresetError(f"{name}: extends: found {parent}, expected the name of a preset")
    folder = path.parent if isinstance(path, Path) else Path()
    return _merged(_tables(parent, folder, (*extending, name)), values)


def _merged(below: dict[str, Any], above: dict[str, Any]) -> dict[str, Any]:
    """Merge tables key by key; replace anything else."""
    merged = dict(below)
    for key, value in above.items():
        known = merged.get(key)
        if isinstance(known, dict) and isinstance(value, dict):
            value = _merged(known, value)
        merged[key] = value
    return merged


def _renamed(values: dict[str, Any], label: str, where: str = "") -> dict[str, Any]:
    """Tables with older keys renamed to today's."""
    found = {}
    for key, value in values.items():
        path = f"{where}.{key}" if where else key
        if key in MEASURED or path in REMOVED:
            reason = "it made no preset better (docs/experiments/ablation.md)"
            if key in MEASURED:
                reason = "a preset no longer depends on what is measured (docs/methods.md)"
            raise PresetError(
                f"{label}: {path}: found a key of an older version, expected none: {reason}"
            )
        if path == "losses" and isinstance(value, list):
            raise PresetError(
                f"{label}: losses: found an array, expected named tables: [losses.gram] in place"
                ' of [[losses]] with kind = "gram"'
            )
        key = RENAMED.get(path, key)
        inner = f"{where}.{key}" if where else key
        found[key] = _renamed(value, label, inner) if isinstance(value, dict) else value
    if found.get("kind") == "tones":
        found["kind"] = RENAMED["losses.tones"]
    return found


def _override(text: str, values: dict[str, Any]) -> dict[str, Any]:
    """Tables of one value: `optimizer.learning_rate=0.01` or `losses.gram.weight=2`."""
    key, equals, value = text.partition("=")
    *path, last = key.split(".")
    if not equals or not last:
        raise PresetError(f"--set: found {text}, expected KEY.KEY=VALUE")
    try:
        found: dict[str, Any] = {last: tomllib.loads(f"value = {value}")["value"]}
    except RecursionError as error:
        raise PresetError(f"--set: found {text[:60]} ..., expected less nesting") from error
    except tomllib.TOMLDecodeError:
        found = {last: value}  # a bare word
    for part in reversed(path):
        found = {part: found}
    if path[:1] == ["losses"] and path[-1].isdigit():
        names = ", ".join(values.get("losses", {}))
        raise PresetError(f"--set: found {text}, expected a loss by its name: {names}")
    return _renamed(found, "--set")
