"""Chooses a preset for one photograph where the user names none.

The limits come from trainings on the validation photographs, that of layers from a drawn solid:
docs/experiments/ablation.md.
"""

from __future__ import annotations

from typing import NamedTuple

from solidtex_export.analysis.measurements import Measurements

LATTICE, SAMPLER = "lattice", "sampler"

LONG_LINES = 9.0
"""Line elongation from which a photograph has lines, which a sampler does not draw. On the
validation photographs it is below 9 or above 11.
"""
FINE_GRAIN = 1.5
"""Grain width in pixels up to which a sampler draws a photograph better than a lattice, whose
values between texels are interpolated.
"""
LONG_GRAIN = 3.7
"""Grain ratio from which structures are fibers. Barks of the validation photographs have at most
3.0, woods more than 6; another wood, of 3.8, had no fibers by a lattice.
"""
LONG_LAYERS = 5.0
"""Length of layers relative to their thickness from which a sampler draws them better. A lattice is
better at 3.9; woods with lying grain begin at 6.
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
    """Choose a preset for one photograph in directions xyz or xy.

    A sampler's random planes show a photograph in all orientations, and its noise can be stretched
    along z or normal to it.
    """
    if measured.directions == "xy":
        grain, layers = measured.grain, 1 / measured.grain
        if layers >= LONG_LAYERS:
            reason = f"layers {layers:.2f} times as long as thick, at least {LONG_LAYERS:g}"
            return _preset(SAMPLER, reason)
        chosen, limit = (SAMPLER, "at least") if grain >= LONG_GRAIN else (LATTICE, "below")
        reason = f"grain {grain:.2f} times as long along z as across, {limit} {LONG_GRAIN:g}"
        return _preset(chosen, reason)
    width = measured.grain_width
    if width > FINE_GRAIN:
        return _preset(LATTICE, f"grain {width:.1f} pixels wide, more than {FINE_GRAIN:g}")
    lines = measured.line_elongation
    if lines >= LONG_LINES:
        return _preset(LATTICE, f"line elongation {lines:.1f}, at least {LONG_LINES:g}")
    chosen = LATTICE if measured.symmetry.name != "all" else SAMPLER
    return _preset(chosen, measured.symmetry.reason)


def _preset(name: str, reason: str) -> Choice:
    return Choice("preset", name, reason)
