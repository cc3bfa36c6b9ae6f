"""The picture beside a measured solid, at the solid's scale."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor
from torch.nn import functional

from solidtex_export.commands.evaluate import trained_reading, trained_record
from solidtex_export.export.file_format import model_file
from solidtex_export.images.channels import Reading
from solidtex_export.images.exemplar import Exemplar, load_exemplar
from solidtex_export.images.labels import has_color, load_labels, read_labels
from solidtex_export.measuring.models import is_model
from solidtex_export.measuring.section import Section
from solidtex_export.measuring.volumes import PHASE_PREFIX
from solidtex_export.measuring.voxels import VolumeError, VoxelSize
from solidtex_export.training.phases import fitting_shift

SMALLEST = 2  # pixels
BY_NEIGHBORS = 0.01  # of the shares of the pixels around, between equal shares


def read_exemplar(
    path: Path, volume: Path, voxel_size: VoxelSize, across: str | None
) -> tuple[Section, str]:
    """The picture, each pixel as large as a voxel, and a note that says so.

    A model knows how the picture of its training was cropped and reduced, and which directions it
    served. Of other pictures only the user knows the scale, and the axis `across`.
    """
    document = model_file.read(volume).document if is_model(volume) else {}
    training = document.get("training", {})
    record = trained_record(path, training)
    if record is None or "resolution" not in training:
        return Section(path.name, read_section(path), across or "z"), (
            f"{path.name}: a pixel is taken to be as large as a voxel, {voxel_size}; if the"
            " training reduced its photograph, reduce this picture alike first"
        )
    pixels = _trained_pixels(path, document, record)
    columns, rows = pixels.shape
    return Section(path.name, pixels, across or _trained_axis(training, record)), (
        f"{path.name}: as in the training of {volume.name}, {columns} x {rows} pixels, each as"
        f" large as a voxel, {voxel_size}"
    )


def read_section(path: Path) -> NDArray[Any]:
    """Pixels [x, y] of an image as a training reads its labels, the mean of colors."""
    pixels = read_labels(path).pixels
    section = pixels.mean(axis=2) if has_color(pixels) else pixels[:, :, 0]
    if min(section.shape) < SMALLEST:
        raise VolumeError(f"{path}: found {section.shape} pixels, expected at least 2 x 2")
    return np.ascontiguousarray(section.T)


def _trained_axis(training: dict[str, Any], record: dict[str, Any]) -> str:
    """The last of the axes whose slices were trained on the picture."""
    exemplars = training["exemplars"]
    served = str(training.get("directions", "xyz"))
    if len(exemplars) > 1:  # one for each direction
        served = served[exemplars.index(record) :][:1]
    return max((axis for axis in served if axis in "xyz"), default="z")


def _trained_pixels(path: Path, document: dict[str, Any], record: dict[str, Any]) -> NDArray[Any]:
    training = document["training"]
    crop = training.get("crop")
    scale = training["resolution"], SMALLEST, tuple(crop) if crop else None
    if document["channels"][0].startswith(PHASE_PREFIX):
        values = labels_of(load_labels([path], *scale, ())[0].image)
    else:
        space = "linear" if document["color_space"] == "linear" else "srgb"
        reading = trained_reading(record)
        own = {n: limits for n, limits in reading.ranges.items() if n == ""}  # not those of maps
        exemplar = load_exemplar(
            path, *scale, color_space=space, reading=Reading(own, reading.layer)
        )
        values = _grays(exemplar)
    return np.ascontiguousarray(values.T)


def labels_of(shares: Tensor) -> NDArray[np.uint8]:
    """The label of each pixel of `shares` [phase, row, column], as many of each as its shares are.

    A pixel of a reduced picture has a share of several phases. Were its label that of the largest
    share, a phase of small pieces would grow or shrink. So shares are shifted as the logits of a
    training are, where that comes nearer to the fractions of the picture.
    """
    if ((shares == 0) | (shares == 1)).all():  # not reduced
        return np.asarray(shares.argmax(0).numpy().astype(np.uint8))
    fractions = shares.mean((1, 2))
    around = functional.avg_pool2d(shares[None], 7, stride=1, padding=3, count_include_pad=False)
    ranked = shares + BY_NEIGHBORS * around[0]
    shift = fitting_shift(ranked.flatten(1), fractions)
    choices = [shares.argmax(0), (ranked + shift[:, None, None]).argmax(0)]

    def error(labels: Tensor) -> float:
        found = torch.bincount(labels.flatten(), minlength=len(shares)) / labels.numel()
        return float((found - fractions).abs().max())

    return np.asarray(min(choices, key=error).numpy().astype(np.uint8))


def _grays(exemplar: Exemplar) -> NDArray[Any]:
    """The mean of its colors, or its first channel, as of a model."""
    colors = [i for i, name in enumerate(exemplar.channels) if name.startswith("albedo.")] or [0]
    return exemplar.image[colors].mean(dim=0).numpy()
