"""Whether a solid repeats itself: correlation far away, beside what chance allows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from solidtex_export.evaluation.metrics.autocorrelation import covariance_by_lag

NEAR = 0.1  # a correlation below it is none: there a lag begins to be far
MARGIN = 3.0  # far means this many times that lag
ALARM = 2.0  # times what chance allows: see `Repetition.repeats`


@dataclass(frozen=True)
class Repetition:
    """The strongest far correlation.

    `correlation` is its coefficient, `lag` where it is (pixels, one per axis), `deviations` how
    many standard deviations of chance that is, `allowed` how many the largest of so many
    independent lags has by chance, sqrt(2 ln n).
    """

    correlation: float
    lag: tuple[int, ...]
    deviations: float
    allowed: float

    @property
    def repeats(self) -> bool:
        """Twice what chance allows: real textures are not quite normal, their tails are heavier.

        Fine grain has millions of independent lags, of which 0.05 is many deviations: the second
        ring of a blade of grass, but nothing that an eye would find again.
        """
        return self.deviations > ALARM * self.allowed and abs(self.correlation) >= NEAR


def repetition(values: np.ndarray, other: np.ndarray | None = None) -> Repetition | None:
    """The strongest correlation between far places of `values`, one value per pixel or voxel.

    With `other`, of the same shape and from far away, the strongest correlation between the two at
    any lag. Lags go up to half the extent. The variance of a far coefficient that is zero but for
    chance is sum_k rho(k)^2 / N by Bartlett (1946), N the number of pairs, the sum over near lags.
    None where everything is near, as in a solid that is longer than what was looked at.
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
    centred = values.astype(np.float64) - values.mean()
    return centred / max(float(centred.std()), 1e-12)


def _near(rho: np.ndarray) -> np.ndarray:
    """The ellipsoid around lag 0 outside of which lags are far."""
    inside = np.zeros(rho.shape)
    centre = tuple(n // 2 for n in rho.shape)
    for axis, middle in enumerate(centre):
        along = np.abs(np.moveaxis(rho, axis, -1)[(*np.delete(centre, axis), slice(middle, None))])
        below = np.flatnonzero(along < NEAR)
        radius = MARGIN * max(int(below[0]), 1) if len(below) else np.inf
        lags = np.abs(np.arange(rho.shape[axis]) - middle) / radius
        inside += np.expand_dims(lags**2, [a for a in range(rho.ndim) if a != axis])
    return inside <= 1
