"""Exemplars: a photograph with its maps, and random crops of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import torch
from PIL import Image
from torch import Tensor

from solidtex_export.images.channels import (
    AS_IS,
    COLOR,
    RGB,
    Reading,
    check_channels,
    map_channels,
    photo_channels,
)
from solidtex_export.images.file_kinds import ExemplarError, refuse
from solidtex_export.images.photographs import Picture, read_picture, write_exr
from solidtex_export.images.srgb import srgb_decode

Crop = tuple[int, ...]
"""x, y, width, height in pixels of the image."""


@dataclass(frozen=True)
class Exemplar:
    """A photograph and its maps at training resolution: `image` [channel, row, column].

    albedo.* are encoded as `color_space` says ("data" without any), in 0 ... 1 unless a float image
    exceeds it; other channels are the plain data of their files. `maps` has the file name and
    SHA-256 of each map.
    """

    name: str
    sha256: str
    image: Tensor
    channels: tuple[str, ...] = COLOR
    color_space: str = "srgb"
    maps: dict[str, dict[str, str]] = field(default_factory=dict)
    reading: Reading = AS_IS
    notes: tuple[str, ...] = ()
    """What reading changed or found unusual: one line each, beginning with the file."""

    def record(self) -> dict[str, Any]:
        """Record of the files and of how they were read, for results and models."""
        said = {"maps": self.maps, "reading": self.reading.record()}
        return {"file": self.name, "sha256": self.sha256} | {k: v for k, v in said.items() if v}


def load_exemplar(
    path: Path,
    resolution: int,
    needed: int,
    crop: Crop | None = None,
    maps: Mapping[str, Path] | None = None,
    color_space: str = "srgb",
    reading: Reading = AS_IS,
) -> Exemplar:
    """Read a photograph and its maps, reduced so that the shorter side has at most `resolution`.

    All channels are cropped and reduced alike, so they stay registered. `needed` is the shortest
    side that training can use, in pixels; `maps` are further files of the same size, by name.
    """
    photo = read_picture(path, reading.layer)
    read = photo_channels(photo, color_space, reading)
    channels, notes = read.channels, _notes(photo, read.notes)
    records = {}
    for name in reading.ranges:
        if name and name not in (maps or {}):
            raise ExemplarError(f"--range: found a range for {name}, expected one of a --map")
    for name, file in (maps or {}).items():
        picture = read_picture(file)
        if picture.size != photo.size:
            raise refuse(
                file, "{} x {} pixels".format(*picture.size),
                "{} x {}, the size of {}".format(*photo.size, path),
            )  # fmt: skip
        if picture.origin != photo.origin:
            raise refuse(
                file, "a data window that begins at {}, {}".format(*picture.origin),
                "{}, {}, as in {}".format(*photo.origin, path),
            )  # fmt: skip
        map_read = map_channels(name, picture, reading.ranges.get(name))
        notes += _notes(picture, map_read.notes)
        for channel, values in map_read.channels.items():
            if channel in channels:
                raise refuse(file, f"a second channel {channel}", f"one, and {path} has it")
            channels[channel] = values
        records[name] = {"file": file.name, "sha256": picture.sha256}
    check_channels(path, list(channels))
    planes = cropped(photo, list(channels.values()), crop)
    if COLOR[0] not in channels:
        color_space = "data"
    image, reduction = reduced(path, planes, resolution, needed, Image.Resampling.LANCZOS)
    notes += reduction
    return Exemplar(
        path.name, photo.sha256, image, tuple(channels), color_space, records, reading, notes
    )


def _notes(picture: Picture, more: list[str]) -> tuple[str, ...]:
    return tuple(f"{picture.path}: {note}" for note in (*picture.notes, *more))


def check_alike(exemplars: Sequence[Exemplar]) -> None:
    """Refuse photographs with different channels."""
    first = exemplars[0]
    for other in exemplars[1:]:
        if other.channels != first.channels:
            raise ExemplarError(
                f"{other.name}: found the channels {', '.join(other.channels)}, expected"
                f" {', '.join(first.channels)}, as in {first.name}"
            )


def cropped(photo: Picture, planes: list[np.ndarray], crop: Crop | None) -> list[np.ndarray]:
    if crop is None:
        return planes
    (x, y, width, height), (columns, rows) = crop, photo.size
    if x < 0 or y < 0 or x + width > columns or y + height > rows:
        raise ExemplarError(
            f"{photo.path}: --crop: found {x},{y},{width},{height}, expected a region of"
            f" {columns} x {rows} pixels"
        )
    return [plane[y : y + height, x : x + width] for plane in planes]


def reduced(
    path: Path,
    planes: Sequence[np.ndarray],
    resolution: int,
    needed: int,
    resampling: Image.Resampling,
) -> tuple[Tensor, tuple[str, ...]]:
    """Channels [row, column] as an image whose shorter side has at most `resolution` pixels, and a
    note if it is reduced. Refuses images that have fewer than `needed` pixels on a side.
    """
    rows, columns = planes[0].shape
    if min(rows, columns) < needed:
        raise ExemplarError(
            f"{path}: found {columns} x {rows} pixels, expected at least"
            f" {needed} x {needed} (the size of a training slice; see --size)"
        )
    factor = resolution / min(rows, columns)
    if factor >= 1:
        return torch.from_numpy(np.stack(planes)), ()
    size = (round(columns * factor), round(rows * factor))
    resized = [np.array(Image.fromarray(plane).resize(size, resampling)) for plane in planes]
    note = (
        f"{path}: {columns} x {rows} pixels reduced to {size[0]} x {size[1]} (a texel is"
        f" {1 / factor:.4g} pixels wide); --resolution {min(rows, columns)} keeps them"
    )
    return torch.from_numpy(np.stack(resized)), (note,)


def save_image(image: Tensor, path: Path) -> None:
    """Write sRGB-encoded colors [3, row, column] as an 8-bit PNG."""
    pixels = (image.clamp(0, 1) * 255).round().byte().permute(1, 2, 0).cpu().numpy()
    Image.fromarray(pixels).save(path)


def save_channels(exemplar: Exemplar, path: Path) -> None:
    """Write all channels as a float EXR with linear colors; reading it gives the same exemplar."""
    planes = []
    for name, plane in zip(exemplar.channels, exemplar.image.numpy(), strict=True):
        encoded = name in COLOR and exemplar.color_space == "srgb"
        planes.append(srgb_decode(plane) if encoded else plane)
    names = [dict(zip(COLOR, RGB, strict=True)).get(n, n) for n in exemplar.channels]
    write_exr(path, names, np.stack(planes, axis=-1))


def random_symmetry(images: Tensor, symmetry: str) -> Tensor:
    """Images [batch, channel, rows, columns], all in a random orientation of `symmetry`."""
    if symmetry == "none":
        return images
    dims = [d for d in (2, 3) if torch.rand(()) < 0.5]
    images = images.flip(dims) if dims else images
    if symmetry == "all" and torch.rand(()) < 0.5:
        images = images.transpose(2, 3)
    return images


def random_crops(image: Tensor, count: int, rows: int, columns: int) -> Tensor:
    """`count` random crops [count, channel, rows, columns], smaller where the image is smaller."""
    rows, columns = min(rows, image.shape[1]), min(columns, image.shape[2])
    crops = []
    for _ in range(count):
        r = int(torch.randint(image.shape[1] - rows + 1, ()))
        c = int(torch.randint(image.shape[2] - columns + 1, ()))
        crops.append(image[:, r : r + rows, c : c + columns])
    return torch.stack(crops)
