"""Phases of a volume: the labels it has, or gray values on two sides of a threshold."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from solidtex_export.measuring.voxels import VolumeError

MOST_LABELS = 8
LARGEST = 2**53  # label: larger integers are not exact as floats
RARE = 1e-3  # fraction below which a label may be a stray one


@dataclass(frozen=True)
class Phases:
    """Label of every voxel or pixel, the labels in order, and how they came about."""

    labels: NDArray[Any]
    names: tuple[int, ...]
    note: str
    words: tuple[str, ...] = ()
    """Names of the labels 0, 1, 2 ... by the material; empty if they are unknown."""
    warnings: tuple[str, ...] = ()

    @property
    def notes(self) -> list[str]:
        return [self.note, *self.warnings]

    def of(self, label: int) -> NDArray[np.bool_]:
        return np.asarray(self.labels == label)

    def title(self, label: int) -> str:
        """How a report names a label: "pore (0)", or "0" without a name."""
        word = self.words[label] if 0 <= label < len(self.words) else str(label)
        return f"{word} ({label})" if word != str(label) else word


def find_phases(
    values: NDArray[Any], threshold: float | None, what: str, words: tuple[str, ...] = ()
) -> Phases:
    """Take integers with few values as labels, other values as grays to be split in two.

    `words` are names of the labels 0, 1, 2 ...
    """
    distinct = _few_values(values)
    if threshold is None and distinct is not None:
        if len(distinct) < 2:
            raise VolumeError(
                f"{what}: found one label, {distinct[0]}, in every voxel, expected two or more;"
                " check the segmentation, or take a part that has both phases"
            )
        if max(map(abs, distinct)) > LARGEST:
            raise VolumeError(
                f"{what}: found the value {max(distinct, key=abs):.6g}, expected labels up to 2^53;"
                " give voxels without data a label of their own, such as 255, or crop them"
            )
        found = Phases(values.astype(np.int64), distinct, "", words)
        titles = ", ".join(map(found.title, distinct))
        return replace(found, note=f"{what}: labels {titles}", warnings=_rare_labels(found, what))
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


def _rare_labels(phases: Phases, what: str) -> tuple[str, ...]:
    shares = {label: float(phases.of(label).mean()) for label in phases.names}
    return tuple(
        f"warning: {what}: found the label {phases.title(label)} in {100 * share:.2g} % of all"
        " values; if it is a stray one, merge it with another label"
        for label, share in shares.items()
        if share < RARE
    )


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
