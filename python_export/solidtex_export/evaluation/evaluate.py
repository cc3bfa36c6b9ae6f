"""Compares a subject with its exemplars and collects the contents of report and JSON."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any

import numpy as np
import torch

from solidtex_export.evaluation.comparison import (
    Distance,
    Reference,
    Settings,
    channel_groups,
    mean_distance,
)
from solidtex_export.evaluation.correspondence import as_colors, coherence, correspondence
from solidtex_export.evaluation.directions import directionality
from solidtex_export.evaluation.metrics.parzen import SIDES
from solidtex_export.evaluation.pictures import draw_cut_cube, luminance, random_crops, to_8_bit
from solidtex_export.evaluation.repetition import Repetition, repetition
from solidtex_export.evaluation.subjects import Subject, SubjectError, View, values
from solidtex_export.images.channels import COLOR
from solidtex_export.images.exemplar import Exemplar
from solidtex_export.images.sheet import sheet_of

VERSION = 1
CUBE_PIXELS = 380
COPY_SIDE = 64  # pixels of a slice that the exemplar is searched for
SHOWN = 256  # pixels: images in the report are cut to that


@dataclass
class Evaluation:
    """Result: `document` is the JSON, `pictures` [row, column, 3] by name the report's images."""

    document: dict[str, Any]
    pictures: dict[str, np.ndarray] = field(default_factory=dict)


def evaluate(subject: Subject, exemplars: list[Exemplar], settings: Settings) -> Evaluation:
    """Compute all metrics of a subject; both sides are reduced to their common channels."""
    start = time.monotonic()
    subject, images, channels = _shared_channels(subject, exemplars)
    smallest = min(min(p.shape[:2]) for v in subject.views for p in v.pictures)
    settings = replace(settings, side=min(settings.side, smallest))
    groups = channel_groups(channels)
    first = next(iter(groups.values()))
    result = Evaluation({"version": VERSION, "subject": subject.name, "channels": list(channels)})
    result.document["settings"] = _settings(settings, images)
    result.document["distances"] = {
        name: _distances(subject, images, indices, settings) for name, indices in groups.items()
    }
    shown = _reduced(subject, first)
    images = [image[..., first] for image in images]
    result.document["copying"] = _copying(shown, images, settings, result.pictures)
    result.document["repetition"] = _repetitions(shown, images)
    result.document["directions"] = _directions(shown, images, settings)
    _show(shown, images, result.pictures)
    result.document["seconds"] = round(time.monotonic() - start, 1)
    return result


def _shared_channels(
    subject: Subject, exemplars: list[Exemplar]
) -> tuple[Subject, list[np.ndarray], tuple[str, ...]]:
    available = exemplars[0].channels
    channels = tuple(c for c in subject.channels if c in available)
    if not channels:
        raise SubjectError(
            f"{subject.name}: found the channels {', '.join(subject.channels)}, expected some of"
            f" {', '.join(available)}, as in {exemplars[0].name}"
        )
    subject = _reduced(subject, [subject.channels.index(c) for c in channels])
    wanted = [available.index(c) for c in channels]
    raw = [values(e)[..., wanted] for e in exemplars]
    low, scale = _ranges(raw, channels)

    def normal(picture: np.ndarray) -> np.ndarray:
        return to_8_bit((picture - low) / scale)

    views = [View(v.name, [normal(p) for p in v.pictures], v.exemplar) for v in subject.views]
    blocks = [normal(block) for block in subject.blocks]
    return replace(subject, views=views, blocks=blocks), [normal(i) for i in raw], channels


def _ranges(images: list[np.ndarray], channels: tuple[str, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Offset and scale that map each channel to 0 ... 1; colors, and maps within it, stay."""
    pixels = np.concatenate([image.reshape(-1, len(channels)) for image in images])
    low, high = pixels.min(0).clip(max=0), pixels.max(0).clip(min=1)
    color = np.isin(channels, COLOR)
    return np.where(color, 0, low), np.where(color, 1, high - low)


def _reduced(subject: Subject, indices: list[int]) -> Subject:
    views = [View(v.name, [p[..., indices] for p in v.pictures], v.exemplar) for v in subject.views]
    return replace(subject, views=views, blocks=[b[..., indices] for b in subject.blocks])


def _settings(settings: Settings, images: list[np.ndarray]) -> dict[str, Any]:
    left_out = ("inception", "metrics")
    used = {key: value for key, value in asdict(settings).items() if key not in left_out}
    features = settings.features.name if settings.features else None
    sizes = [list(image.shape[1::-1]) for image in images]
    return used | {"features": features, "exemplar_sizes": sizes}


def _distances(
    subject: Subject, images: list[np.ndarray], indices: list[int], settings: Settings
) -> dict[str, Any]:
    """Distances on one group of channels: self-distances, those of the views, and their means."""
    references = [Reference(image[..., indices], settings) for image in images]
    views: dict[str, dict[str, Distance]] = {}
    likelihoods: dict[str, list[float]] = {}
    for view in subject.views:
        if view.exemplar is not None:
            pictures = [picture[..., indices] for picture in view.pictures]
            views[view.name] = references[view.exemplar].distances(pictures)
            likelihoods[view.name] = references[view.exemplar].likelihoods(pictures)
    names = [metric.name for metric in references[0].metrics]
    overall = {name: mean_distance([view[name] for view in views.values()]) for name in names}
    return {
        "titles": {metric.name: metric.title for metric in references[0].metrics},
        "crop_side": [reference.side for reference in references],
        "self": [reference.own for reference in references],
        "views": {n: {k: asdict(d) for k, d in view.items()} for n, view in views.items()},
        "overall": {name: asdict(distance) for name, distance in overall.items()},
        "likelihood": {
            "patch": list(SIDES),
            "self": [reference.own_likelihoods for reference in references],
            "views": likelihoods,
        },
    }


def _copying(
    subject: Subject,
    images: list[np.ndarray],
    settings: Settings,
    pictures: dict[str, np.ndarray],
) -> dict[str, Any]:
    """Coherence of the correspondence maps; for the exemplars, of one half with the other."""
    own = []
    for image in images:
        first, second = Reference(image, replace(settings, crops=1)).halves[0]
        own.append(coherence(correspondence(first[:COPY_SIDE, :COPY_SIDE], second)))
    views = {}
    for view in subject.views:
        if view.exemplar is not None:
            exemplar = images[view.exemplar]
            places = correspondence(view.pictures[0][:COPY_SIDE, :COPY_SIDE], exemplar)
            views[view.name] = coherence(places)
            pictures[f"map {view.name}"] = as_colors(places, exemplar.shape)
    places = np.moveaxis(np.indices(images[0].shape[:2]), 0, -1)
    pictures["map exemplar"] = as_colors(places, images[0].shape)[:SHOWN, :SHOWN]
    return {"self": own, "views": views}


def _repetitions(subject: Subject, images: list[np.ndarray]) -> dict[str, Any]:
    """Repetition of the exemplars, and of a model's blocks or of each image."""
    result: dict[str, Any] = {"self": [_record(repetition(luminance(image))) for image in images]}
    if subject.blocks:
        near, far = (luminance(block) for block in subject.blocks)
        return result | {
            "block": _record(repetition(near)),
            "far blocks": _record(repetition(near, far)),
        }
    for view in subject.views:
        found = [repetition(luminance(picture)) for picture in view.pictures]
        known = [r for r in found if r is not None]
        strongest = max(known, key=lambda r: r.deviations / r.allowed, default=None)
        result[view.name] = _record(strongest)
    return result


def _record(found: Repetition | None) -> dict[str, Any] | None:
    return None if found is None else {**asdict(found), "repeats": found.repeats}


def _directions(subject: Subject, images: list[np.ndarray], settings: Settings) -> dict[str, Any]:
    def of(pictures: list[np.ndarray]) -> dict[str, float]:
        side = min(settings.side, *(min(p.shape[:2]) for p in pictures))
        rng = np.random.default_rng(settings.seed)
        return asdict(directionality(random_crops(pictures, side, settings.crops, rng)))

    views = {view.name: of(view.pictures) for view in subject.views}
    return {"self": [of([image]) for image in images], "views": views}


def _show(subject: Subject, images: list[np.ndarray], pictures: dict[str, np.ndarray]) -> None:
    for index, image in enumerate(images):
        pictures[f"exemplar {index}"] = image[:SHOWN, :SHOWN]
    for view in subject.views:
        pictures[f"slice {view.name}"] = view.pictures[0][:SHOWN, :SHOWN]
    if subject.blocks:
        pictures["cube"] = draw_cut_cube(subject.blocks[0], CUBE_PIXELS)


def sheet(subject: Subject, exemplars: Sequence[Exemplar], side: int) -> np.ndarray:
    """Colors [row, column, 3]: exemplars and the first slice of each view, all cut to `side`.

    One row for the color, and one below it for each further common channel.
    """
    shared = tuple(c for c in exemplars[0].channels if c in subject.channels)
    known = [exemplars[0].channels.index(c) for c in shared]
    places = [subject.channels.index(c) for c in shared]
    cut = [view.pictures[0][:side, :side, places] for view in subject.views]
    slices = [torch.from_numpy(np.moveaxis(picture, -1, 0).copy()) for picture in cut]
    shown = [replace(e, image=e.image[known], channels=shared) for e in exemplars]
    return sheet_of(slices, shown, side).movedim(0, 2).numpy()
