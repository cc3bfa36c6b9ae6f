"""The picture beside a measured solid, at the solid's scale."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from solidtex_export.commands.evaluate import trained_reading, trained_record
from solidtex_export.export.file_format import model_file
from solidtex_export.images.channels import Reading
from solidtex_export.images.exemplar import Exemplar, load_exemplar
from solidtex_export.images.labels import load_labels
from solidtex_export.measuring.section import Section, read_section
from solidtex_export.measuring.volumes import PHASE_PREFIX, is_model
from solidtex_export.measuring.voxels import VoxelSize

SMALLEST = 2  # pixels


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
        exemplar = load_labels([path], *scale, ())[0]
        values = exemplar.image.numpy().argmax(axis=0).astype(np.uint8)
    else:
        space = "linear" if document["color_space"] == "linear" else "srgb"
        reading = trained_reading(record)
        own = {n: limits for n, limits in reading.ranges.items() if n == ""}  # not those of maps
        exemplar = load_exemplar(
            path, *scale, color_space=space, reading=Reading(own, reading.layer)
        )
        values = _grays(exemplar)
    return np.ascontiguousarray(values.T)


def _grays(exemplar: Exemplar) -> NDArray[Any]:
    """The mean of its colors, or its first channel, as of a model."""
    colors = [i for i, name in enumerate(exemplar.channels) if name.startswith("albedo.")] or [0]
    return exemplar.image[colors].mean(dim=0).numpy()
