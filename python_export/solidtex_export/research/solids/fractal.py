"""Fields with detail on several scales, and a soft threshold for them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from solidtex_export.research.solids.random_parts import GaussianField


@dataclass
class Fractal:
    """Sum of Gaussian fields, each half as long and half as strong; variance about 1."""

    length: float
    octaves: int
    seed: int

    def __post_init__(self) -> None:
        self._fields = [
            GaussianField((self.length / 2**i,) * 3, self.seed + i) for i in range(self.octaves)
        ]
        self._scale = np.sqrt(sum(0.25**i for i in range(self.octaves)))

    def __call__(self, points: np.ndarray) -> np.ndarray:
        return sum(0.5**i * field(points) for i, field in enumerate(self._fields)) / self._scale


def smooth_step(t: np.ndarray) -> np.ndarray:
    """0 up to t = 0, 1 from t = 1, smooth between."""
    t = t.clip(0, 1)
    return t * t * (3 - 2 * t)
