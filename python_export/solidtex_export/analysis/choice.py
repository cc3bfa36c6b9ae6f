"""Which of our two families suits a photograph, where the user does not say.

The lattice family has what has lines or outlines (analysis/lines.py, analysis/structure.py), and
what has no long grain along z where it serves two directions. The sampler has grains, and the
fibres of wood, which its noise is stretched along. 1000 steps of 96 x 96, patterns along the axes
and at 45 degrees, sliced Wasserstein distance of all, and by eye:

                     outlines   lattice             sampler
    grey granite     0.2        1.11, 2.90 (1500)   0.87, 0.87 (1500)
    rust             0.5        1.49, 2.89, 0.84    1.56, 1.76, 0.65   ragged, a weave; speckles
    broken rock      0.6        0.97, 2.84          0.94, 0.89         blurred; speckled
    lichen on rock   0.9        0.89, 1.82          0.85, 0.85         rows of blobs; grain
    dark pebbles     1.4        0.86, 1.75          1.02, 1.02         pebbles; moss
    chipped stone    1.8        0.90, 1.82          0.73, 0.78         chips; a granite
    dirt             2.4        1.22, 4.02          1.09, 1.13         blurred; sharp
    stained tissue   2.7        0.93, 0.90, 0.77    0.90, 0.85, 0.67   nuclei; clouds

These lattices were trained without spectra and interpolated trilinearly at 45 degrees. With spectra
and cubic convolution (engine/filter/reconstruction.h), 800 steps of 96 x 96 of photographs that
are reduced to 192:

    dirt             1.3        0.96, 1.35          1.45, 1.39         pale patches; even specks
    yellow rock      0.7        1.50, 1.76          1.59, 1.72         dark bands; clouds
    rust, uncropped  0.5        1.65, 1.52          1.29, 1.18         olive patches; a green glow

So outlines of 1.2 suffice for a lattice. Before, when lattices were blurred at 45 degrees, 3.5 did.

What looks different flipped or turned gets a lattice, since a sampler's random planes show it from
all sides. 1000 and 800 steps of 128 x 128, by eye: rock in layers has its layers by lattice on
slices normal to x and y, by sampler it is even specks; for pebbles that are lit from one side see
analysis/symmetry.py. Rock with red cracks (lines of 6.9, outlines 1) is a rock with short cracks by
lattice, a granite by sampler. Bedded sandstone has beds by lattice, clouds by sampler; grass tufts
and specks; weathered stone its upright streaks with a soft weave (1.21, 2.68), sharp grain without
streaks (1.56, 1.56); asphalt lit from one side is alike.

Lines of 5.5 to 9 widths come out as lines where they are much of what a photograph shows. Patterns
over all views, and by eye:

                     lines  outlines  lattice        sampler
    green rock       6.7    0.3       3.65           2.00   a weave with dark clouds; moss, no crack
    karst            8.1    0.25      2.89           1.23   clouds; a mottled rock, no crack
    cracked soil     6.1    0.9       1.60           0.96   short cracks; sand
    red-cracked rock 6.9    1.6       3.99           3.44   short cracks; a granite

(green rock from the smooth start is islands, without patches a mottled weave, 4.00.)

Of directions xy, the grain along z first:

                     grain  outlines  lattice             sampler
    sandstone        0.06   2.7       1.10, 4.14 (256)    2.84, 2.96   beds; patches
    bark             3.1    7.1       1.09, 1.95          3.66, 3.67   ridges; streaks
    columns of cells 3.6    -0.1      1.02, 1.29          3.16, 3.32   cells; fur
    brown wood       5.4    0.2       0.94, 1.79          1.83, 1.88   mottles; fibres
    oak              8.5    2.0       1.63, 2.64          5.99, 5.98   clouds, a weave; fibres
    zebrano          25     -1 to 3   1.87, 2.98 (1500)   5.77, 5.78   short fibres; long ones
    layered wood     28     3.9       1.92, 2.45 (1500)   1.84, 1.79   braids; layers

Brick, porous rock, spheres and rusted paint have 5 to 40 and need neighbours.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from solidtex_export.analysis.grain import grain_ratio
from solidtex_export.analysis.lines import line_length
from solidtex_export.analysis.structure import Distance, outlines
from solidtex_export.analysis.symmetry import Symmetry
from solidtex_export.images.exemplar import Exemplar

LATTICE, SAMPLER = "lattice", "sampler"
LONG_LINES, SHORT_LINES = 9.0, 5.5  # widths that thin lines are long
FAINT = 0.6  # outlines that short lines need for a lattice
LONG_GRAIN = 4.5
"""Structures along z that are so many times as long as across are fibres."""
OUTLINED = {"xyz": 1.2, "xy": 7.0}
"""Outlines that need a lattice, by the directions that a photograph serves: a sampler draws the
straight ones of wood, not those of a wall's bricks, of which a photograph has 8."""


class Choice(NamedTuple):
    """A method, and what was found on the photograph."""

    method: str
    reason: str


def suited(
    exemplar: Exemplar, directions: str, symmetry: Callable[[], Symmetry], distance: Distance
) -> Choice:
    """For one photograph in `directions` xyz or xy; `symmetry` measures in which orientations it
    may be shown, which is asked for xyz only; `distance` is that of our descriptor."""
    length = 0.0
    if directions == "xyz":
        shown, reason = symmetry()
        if shown != "all":
            return Choice(LATTICE, reason)
        length = line_length([exemplar])
        if length >= LONG_LINES:
            return Choice(LATTICE, f"lines of {length:.1f} widths, at least {LONG_LINES:g}")
    elif (grain := grain_ratio(exemplar)) < LONG_GRAIN:
        reason = f"grain {grain:.2f} times as long along z as across, below {LONG_GRAIN:g}"
        return Choice(LATTICE, reason)
    found = outlines(exemplar, distance)
    limit = FAINT if length >= SHORT_LINES else OUTLINED[directions]
    if found >= limit:
        return Choice(LATTICE, f"outlines {found:.1f}, at least {limit:g}")
    return Choice(SAMPLER, f"outlines {found:.1f}, below {limit:g}")
