"""Which channels a picture gives a model, by name: albedo.r, albedo.g, albedo.b, roughness ..."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from solidtex_export.images.photographs import ExemplarError, Picture, refuse

COLOR: tuple[str, ...] = ("albedo.r", "albedo.g", "albedo.b")
MAX_CHANNELS = 64  # as many as a model file holds
RGB = ("R", "G", "B")
COLOR_OF = {"Y": COLOR} | {
    name: (channel,)
    for channel, letter in zip(COLOR, RGB, strict=True)
    for name in (letter, f"albedo.{letter}")
}
"""Which channels of a model a file's channel gives; Y is grey."""

MAP_NAME = "[A-Za-z][A-Za-z0-9_.-]*"
GREY_TOLERANCE = 2 / 255  # between channels of a grey map that was stored as colour

Channels = dict[str, np.ndarray]
"""Name -> values [row, column], float32, in the order of the model's channels."""


@dataclass(frozen=True)
class Group:
    """Channels that belong together: a colour's three, or one alone."""

    name: str  # "albedo", or the full name of a single channel
    indices: tuple[int, ...]


def groups(channels: Sequence[str]) -> list[Group]:
    """NAME.r, NAME.g and NAME.b are one group, wherever they stand; others are alone."""
    result = []
    for name in channels:
        color, _, part = name.rpartition(".")
        members = tuple(f"{color}.{letter}" for letter in "rgb")
        if part not in ("r", "g", "b") or not set(members) <= set(channels):
            result.append(Group(name, (channels.index(name),)))
        elif part == next(n for n in channels if n in members)[-1]:  # the first of the three
            result.append(Group(color, tuple(channels.index(n) for n in members)))
    return result


def photo_channels(photo: Picture, color_space: str) -> Channels:
    """Colours become albedo.*, encoded as `color_space` says; EXR may have any others beside."""
    found = f"the channels {', '.join(photo.names)}"
    if {"RY", "BY"} & set(photo.names):
        raise refuse(photo.path, found + " (luminance and chroma)", "R, G, B")
    result: Channels = {}
    for name in photo.names:
        for channel in COLOR_OF.get(name, (name,)):
            if channel in result:
                raise refuse(photo.path, f"{found}, of which two are {channel}", "one")
            values = photo.channel(name)
            if channel in COLOR:
                values = _encoded(values, photo.is_float, color_space)
            result[channel] = values
    missing = [c for c in COLOR if c not in result]
    if 0 < len(missing) < len(COLOR):
        raise refuse(photo.path, found, f"also {', '.join(missing)}")
    if photo.path.suffix.lower() != ".exr" and (missing or len(result) > len(COLOR)):
        raise refuse(photo.path, found, "grey or R, G, B")
    return result


def map_channels(name: str, picture: Picture) -> Channels:
    """A grey map is the channel `name`, a coloured one is name.r, name.g and name.b; plain data."""
    if len(picture.names) == 1:
        return {name: picture.values[:, :, 0]}
    if picture.names != RGB:
        found = f"the channels {', '.join(picture.names)}"
        raise refuse(picture.path, found, f"one, or R, G, B, for --map {name}")
    if np.ptp(picture.values, axis=2).max() <= GREY_TOLERANCE:
        return {name: picture.values.mean(axis=2)}
    return {f"{name}.{c.lower()}": picture.channel(c) for c in RGB}


def check_map_name(name: str) -> None:
    """Refuse a --map that cannot be a channel."""
    if not re.fullmatch(MAP_NAME, name):
        raise ExemplarError(f"found the name {name!r}, expected one such as roughness")
    if name.split(".")[0] == "albedo":
        raise ExemplarError(f"found {name}, expected another name: PHOTO is the albedo")


def check_channels(path: Path, names: Sequence[str]) -> None:
    """Refuse what no solid texture can have.

    A normal belongs to the one surface that it was measured on: other cuts through the solid have
    other tangents, and a flipped or turned crop would need its vectors turned too. A height can be
    had on every cut.
    """
    for name in names:
        if any(part.lower() in ("normal", "normals") for part in name.split(".")):
            raise refuse(path, f"the channel {name}", "none of normals; take a height map instead")
    if not 1 <= len(names) <= MAX_CHANNELS:
        raise refuse(path, f"{len(names)} channels", f"1 to {MAX_CHANNELS}")


def _encoded(values: np.ndarray, is_linear: bool, color_space: str) -> np.ndarray:
    """Colours of a file (float ones are linear, whole-number ones sRGB) as the model has them."""
    if is_linear and color_space == "srgb":
        return srgb_encode(values)
    if not is_linear and color_space == "linear":
        return srgb_decode(values)
    return values


def srgb_encode(linear: np.ndarray) -> np.ndarray:
    """IEC 61966-2-1; continued as a straight line below 0."""
    curve = 1.055 * np.maximum(linear, 0.0031308) ** (1 / 2.4) - 0.055
    return np.where(linear <= 0.0031308, 12.92 * linear, curve).astype(np.float32)


def srgb_decode(encoded: np.ndarray) -> np.ndarray:
    curve = ((np.maximum(encoded, 0.04045) + 0.055) / 1.055) ** 2.4
    return np.where(encoded <= 0.04045, encoded / 12.92, curve).astype(np.float32)
