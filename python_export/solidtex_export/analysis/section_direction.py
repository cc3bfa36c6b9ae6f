"""Directions in a section of phases, which a solid from this section alone cannot have."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from solidtex_export.images.exemplar import Exemplar
from solidtex_export.measuring import geometry

PARTS = 4  # of each side: the scatter between parts tells what is certain
FEWEST = 8  # chords that a part needs to count
LEAST_RATIO = 1.1
CERTAIN = 3.0  # standard errors


def chord_ratio(mask: geometry.Mask) -> float | None:
    """Mean chord of a phase [row, column] along rows by that along columns, if it is sure not 1."""
    logarithms = []
    for band in np.array_split(mask, PARTS):
        for part in np.array_split(band, PARTS, axis=1):
            columns, rows = (geometry.chords(part, axis) for axis in (0, 1))
            if min(len(rows), len(columns)) >= FEWEST:
                logarithms.append(math.log(rows.mean() / columns.mean()))
    if len(logarithms) < PARTS:
        return None
    mean = float(np.mean(logarithms))
    error = float(np.std(logarithms, ddof=1)) / math.sqrt(len(logarithms))
    is_sure = abs(mean) > max(CERTAIN * error, math.log(LEAST_RATIO))
    return math.exp(mean) if is_sure else None


def with_direction_note(exemplar: Exemplar) -> Exemplar:
    """Add a note to the only section of a solid, if one of its phases has a direction."""
    ratios = {
        name: ratio
        for name, share in zip(exemplar.channels, exemplar.image.numpy(), strict=True)
        if (ratio := chord_ratio(share > 0.5))
    }
    if not ratios:
        return exemplar
    phase = max(ratios, key=lambda name: abs(math.log(ratios[name])))
    ratio = ratios[phase]
    longer, shorter = ("rows", "columns") if ratio > 1 else ("columns", "rows")
    note = (
        f"{exemplar.name}: chords of {phase} are {max(ratio, 1 / ratio):.2f} times as long along"
        f" {longer} as along {shorter}. A solid that shows one section from all directions cannot"
        " have that: --directions xy keeps the vertical, or give a section for each direction"
    )
    return replace(exemplar, notes=(*exemplar.notes, note))
