"""Mean and principal axes of a photograph's colors. libsolidtex computes the same."""

from __future__ import annotations

import numpy as np
import torch
from torch import Tensor

MIN_AXIS_RATIO = 0.15  # of the largest: keeps a gray stone's faint hues from being amplified
MIN_VARIANCE = 1e-8


def color_axes(image: Tensor) -> tuple[Tensor, Tensor]:
    """Mean m [3] and basis B [3, 3] of an image [3, row, column]: colors = m + B y.

    Axes are sorted by descending variance. Each points to where the sum of the channels grows, so
    that the first axis of most photographs is lightness.
    """
    values = image.flatten(1).double()
    return values.mean(1).float(), _basis(torch.cov(values).numpy())


def _basis(covariance: np.ndarray) -> Tensor:
    variances, vectors = np.linalg.eigh(covariance)
    variances, vectors = variances[::-1], vectors[:, ::-1]
    vectors = vectors * np.where(vectors.sum(0) < 0, -1.0, 1.0)
    deviations = np.sqrt(np.maximum(variances, MIN_VARIANCE))
    deviations = np.maximum(deviations, MIN_AXIS_RATIO * deviations[0])
    return torch.from_numpy(vectors * deviations).float()
