"""Statistical comparison of the images of two renderers, by the noise of independent renders.

Images are cut into blocks, whose means are nearly normal, also where pixels are not. In each of
them Welch's t-test compares the two means of a channel by the variance among the renders. Three
tests look at all blocks together, each at a third of the level: the largest deviation (Bonferroni),
the sum of squares (chi-square: much that is a little wrong), and the signed sum (a change that is
the same everywhere, such as the brightness of a light). Channels are nearly copies of each other,
so that the sums take their mean.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import stats

BLOCK = 6  # pixels


@dataclass
class Verdict:
    """p-values: how probable as large a difference is for equal renderers."""

    largest: float
    squares: float
    signed: float
    brightness: float  # of the second image over the first

    @property
    def p_value(self) -> float:
        return min(1.0, 3 * min(self.largest, self.squares, self.signed))


def block_means(images: np.ndarray) -> np.ndarray:
    """[renders, height, width, channels] to [renders, blocks, channels]."""
    n, height, width, channels = images.shape
    rows, columns = height // BLOCK, width // BLOCK
    cut = images[:, : rows * BLOCK, : columns * BLOCK].astype(np.float64)
    blocks = cut.reshape(n, rows, BLOCK, columns, BLOCK, channels).mean(axis=(2, 4))
    return blocks.reshape(n, rows * columns, channels)


def deviations(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Welch's t for each column of [renders, values], as standard normal deviates."""
    difference = second.mean(0) - first.mean(0)
    parts = [group.var(0, ddof=1) / len(group) for group in (first, second)]
    error = np.sqrt(sum(parts))  # black must be black
    freedom = sum(parts) ** 2 / sum(
        np.maximum(part**2, 1e-300) / (len(group) - 1)
        for part, group in zip(parts, (first, second), strict=True)
    )
    t = difference / np.maximum(error, 1e-30)
    p = np.clip(2 * stats.t.sf(np.abs(t), np.maximum(freedom, 1)), 1e-300, 1)
    return np.sign(difference) * stats.norm.isf(p / 2)


def compare(first: np.ndarray, second: np.ndarray) -> Verdict:
    """Of two stacks of independent renders, [renders, height, width, channels]."""
    a, b = block_means(first), block_means(second)
    each = np.abs(deviations(a.reshape(len(a), -1), b.reshape(len(b), -1)))
    gray = deviations(a.mean(axis=2), b.mean(axis=2))
    return Verdict(
        largest=float(min(1.0, each.size * 2 * stats.norm.sf(each.max()))),
        squares=float(stats.chi2.sf(np.sum(gray**2), gray.size)),
        signed=float(2 * stats.norm.sf(abs(gray.sum()) / np.sqrt(gray.size))),
        brightness=float(b.mean() / a.mean()),
    )
