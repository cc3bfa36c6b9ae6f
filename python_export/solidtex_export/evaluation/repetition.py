"""Detects repetition of a solid: correlation at large lags, relative to chance."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from solidtex_export.evaluation.metrics.autocorrelation import covariance_by_lag

NEAR = 0.1  # a correlation below it is none: there a lag begins to be far
MARGIN = 3.0  # far means this many times that lag
ALARM = 2.0  # times what chance allows: see `Repetition.repeats`


@dataclass(frozen=True)
class Repetition:
    """Strongest correlation at a large lag.

    `correlation` is its coefficient, `lag` its offset (pixels, one per axis), `deviations` the
    coefficient in standard deviations of chance, `allowed` the expected maximum of that by chance
    over the independent lags, sqrt(2 ln n).
    """

    correlation: float
    lag: tuple[int, ...]
    deviations: float
    allowed: float

    @property
    def repeats(self) -> bool:
        """Whether the correlation exceeds twice the chance level; real textures have heavy tails.

        Fine grain has millions of independent lags, and 0.05 is many deviations there. That is the
        second ring of a blade of grass, not a visible repetition.
        """
        return self.deviations > ALARM * self.allowed and abs(self.correlation) >= NEAR


def repetition(values: np.ndarray, other: np.ndarray | None = None) -> Repetition | None:
    """Strongest correlation of `values`, one per pixel or voxel, at a large lag.

    With `other`, of the same shape and from far away, the strongest correlation between the two at
    any lag. Lags go up to half the extent. A coefficient that is zero but for chance has the
    variance sum_k rho(k)^2 / N by Bartlett (1946), N the number of pairs, the sum over small lags.
    None where no lag is large, as in a structure that is longer than the sample.
    """
    first = _normalized(values)
    largest = tuple(n // 2 for n in values.shape)
    own, count = covariance_by_lag(first, first, largest)
    near = _near(own)
    if other is None:
        rho, far = own, ~near
    else:
        rho, far = covariance_by_lag(first, _normalized(other), largest)[0], np.ones_like(near)
    if not far.any():
        return None
    spread = float(np.square(own[near]).sum())  # the voxels that one independent voxel stands for
    deviations = np.where(far, np.abs(rho) * np.sqrt(count / spread), 0)
    peak = np.unravel_index(int(np.argmax(deviations)), rho.shape)
    independent = max(far.sum() / spread, 2.0)
    return Repetition(
        correlation=float(rho[peak]),
        lag=tuple(int(p) - n for p, n in zip(peak, largest, strict=True)),
        deviations=float(deviations[peak]),
        allowed=float(np.sqrt(2 * np.log(independent))),
    )


def _normalized(values: np.ndarray) -> np.ndarray:
    centered = values.astype(np.float64) - values.mean()
    return centered / max(float(centered.std()), 1e-12)


def _near(rho: np.ndarray) -> np.ndarray:
    """Mask of the ellipsoid of small lags around lag 0."""
    inside = np.zeros(rho.shape)
    center = tuple(n // 2 for n in rho.shape)
    for axis, middle in enumerate(center):
        along = np.abs(np.moveaxis(rho, axis, -1)[(*np.delete(center, axis), slice(middle, None))])
        below = np.flatnonzero(along < NEAR)
        radius = MARGIN * max(int(below[0]), 1) if len(below) else np.inf
        lags = np.abs(np.arange(rho.shape[axis]) - middle) / radius
        inside += np.expand_dims(lags**2, [a for a in range(rho.ndim) if a != axis])
    return inside <= 1
