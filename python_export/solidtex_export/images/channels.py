"""Channels that an image gives a model, by name: albedo.r, albedo.g, albedo.b, roughness ..."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from solidtex_export.images.file_kinds import ExemplarError, refuse
from solidtex_export.images.photographs import Picture
from solidtex_export.images.srgb import srgb_decode, srgb_encode
from solidtex_export.images.value_range import Range, scaled

COLOR: tuple[str, ...] = ("albedo.r", "albedo.g", "albedo.b")
MAX_CHANNELS = 64  # as many as a model file holds
RGB = ("R", "G", "B")
COLOR_OF = {"Y": COLOR} | {
    name: (channel,)
    for channel, letter in zip(COLOR, RGB, strict=True)
    for name in (letter, f"albedo.{letter}")
}
"""Model channels of a file's channel; Y is gray."""

COLOR_LETTERS = {letter: letter for letter in "rgby"} | {"red": "r", "green": "g", "blue": "b"}
NOT_COLOR = {"n", "normal", "normals", "p", "position", "motion", "velocity", "vector", "uv"}
"""Words in the name of a layer with vectors in R, G, B."""
DEPTH = ("z", "zback", "depth", "depth.z")

MAP_NAME = "[A-Za-z][A-Za-z0-9_.-]*"
NAMED = "letters, digits, _, . and -, a letter first"
GRAY_TOLERANCE = 2 / 255  # between channels of a gray map that was stored as color

Channels = dict[str, np.ndarray]
"""Name -> values [row, column], float32, in the order of the model's channels."""


@dataclass(frozen=True)
class Group:
    """Channels that belong together: the three of a color, or a single one."""

    name: str  # "albedo", or the full name of a single channel
    indices: tuple[int, ...]


def groups(channels: Sequence[str]) -> list[Group]:
    """Groups of channels: NAME.r, NAME.g and NAME.b in any order, others alone."""
    result = []
    for name in channels:
        color, _, part = name.rpartition(".")
        members = tuple(f"{color}.{letter}" for letter in "rgb")
        if part not in ("r", "g", "b") or not set(members) <= set(channels):
            result.append(Group(name, (channels.index(name),)))
        elif part == next(n for n in channels if n in members)[-1]:  # the first of the three
            result.append(Group(color, tuple(channels.index(n) for n in members)))
    return result


@dataclass(frozen=True)
class Reading:
    """Conversion of pixels to channels that the command line requests: --range and --layer."""

    ranges: Mapping[str, Range] = field(default_factory=dict)
    """Ranges by the name of the map; "" is the photograph's color."""
    layer: str | None = None
    """Layer or part of an EXR file, by name."""

    def record(self) -> dict[str, Any]:
        """Record of the requested conversion for results and models; empty where nothing was
        requested.
        """
        ranges = {n: r if isinstance(r, str) else list(r) for n, r in self.ranges.items()}
        said = {"ranges": ranges, "layer": self.layer}
        return {name: value for name, value in said.items() if value}

    @staticmethod
    def of_record(record: Mapping[str, Any]) -> Reading:
        ranges = record.get("ranges", {}).items()
        return Reading(
            {n: r if isinstance(r, str) else (r[0], r[1]) for n, r in ranges}, record.get("layer")
        )


AS_IS = Reading()


@dataclass(frozen=True)
class Read:
    """Channels, and notes on what reading changed or found unusual."""

    channels: Channels
    notes: list[str]


def photo_channels(photo: Picture, color_space: str, reading: Reading = AS_IS) -> Read:
    """Read colors as albedo.*, encoded in `color_space`; an EXR may have other channels too."""
    found = f"the channels {', '.join(photo.names)}"
    if {"RY", "BY"} & set(photo.names):
        raise refuse(
            photo.path,
            found + " (luminance and chroma)",
            "R, G, B; save it as RGB",
        )
    sources, notes = _sources(photo, reading.layer)
    given = [channel for channels in sources.values() for channel in channels]
    twice = [channel for channel in given if given.count(channel) > 1]
    if twice:
        raise refuse(photo.path, f"{found}, of which two are {twice[0]}", "one")
    missing = [c for c in COLOR if c not in given]
    if 0 < len(missing) < len(COLOR):
        raise refuse(photo.path, found, f"also {', '.join(missing)}")
    if photo.format != "openexr" and (missing or len(given) > len(COLOR)):
        raise refuse(photo.path, found, "gray or R, G, B")
    if missing:
        notes.append(f"found no color in {found}: the model will have no albedo")
    result = {c: photo.channel(name) for name, channels in sources.items() for c in channels}
    colors = [name for name, channels in sources.items() if set(channels) <= set(COLOR)]
    if colors:
        color = scaled(photo, colors, reading.ranges.get(""), "--range ")
        notes += color.notes
        for name, values in zip(colors, np.moveaxis(color.values, 2, 0), strict=True):
            for channel in sources[name]:
                result[channel] = _encoded(values, color.is_linear, color_space)
    return Read(result, notes)


Sources = dict[str, tuple[str, ...]]
"""Name in the file -> channels of the model that it gives."""


def _sources(photo: Picture, layer: str | None) -> tuple[Sources, list[str]]:
    """Channels of the only color layer; without layers the color and everything but depth."""
    names = photo.names
    layers = color_layers(names)
    has_color = any(name in COLOR_OF for name in names)
    if layer is not None and layer not in layers and (layer != photo.part or not has_color):
        known = ", ".join(layers) or "none"
        raise refuse(photo.path, f"--layer {layer}", f"a layer with color: {known}")
    if layer not in layers and (has_color or not layers):
        depth = [name for name in names if name.lower() in DEPTH]
        if len(depth) == len(names):
            found = f"only the channel {', '.join(depth)} (distance from the camera)"
            raise refuse(photo.path, found, "color (R, G, B), or properties of the material")
        ignored = f"ignores {', '.join(depth)}: distance from the camera is no property of a solid"
        return {n: COLOR_OF.get(n, (n,)) for n in names if n not in depth}, [ignored] * bool(depth)
    if layer is None and len(layers) > 1:
        found = f"several layers with color: {', '.join(layers)}"
        raise refuse(photo.path, found, "one; choose it by --layer NAME")
    chosen = layer if layer is not None else next(iter(layers))
    others = [name for name in names if name not in layers[chosen]]
    note = f"takes {', '.join(layers[chosen])} as the albedo"
    return layers[chosen], [note + (f", ignores {', '.join(others)}" if others else "")]


def color_layers(names: Sequence[str]) -> dict[str, Sources]:
    """Layers of an EXR file with color: LAYER.R, LAYER.G, LAYER.B, or LAYER.Y."""
    found: dict[str, dict[str, str]] = {}
    for name in names:
        layer, _, last = name.rpartition(".")
        words = set(layer.lower().replace(".", " ").replace("_", " ").split())
        if name not in COLOR_OF and last.lower() in COLOR_LETTERS and not words & NOT_COLOR:
            found.setdefault(layer, {})[COLOR_LETTERS[last.lower()]] = name
    result: dict[str, Sources] = {}
    for layer, parts in found.items():
        if set(parts) >= set("rgb"):
            result[layer] = {parts[c[-1]]: (c,) for c in COLOR}
        elif "y" in parts:
            result[layer] = {parts["y"]: COLOR}
    return result


def map_channels(name: str, picture: Picture, asked: Range | None = None) -> Read:
    """Read a map as plain data: gray as channel `name`, color as name.r, name.g and name.b."""
    if len(picture.names) > 1 and picture.names != RGB:
        found = f"the channels {', '.join(picture.names)}"
        raise refuse(picture.path, found, f"one, or R, G, B, for --map {name}")
    read = scaled(picture, picture.names, asked, f"--range {name}=", is_map=True)
    values = read.values
    if len(picture.names) == 1:
        return Read({name: values[:, :, 0]}, read.notes)
    if np.ptp(values, axis=2).max() <= GRAY_TOLERANCE:
        return Read({name: values.mean(axis=2)}, read.notes)
    return Read({f"{name}.{c.lower()}": values[:, :, i] for i, c in enumerate(RGB)}, read.notes)


def check_map_name(name: str) -> None:
    """Refuse a --map that cannot be a channel."""
    if not re.fullmatch(MAP_NAME, name):
        raise ExemplarError(f"found the name {name!r}, expected {NAMED}, such as roughness")
    if name.split(".")[0] == "albedo":
        raise ExemplarError(f"found {name}, expected another name: PHOTO is the albedo")


def check_channels(path: Path, names: Sequence[str]) -> None:
    """Refuse channels that no solid texture can have.

    A normal belongs to the one surface where it was measured: other cuts through the solid have
    other tangents, and a flipped or turned crop would need turned vectors. A height exists on every
    cut.
    """
    for name in names:
        if any(part.lower() in ("normal", "normals") for part in name.split(".")):
            raise refuse(path, f"the channel {name}", "none of normals; take a height map instead")
    if not 1 <= len(names) <= MAX_CHANNELS:
        raise refuse(path, f"{len(names)} channels", f"1 to {MAX_CHANNELS}")


def _encoded(values: np.ndarray, is_linear: bool, color_space: str) -> np.ndarray:
    """Encode a file's colors (floats are linear, integers sRGB) in the color space of the model."""
    if is_linear and color_space == "srgb":
        return srgb_encode(values)
    if not is_linear and color_space == "linear":
        return srgb_decode(values)
    return values
