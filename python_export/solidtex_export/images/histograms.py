"""Histogram matching of several photographs.

Gutierrez et al. 2020, section 7: "We experiment with and without performing a histogram matching
(independently for each color channel) to the input examples." Views of one solid should agree in
their colors, otherwise no solid has them all. Each channel of each photograph gets the mean of the
photographs' quantile functions, so none is preferred.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np
import torch

from solidtex_export.images.exemplar import Exemplar

LEVELS = 1025  # at which quantile functions are averaged


def share_histograms(exemplars: Sequence[Exemplar]) -> list[Exemplar]:
    """Photographs with one common histogram per channel; a single photograph stays unchanged."""
    if len(exemplars) == 1:
        return list(exemplars)
    levels = np.linspace(0, 1, LEVELS)
    images = [e.image.numpy().astype(np.float64) for e in exemplars]
    matched = [np.empty_like(image) for image in images]
    for channel in range(len(images[0])):
        quantiles = [np.quantile(image[channel], levels) for image in images]
        common = np.mean(quantiles, axis=0)
        for image, target in zip(images, matched, strict=True):
            target[channel] = np.interp(_ranks(image[channel]), levels, common)
    return [
        dataclasses.replace(e, image=torch.from_numpy(image).float())
        for e, image in zip(exemplars, matched, strict=True)
    ]


def _ranks(plane: np.ndarray) -> np.ndarray:
    """Each pixel's rank in 0 ... 1; equal values share their mean rank."""
    _, inverse, counts = np.unique(plane, return_inverse=True, return_counts=True)
    ends = np.cumsum(counts)
    middles = (ends - 1 + ends - counts) / 2 / max(plane.size - 1, 1)
    return middles[inverse].reshape(plane.shape)
