"""Line elongation: length of a photograph's thin lines, relative to their width.

Veins, cracks and layers are long, grains are short: docs/experiments/line-elongation.md.
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


def line_elongation(exemplars: Sequence[Exemplar]) -> float:
    """Line elongation of the photograph with the longest lines.

    The first principal axis of the channels is measured. Bright lines are the tenth of all pixels
    that an opening with a square of 5 x 5 pixels darkens most, dark lines the tenth that a closing
    brightens most. The longer of both count.
    """
    mean, basis = channel_axes(exemplars)
    planes = [whiten(e.image, mean, basis)[-1].double().numpy() for e in exemplars]
    smooth = [gaussian_filter(plane, BLUR) for plane in planes]
    found = [tophat(p, SQUARE) for p in smooth for tophat in (white_tophat, black_tophat)]
    return max(_length(strength) for strength in found)


def _length(strength: Plane) -> float:
    """Mean of length / width over the connected pieces, weighted by area; width is area / length.

    The length of a piece is that of its skeleton, so the mean is the sum of squared lengths divided
    by the total area.
    """
    lines = strength > np.quantile(strength, 1 - SHARE)
    if not lines.any():
        return 0.0
    pieces, count = label(lines, np.ones((3, 3)))
    lengths = np.bincount(pieces[skeletonize(lines)], minlength=count + 1)
    return float((lengths**2).sum() / lines.sum())
