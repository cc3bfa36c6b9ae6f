"""Distances between slices and an exemplar, absolute and relative to self-distance."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from solidtex_export.evaluation.metrics import Metric, standard_metrics
from solidtex_export.evaluation.metrics.parzen import SIDES, ParzenWindows
from solidtex_export.evaluation.pictures import crop_side, halvings, oriented, random_crops
from solidtex_export.images.channels import groups

NO_DISTANCE = 1e-9  # a smaller self-distance gives no relative one


@dataclass(frozen=True)
class Settings:
    """Settings of a comparison: crops of at most `side` pixels, `crops` in each set."""

    side: int = 96
    crops: int = 16
    symmetry: str = "none"
    seed: int = 0
    inception: Path | None = None
    features: Path | None = None
    metrics: tuple[str, ...] = ()
    """Names of the metrics to compute; all if empty."""


@dataclass(frozen=True)
class Distance:
    """A distance; `multiple` is relative to self-distance, None where that is 0."""

    value: float
    multiple: float | None


class Reference:
    """An exemplar [row, column, channel], cut into halves that are compared with each other.

    Self-distance is the distance between random crops of one half and as many of the other, which
    share no pixel. The distance of a synthesis is the mean of its distances to the two halves. A
    large exemplar is halved both ways, and the means are taken. All sets have the same number of
    crops of the same side.
    """

    def __init__(self, exemplar: np.ndarray, settings: Settings) -> None:
        self.exemplar = exemplar
        self.settings = settings
        self.side = crop_side(exemplar, settings.side)
        every = standard_metrics(exemplar, settings.inception, settings.features)
        self.metrics = [m for m in every if not settings.metrics or m.name in settings.metrics]
        self.halves = halvings(exemplar, self.side)
        rng = np.random.default_rng(settings.seed)  # other places in each half: it may be a tile
        self._crops = [tuple(self._draw([h], rng) for h in pair) for pair in self.halves]
        self._features = {m.name: self._features_of_halves(m) for m in self.metrics}
        self.own = {m.name: self._own_distance(m) for m in self.metrics}

    def distances(self, pictures: list[np.ndarray]) -> dict[str, Distance]:
        """Distance of slices to the exemplar by every metric."""
        crops = self._crops_of(pictures)
        return {metric.name: self._distance(metric, crops) for metric in self.metrics}

    def likelihoods(self, pictures: list[np.ndarray]) -> list[float]:
        """Average log-likelihood of patches of slices, by SIDES; the mean over the halves."""
        crops = self._crops_of(pictures)
        return [
            float(np.mean([kernels.average_log_likelihood(crops) for kernels in halves]))
            for halves in self._kernels
        ]

    @property
    def own_likelihoods(self) -> list[float]:
        """The same of each half, given the other half."""
        return [float(np.mean([k.held_out for k in halves])) for halves in self._kernels]

    @cached_property
    def _kernels(self) -> list[list[ParzenWindows]]:
        """By side of a patch: the density of each half."""
        orders = [(a, b) for pair in self._crops for a, b in (pair, pair[::-1])]
        return [[ParzenWindows(a, b, side) for a, b in orders] for side in SIDES]

    def _crops_of(self, pictures: list[np.ndarray]) -> np.ndarray:
        return self._draw(pictures, np.random.default_rng(self.settings.seed))

    def _draw(self, pictures: list[np.ndarray], rng: np.random.Generator) -> np.ndarray:
        crops = random_crops(pictures, self.side, self.settings.crops, rng)
        return oriented(crops, self.settings.symmetry)

    def _features_of_halves(self, metric: Metric) -> list[tuple]:
        return [tuple(metric.features(crops) for crops in pair) for pair in self._crops]

    def _own_distance(self, metric: Metric) -> float:
        pairs = self._features[metric.name]
        return float(np.mean([metric.distance(first, second) for first, second in pairs]))

    def _distance(self, metric: Metric, crops: np.ndarray) -> Distance:
        ours = metric.features(crops)
        halves = [half for pair in self._features[metric.name] for half in pair]
        value = float(np.mean([metric.distance(ours, half) for half in halves]))
        own = self.own[metric.name]
        return Distance(value, value / own if own > NO_DISTANCE else None)


def channel_groups(channels: tuple[str, ...]) -> dict[str, list[int]]:
    """Channels that are compared together: colors, each map alone, and all of them jointly."""
    result = {group.name: list(group.indices) for group in groups(channels)}
    if len(result) > 1:
        result["all channels"] = list(range(len(channels)))
    return result


def mean_distance(distances: list[Distance]) -> Distance:
    """Mean over views, also of relative distances where all views have one."""
    relative = [d.multiple for d in distances if d.multiple is not None]
    known = len(relative) == len(distances)
    value = float(np.mean([d.value for d in distances]))
    return Distance(value, float(np.mean(relative)) if known else None)
