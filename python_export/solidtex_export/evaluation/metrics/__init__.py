"""Distances between sets of crops [crop, row, column, channel] (values 0 ... 1).

A metric converts a set of crops to features once, and compares features. Both sets have the same
number of crops of the same size.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, Protocol

import numpy as np

from solidtex_export.evaluation.metrics.autocorrelation import Autocorrelation
from solidtex_export.evaluation.metrics.fourier import FourierMagnitudes
from solidtex_export.evaluation.metrics.lbp import LbpDistance
from solidtex_export.evaluation.metrics.patches import SlicedWasserstein
from solidtex_export.evaluation.metrics.spectrum import PowerSpectrum


class Metric(Protocol):
    """A distance; `name` is its key in the JSON, `title` its title in reports."""

    name: str
    title: str

    def features(self, crops: np.ndarray) -> Any: ...

    def distance(self, first: Any, second: Any) -> float: ...


def standard_metrics(
    exemplar: np.ndarray, inception: Path | None = None, features: Path | None = None
) -> list[Metric]:
    """Metrics for an exemplar [row, column, channel].

    Those of networks only for three channels and with the file of their weights: `inception` for
    Inception v3, `features` for SqueezeNet.
    """
    metrics: list[Metric] = [
        LbpDistance(),
        Autocorrelation(),
        FourierMagnitudes(),
        SlicedWasserstein(exemplar),
        PowerSpectrum(),
    ]
    if inception is not None and exemplar.shape[2] == 3:
        from solidtex_export.evaluation.metrics.inception import SingleImageFrechet

        metrics.append(SingleImageFrechet(inception))
    if features is not None and exemplar.shape[2] == 3:
        from solidtex_export.evaluation.metrics.features import FeatureDistance, FeatureSifid
        from solidtex_export.networks.squeezenet import load_squeezenet

        network = load_squeezenet(features)
        metrics += [FeatureDistance(network, exemplar), FeatureSifid(network)]
    return metrics
