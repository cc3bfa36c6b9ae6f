"""Images of labels: one channel for each phase, 1 where a pixel has its label."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from PIL import Image, ImageOps

from solidtex_export.images.channels import MAP_NAME, NAMED
from solidtex_export.images.exemplar import Crop, Exemplar, cropped, reduced
from solidtex_export.images.file_kinds import ExemplarError, refuse
from solidtex_export.images.photographs import Picture, read_picture
from solidtex_export.measuring.volumes import PHASE_PREFIX

MOST_PHASES = 8


def load_labels(
    paths: Sequence[Path],
    resolution: int,
    needed: int,
    crop: Crop | None,
    names: Sequence[str],
) -> list[Exemplar]:
    """Read sections of one solid as indicators of their phases, in the order of the labels.

    `names` are those of the phases; without any the labels serve. `resolution` and `needed` are as
    in load_exemplar: a reduced pixel has the share of each phase.
    """
    pictures = [_within(read_labels(path), crop) for path in paths]
    labels = _common_labels(pictures)
    names = list(names) or [str(label) for label in labels]
    if len(names) != len(labels):
        raise _refuse_count(names, pictures[0], labels)
    if len(set(names)) < len(names):
        raise ExemplarError(
            f"--phase-names: found a name twice in {','.join(names)}, expected a different one for"
            " each label"
        )
    for name in names:
        if not re.fullmatch(f"{MAP_NAME}|[0-9]+", name):
            raise ExemplarError(
                f"--phase-names: found {name!r} in {','.join(names)}, expected names of {NAMED}"
            )
    exemplars = []
    for picture in pictures:
        planes = [(picture.pixels[:, :, 0] == label).astype(np.float32) for label in labels]
        # A box gives shares of the covered pixels: no value overshoots.
        image, notes = reduced(picture.path, planes, resolution, needed, Image.Resampling.BOX)
        shares = (
            f"{label} is {PHASE_PREFIX}{name} ({100 * plane.mean():.1f} %)"
            for label, name, plane in zip(labels, names, planes, strict=True)
        )
        notes = (f"{picture.path}: labels of phases: {', '.join(shares)}", *notes)
        channels = tuple(PHASE_PREFIX + name for name in names)
        exemplars.append(
            Exemplar(picture.path.name, picture.sha256, image, channels, "data", notes=notes)
        )
    return exemplars


def _refuse_count(names: Sequence[str], picture: Picture, labels: Sequence[int]) -> ExemplarError:
    """Names for fewer or more labels than there are; the shares tell stray labels from phases."""
    shares = ", ".join(
        f"{label} ({100 * float((picture.pixels == label).mean()):.2g} %)" for label in labels
    )
    merge = ", or merge stray labels with others in the image" if len(names) < len(labels) else ""
    return ExemplarError(
        f"--phase-names: found {len(names)} ({','.join(names)}) for {picture.path} with"
        f" {len(labels)} labels {shares}, expected one for each label; give {len(labels)}"
        f" names{merge}"
    )


def _within(picture: Picture, crop: Crop | None) -> Picture:
    """What a crop leaves: a scale bar below it is no phase."""
    (pixels,) = cropped(picture, [picture.pixels], crop)
    return dataclasses.replace(picture, pixels=pixels)


def read_labels(path: Path) -> Picture:
    """Read a section. Of a palette with colors, the numbers of its entries are the labels."""
    picture = read_picture(path)
    if not has_color(picture.pixels):
        return picture
    with Image.open(path) as image:
        if image.mode != "P":
            return picture
        indices = np.asarray(ImageOps.exif_transpose(image))[:, :, None]
    return dataclasses.replace(picture, names=("Y",), pixels=indices)


def has_color(pixels: np.ndarray) -> bool:
    """Whether the channels of `pixels` [row, column, channel] differ anywhere."""
    return bool(np.any(pixels != pixels[:, :, :1]))


def _common_labels(pictures: Sequence[Picture]) -> list[int]:
    """The labels that every section has."""
    found = [_labels_of(picture) for picture in pictures]
    for picture, labels in zip(pictures, found, strict=True):
        for other, more in zip(pictures, found, strict=True):
            missing = [label for label in more if label not in labels]
            if missing and len(labels) == len(more):
                raise refuse(
                    picture.path,
                    f"the labels {_listed(labels)}, while {other.path} has {_listed(more)}",
                    "the same number for a phase in every section; renumber one of them",
                )
            if missing:
                raise refuse(
                    picture.path,
                    f"no pixel of the label {missing[0]}, which {other.path} has",
                    "every phase in every section: one solid has the same fractions in all"
                    " directions; crop larger sections or merge the label with another",
                )
    return found[0]


def _labels_of(picture: Picture) -> list[int]:
    pixels = picture.pixels
    if has_color(pixels):
        raise refuse(
            picture.path,
            "color",
            "labels of phases: one channel of integers; export them as 8-bit labels or with a"
            " palette of colors",
        )
    values = np.unique(pixels)
    if (values != np.rint(values)).any():
        raise refuse(
            picture.path,
            "values that are no integers",
            "labels of phases, such as 0, 1; segment the image first",
        )
    labels = [int(value) for value in values]
    if len(labels) > MOST_PHASES:
        raise refuse(
            picture.path,
            f"{len(labels)} values, {labels[0]} ... {labels[-1]}",
            f"labels of 2 to {MOST_PHASES} phases; segment a gray image first, or train without"
            " --phases",
        )
    if labels[0] < 0:
        raise refuse(picture.path, f"the label {labels[0]}", "labels from 0 on; renumber them")
    if len(labels) < 2:
        raise refuse(
            picture.path,
            f"the label {labels[0]} everywhere",
            "two or more phases; check the segmentation, or take a section that has all phases",
        )
    return labels


def _listed(labels: Sequence[int]) -> str:
    return ", ".join(map(str, labels))
