"""Fréchet distance of normal distributions, and their means and covariances from few samples."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np


class Moments(NamedTuple):
    """Mean [channel] and covariance [channel, channel] of feature vectors."""

    mean: np.ndarray
    covariance: np.ndarray


def shrunk_moments(vectors: np.ndarray) -> Moments:
    """Moments of vectors [sample, channel], with the covariance shrunk towards a sphere.

    The share of the sphere is that of oracle approximating shrinkage (Chen et al. 2010). It
    vanishes with many samples, and with fewer samples than channels no eigenvalue stays 0.
    """
    count, channels = vectors.shape
    covariance = np.cov(vectors, rowvar=False, bias=True)
    total, squares = np.trace(covariance), np.square(covariance).sum()
    rest = squares - total**2 / channels
    share = 1.0
    if rest > 0:
        estimate = (1 - 2 / channels) * squares + total**2
        share = min(1.0, estimate / ((count + 1 - 2 / channels) * rest))
    sphere = total / channels * np.eye(channels)
    return Moments(vectors.mean(0), (1 - share) * covariance + share * sphere)


def frechet_distance(
    mean_a: np.ndarray, covariance_a: np.ndarray, mean_b: np.ndarray, covariance_b: np.ndarray
) -> float:
    """Squared Fréchet distance of two normal distributions.

    The trace of (C_a C_b)^(1/2) is that of the root of a symmetric matrix, which has no negative or
    complex eigenvalues.
    """
    values, vectors = np.linalg.eigh(covariance_a)
    root = vectors * np.sqrt(values.clip(0)) @ vectors.T
    cross = np.sqrt(np.linalg.eigvalsh(root @ covariance_b @ root).clip(0)).sum()
    traces = np.trace(covariance_a) + np.trace(covariance_b)
    return float(np.square(mean_a - mean_b).sum() + max(traces - 2 * cross, 0.0))
