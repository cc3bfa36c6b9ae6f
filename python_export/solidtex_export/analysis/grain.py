"""Principal axes of an exemplar's channels, and the elongation of its grain."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import torch
from scipy.ndimage import gaussian_filter
from torch import Tensor

from solidtex_export.images.channels import groups
from solidtex_export.images.exemplar import Exemplar

MIN_AXIS_RATIO = 0.15  # of the largest: keeps a gray stone's faint hues from being amplified
SHADE = 1 / 8  # of the shorter side: deviation of the Gaussian whose average is taken for shade
HIDDEN = 2.0  # times as far from 1: a grain ratio without shade that counts
CONSTANT = 1e-3  # a channel that varies by less than this share of its size counts as constant


def channel_axes(exemplars: Sequence[Exemplar]) -> tuple[Tensor, Tensor]:
    """Mean m [channel] and axes B [channel, channel]: channels = m + B y, y of unit variance.

    The color as a whole and every other channel are first scaled to unit deviation, so that units
    do not matter: a roughness that hardly varies counts as much as a height in millimeters. Then
    the principal axes of all channels are scaled to unit variance.

    Joint axes let a generator start with the exemplar's correlations between maps, and make
    exceptions stand out: where an edge of the color has no edge of the roughness, y on a small axis
    is large.

    A floor limits the amplification of faint axes (the hues of a gray stone) to 1/0.15.
    """
    values = torch.cat([e.image.flatten(1) for e in exemplars], dim=1).double()
    mean = values.mean(1)
    scales = block_scales(values, exemplars[0].channels)
    eigenvalues, vectors = torch.linalg.eigh(torch.atleast_2d(torch.cov(values / scales[:, None])))
    deviations = eigenvalues.clamp_min(1e-8).sqrt()
    deviations = deviations.clamp_min(MIN_AXIS_RATIO * float(deviations.max()))
    return mean.float(), (scales[:, None] * vectors * deviations).float()


def block_scales(values: Tensor, channels: Sequence[str]) -> Tensor:
    """Standard deviation of each channel of `values` [channel, pixel]. The channels of a color
    share the largest of theirs.

    One scale for a color (albedo.r, albedo.g ...) keeps the proportions of its channels.
    """
    floor = CONSTANT * values.abs().amax(1).clamp_min(1e-6)
    scales = torch.maximum(values.std(1), floor)
    for group in groups(channels):
        indices = list(group.indices)
        scales[indices] = scales[indices].max()
    return scales


def whiten(image: Tensor, mean: Tensor, basis: Tensor) -> Tensor:
    """Inverse of the color affine, for an image [channel, row, column]."""
    centered = (image - mean[:, None, None]).flatten(1).double()
    return torch.linalg.solve(basis.double(), centered).float().view_as(image)


def grain_ratio(exemplar: Exemplar) -> float:
    """Length of structures along columns of pixels relative to their width; 1 without grain.

    Shade across a photograph hides its grain. So the ratio counts that is measured without shade,
    where that is much farther from 1: see docs/experiments/ablation.md.
    """
    plain, flat = grain_ratios(exemplar)
    return flat if abs(np.log(flat)) > abs(np.log(plain)) + np.log(HIDDEN) else plain


def grain_ratios(exemplar: Exemplar) -> tuple[float, float]:
    """The grain ratio of the photograph, and without its shade."""
    image = _scaled(exemplar)
    return _length_ratio(image), _length_ratio(_without_shade(image))


def grain_width(exemplar: Exemplar) -> float:
    """Width of structures in pixels: the shorter correlation length of rows and of columns."""
    return min(_correlation_lengths(_scaled(exemplar)))


def _scaled(exemplar: Exemplar) -> Tensor:
    """Channels of about unit deviation."""
    scales = block_scales(exemplar.image.flatten(1), exemplar.channels)
    return exemplar.image / scales[:, None, None]


def _without_shade(image: Tensor) -> Tensor:
    sigma = SHADE * min(image.shape[1:])
    shade = [gaussian_filter(plane, sigma, mode="nearest") for plane in image.numpy()]
    return image - torch.from_numpy(np.stack(shade))


def _length_ratio(image: Tensor) -> float:
    along, across = _correlation_lengths(image)
    return along / across if across > 0 < along else 1.0


def _correlation_lengths(image: Tensor) -> tuple[float, float]:
    """Along columns and along rows of pixels."""
    return _correlation_length(image.transpose(1, 2)), _correlation_length(image)


def _correlation_length(image: Tensor) -> float:
    """Distance along rows at which the mean squared difference is half that of unrelated pixels."""
    half = float(image.var((1, 2)).mean())
    previous = 0.0
    for lag in range(1, image.shape[2] // 2):
        difference = float((image[:, :, lag:] - image[:, :, :-lag]).square().mean())
        if difference >= half:
            return lag - 1 + (half - previous) / max(difference - previous, 1e-12)
        previous = difference
    return image.shape[2] / 2
