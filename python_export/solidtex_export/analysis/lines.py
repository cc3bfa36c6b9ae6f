"""How long a photograph's thin lines are: veins, cracks and layers are long, grains are short.

Large early steps, in which each slice has its own statistics, draw long thin lines, and strokes or
bands of what is none. So a training has them where the photograph has such lines
(`early.line_length`), and with shorter lines it starts smooth at least (`start.line_length`).
Lengths in widths, with 100 to 144 pixels on the shorter side, and with more:

    marble 53 (400: 88), red veins 55, layered wood 53, zebrano 30 (256: 42)
    cracked mud 14, flagstones 10, oak 10, sandstone 8 (400: 3), grains 8 (256: 27), cracked rock 7,
    white veins on a mottled ground 6, porous rock 3 (256: 5), rust, lichen, paint and beige granite
    3 to 5, grey granite and brick 2

What the steps gave, 1500 of 96 x 96 from the smooth start, patterns along the axes and at 45
degrees (those of granite, rust and brick: methods/lattice.toml):

                    small steps   large steps
    marble          3.09, 2.47    2.42, 1.94   specks; lines, some dotted
    red veins       1.60, 1.95    1.48, 2.09   borders of patches; veins that join
    zebrano         5.43, 6.67    3.20, 3.84   wavy lumps; straight fibres
    flagstones      1.51, 2.62    1.63, 2.65   stones with joints; smaller ones along the axes
    white veins     0.95, 1.95    0.97, 2.33   veins; strokes
    cracked mud     1.13, 1.98    1.00, 1.62   crumbs; ragged crumbs
    veined slate    0.84, 1.43    0.76, 1.36   alike

Tried before: short trainings with large steps and with small ones, 300 steps each, the product of
losses deciding. Small steps were 4.6 to 6.0 times as far on marble, which needs large ones, but
2.9, 8.3 and 11 times on grey granite, by seed and threads, since they come slowly to it. Kurtosis
of the photograph's octaves, and how much its fine edges agree in direction, do not tell marble
from granite and brick either. Ridges by the second derivative do, but take the outline of a blob
for a line: porous rock at 256 pixels had 82, marble 53.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import black_tophat, gaussian_filter, label, white_tophat
from skimage.morphology import skeletonize

from solidtex_export.analysis.grain import channel_axes, whiten
from solidtex_export.images.exemplar import Exemplar

BLUR = 0.7  # pixels, of a Gaussian: keeps single noisy pixels from joining lines
SQUARE = 5  # pixels: lines are narrower
SHARE = 0.1  # of all pixels belong to lines

Plane = NDArray[np.float64]


def line_length(exemplars: Sequence[Exemplar]) -> float:
    """Length of thin lines in their widths, of the photograph where they are longest.

    Looks at the first principal axis of the channels. Bright lines are where an opening with a
    square of 5 x 5 pixels takes away most (the tenth of all pixels that it changes most), dark ones
    where a closing adds most; the longer of both count.
    """
    mean, basis = channel_axes(exemplars)
    planes = [whiten(e.image, mean, basis)[-1].double().numpy() for e in exemplars]
    smooth = [gaussian_filter(plane, BLUR) for plane in planes]
    found = [tophat(p, SQUARE) for p in smooth for tophat in (white_tophat, black_tophat)]
    return max(_length(strength) for strength in found)


def _length(strength: Plane) -> float:
    """Mean over pieces of length / width, each by its area; a piece's width is area / length.

    A length is that of the skeleton, so the mean is the sum of squared lengths over all area.
    """
    lines = strength > np.quantile(strength, 1 - SHARE)
    if not lines.any():
        return 0.0
    pieces, count = label(lines, np.ones((3, 3)))
    lengths = np.bincount(pieces[skeletonize(lines)], minlength=count + 1)
    return float((lengths**2).sum() / lines.sum())
