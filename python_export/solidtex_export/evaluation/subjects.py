"""Subjects of an evaluation: slices that the engine cuts from a model, or image files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from solidtex_export.export.file_format import model_file
from solidtex_export.export.verification import engine
from solidtex_export.generators.slices import SLICE_AXES
from solidtex_export.images.channels import COLOR
from solidtex_export.images.exemplar import Exemplar, check_alike, load_exemplar
from solidtex_export.images.srgb import srgb_encode

if TYPE_CHECKING:
    from solidtex import Texture

SLICES = 4  # of each view, each with twice the side of a crop
BLOCK = 128  # voxels: side of the cube and of the repetition test
FAR = 1 << 20  # texels: slices lie within this distance of the origin
FAR_BLOCK = (1 << 16, 0, 0)  # where the second block of the repetition test begins
SMALLEST_PICTURE = 32  # pixels: what the LBP distance and pyramids need
PICTURE_SUFFIXES = (".png", ".jpg", ".jpeg", ".tif", ".tiff", ".bmp", ".webp", ".exr")
UNLIMITED = 1 << 30  # a resolution that leaves images as they are


class SubjectError(ValueError):
    """A subject that cannot be evaluated; the message names the file."""


@dataclass(frozen=True)
class View:
    """Parallel slices [row, column, channel] of one kind.

    `exemplar` is the index of the exemplar that the slices are compared with, None without one.
    """

    name: str
    pictures: list[np.ndarray]
    exemplar: int | None


@dataclass(frozen=True)
class Subject:
    """Views of a subject; `blocks` are two distant cubes [x, y, z, channel], none for images."""

    name: str
    channels: tuple[str, ...]
    views: list[View]
    blocks: list[np.ndarray] = field(default_factory=list)


def from_model(path: Path, side: int, seed: int, compared: Mapping[str, int]) -> Subject:
    """Slices of `side` texels normal to x, y, z and oblique ones, at random places.

    `compared` has the exemplar's index for each view that has one.
    """
    document = model_file.read(path).document
    channels = tuple(document["channels"])
    rng = np.random.default_rng(seed)
    with engine.open_model(path, seed) as texture:
        views = {d: [_axis_slice(texture, d, side, rng) for _ in range(SLICES)] for d in SLICE_AXES}
        planes = _oblique_planes("z" if "z" not in compared else None, rng)
        views["oblique"] = [oblique_slice(texture, *plane, side, rng) for plane in planes]
        blocks = [texture.eval_box(origin, (BLOCK,) * 3) for origin in ((0, 0, 0), FAR_BLOCK)]
    if document["color_space"] == "linear":
        blocks = [_displayed(block, channels) for block in blocks]
        views = {n: [_displayed(p, channels) for p in pictures] for n, pictures in views.items()}
    return Subject(
        path.stem, channels, [View(n, v, compared.get(n)) for n, v in views.items()], blocks
    )


def _displayed(values: np.ndarray, channels: tuple[str, ...]) -> np.ndarray:
    """Linear colors encoded as sRGB, in which exemplars are compared."""
    color = np.isin(channels, COLOR)
    values[..., color] = srgb_encode(values[..., color])
    return values


def _axis_slice(
    texture: Texture, direction: str, side: int, rng: np.random.Generator
) -> np.ndarray:
    normal = "xyz".index(direction)
    extent = [side, side, side]
    extent[normal] = 1
    box = texture.eval_box(rng.integers(-FAR, FAR, 3).tolist(), extent)
    return box.squeeze(normal).swapaxes(0, 1)[::-1]  # rows run against their axis


Plane = tuple[np.ndarray, np.ndarray]
"""Unit vectors to the right and down."""


def _oblique_planes(grain: str | None, rng: np.random.Generator) -> list[Plane]:
    """Planes at 45 degrees between x and y, then random ones; with grain along z they contain z."""
    angles = np.pi * np.array([0.25, 0.75, *rng.uniform(0, 1, SLICES - 2)])
    upright = [(np.array([np.cos(a), np.sin(a), 0]), np.array([0, 0, -1.0])) for a in angles]
    if grain:
        return upright
    turns = [np.linalg.qr(rng.standard_normal((3, 3)))[0] for _ in range(SLICES - 1)]
    return [upright[0], *((turn[0], turn[1]) for turn in turns)]


def oblique_slice(
    texture: Texture, right: np.ndarray, down: np.ndarray, side: int, rng: np.random.Generator
) -> np.ndarray:
    steps = np.arange(side)[:, None]
    points = (steps * down)[:, None] + (steps * right)[None]
    values = texture.eval_points(points.reshape(-1, 3), rng.integers(-FAR, FAR, 3).tolist())
    return values.reshape(side, side, -1)


def compared_views(training: Mapping[str, Any], exemplars: int) -> dict[str, int]:
    """Index of the exemplar of each view, from the trained directions.

    Oblique slices are compared with one photograph that serves all directions or, with grain along
    z, with it on all planes that contain z.
    """
    directions = training.get("directions", "xyz")
    if exemplars not in (1, len(directions)):
        raise SubjectError(
            f"EXEMPLAR: found {exemplars}, expected 1, or {len(directions)}: one for each of the"
            f" trained directions {directions}"
        )
    views = {d: 0 if exemplars == 1 else i for i, d in enumerate(directions)}
    if exemplars == 1 and directions in ("xyz", "xy"):
        views["oblique"] = 0
    return views


def from_pictures(sources: Sequence[tuple[str, Path]]) -> Subject:
    """Slices from files: (view, image or folder of images), compared with the one exemplar."""
    views: dict[str, list[Exemplar]] = {}
    for name, path in sources:
        files = _pictures_in(path) if path.is_dir() else [path]
        pictures = [load_exemplar(file, UNLIMITED, SMALLEST_PICTURE) for file in files]
        views.setdefault(name, []).extend(pictures)
    every = [picture for pictures in views.values() for picture in pictures]
    check_alike(every)
    return Subject(
        sources[0][1].stem,
        every[0].channels,
        [View(n, [values(p) for p in pictures], 0) for n, pictures in views.items()],
    )


def values(picture: Exemplar) -> np.ndarray:
    """[row, column, channel]."""
    return picture.image.permute(1, 2, 0).numpy()


def _pictures_in(folder: Path) -> list[Path]:
    files = sorted(f for f in folder.iterdir() if f.suffix.lower() in PICTURE_SUFFIXES)
    if not files:
        raise SubjectError(f"{folder}: found no images, expected {', '.join(PICTURE_SUFFIXES)}")
    return files
