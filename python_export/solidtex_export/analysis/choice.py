"""Chooses a preset for photographs where the user names none.

The limits come from trainings: docs/experiments/lattice-or-sampler.md and lattice-preset.md.
"""

from __future__ import annotations

from typing import NamedTuple

from solidtex_export.analysis.measurements import Measurements

LATTICE, SAMPLER = "lattice", "sampler"
LATTICES = (
    "lattice-grains",
    "lattice-outlines",
    "lattice-lines",
    "lattice-lines-maps",
    "lattice-veins",
    "lattice-veins-maps",
    "lattice-fibers",
    "lattice-fibers-maps",
)
"""Presets that `lattice` stands for, by the measured property."""

# Line elongations of a photograph for a lattice, in widths of its lines.
OUTLINES, LINES, VEINS = 3.3, 9.0, 15.0
# Of a photograph for either family.
LONG_LINES, SHORT_LINES = 9.0, 5.5
MIN_SHORT_SCORE = 0.6  # structure score that short lines need for a lattice
LONG_GRAIN = 4.5  # ratio of length to width from which structures are fibers
MIN_SCORE = {"xyz": 1.2, "xy": 7.0}
"""Smallest structure score that needs a lattice, by the directions of the photograph. A sampler
draws the straight outlines of wood, but not those of a brick wall, which score 8.
"""


class Choice(NamedTuple):
    """The chosen value of an option, and the measurements behind it."""

    option: str
    value: str
    reason: str

    @property
    def sentence(self) -> str:
        return f"{self.reason}, so --{self.option} {self.value}"


def choose_preset(measured: Measurements) -> Choice:
    """Choose the family for one photograph in directions xyz or xy."""
    elongation = 0.0
    if measured.directions == "xyz":
        if measured.symmetry.name != "all":
            return _preset(LATTICE, measured.symmetry.reason)
        elongation = measured.line_elongation
        if elongation >= LONG_LINES:
            return _preset(LATTICE, f"line elongation {elongation:.1f}, at least {LONG_LINES:g}")
    elif (grain := measured.grain) < LONG_GRAIN:
        reason = f"grain {grain:.2f} times as long along z as across, below {LONG_GRAIN:g}"
        return _preset(LATTICE, reason)
    score = measured.structure_score
    limit = MIN_SHORT_SCORE if elongation >= SHORT_LINES else MIN_SCORE[measured.directions]
    if score >= limit:
        return _preset(LATTICE, f"structure score {score:.1f}, at least {limit:g}")
    return _preset(SAMPLER, f"structure score {score:.1f}, below {limit:g}")


def choose_lattice(measured: Measurements, symmetry: str) -> Choice:
    """Choose the lattice preset for photographs that are shown in these orientations."""
    elongation = round(measured.line_elongation, 1)
    reason = f"line elongation {elongation:g}, symmetry {symmetry}"
    reason += ", maps" if measured.has_maps else ""
    return _preset(lattice_preset(elongation, symmetry, measured.has_maps), reason)


def lattice_preset(elongation: float, symmetry: str, has_maps: bool) -> str:
    """Name of the lattice preset for the measured properties.

    Longer lines need larger first steps, lines in all directions a smooth start. Patches are
    compared where there are lines and no maps.
    """
    if elongation >= VEINS:
        name = "lattice-veins" if symmetry == "all" else "lattice-fibers"
    elif elongation >= LINES and symmetry == "all":
        name = "lattice-lines"
    else:
        return "lattice-outlines" if elongation >= OUTLINES and not has_maps else "lattice-grains"
    return f"{name}-maps" if has_maps else name


def _preset(name: str, reason: str) -> Choice:
    return Choice("preset", name, reason)
