"""Phases of a volume: the labels it has, or gray values on two sides of a threshold."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from solidtex_export.measuring.volumes import VolumeError

MOST_LABELS = 8


@dataclass(frozen=True)
class Phases:
    """Label of every voxel or pixel, the labels in order, and how they came about."""

    labels: NDArray[Any]
    names: tuple[int, ...]
    note: str

    def of(self, label: int) -> NDArray[np.bool_]:
        return np.asarray(self.labels == label)


def find_phases(values: NDArray[Any], threshold: float | None, what: str) -> Phases:
    """Take integers with few values as labels, other values as grays to be split in two."""
    distinct = _few_values(values)
    if threshold is None and distinct is not None:
        if len(distinct) < 2:
            raise VolumeError(
                f"{what}: found one label, {distinct[0]}, in every voxel, expected two or more"
            )
        note = f"{what}: labels {', '.join(map(str, distinct))}, as they are in the file"
        return Phases(values.astype(np.int64), distinct, note)
    chosen = _otsu(values, what) if threshold is None else threshold
    bright = values >= chosen
    if bright.all() or not bright.any():
        raise VolumeError(
            f"{what}: found all values {'above' if bright.all() else 'below'} the threshold"
            f" {chosen:g}, expected both sides: they are {values.min():g} to {values.max():g}"
        )
    by = "Otsu's method" if threshold is None else "--threshold"
    note = f"{what}: gray values; label 0 is below {chosen:g} (by {by}), label 1 the rest"
    return Phases(bright.astype(np.uint8), (0, 1), note)


def _few_values(values: NDArray[Any]) -> tuple[int, ...] | None:
    """The distinct integers of an array, None if there are many or they are no integers."""
    sample = np.unique(values.reshape(-1)[:: max(1, values.size // 65536)])
    if len(sample) > MOST_LABELS or (sample != np.round(sample)).any():
        return None
    if values.dtype.kind == "f" and (values != np.round(values)).any():
        return None
    distinct = np.unique(values)
    return tuple(int(value) for value in distinct) if len(distinct) <= MOST_LABELS else None


def _otsu(values: NDArray[Any], what: str) -> float:
    from skimage.filters import threshold_otsu

    if values.min() == values.max():
        raise VolumeError(f"{what}: found the same gray value everywhere, expected two phases")
    # skimage's threshold belongs to the lower class.
    threshold = float(threshold_otsu(values))
    above = values[values > threshold]
    return (
        float(above.min()) if values.dtype.kind in "ui" else float(np.nextafter(threshold, np.inf))
    )
