"""Rusted paint: a solid with color, roughness and height from the same fields."""

from __future__ import annotations

import numpy as np

from solidtex_export.images.channels import COLOR
from solidtex_export.research.solids.fractal import Fractal, smooth_step
from solidtex_export.research.solids.solid import MAPS, mixed


class RustedPaint:
    """Paint with rust holes, a raised lip along their border and stains beside it.

    The darker phase is rust: rough and low, where paint is smooth and high. One decaying field
    drives all channels, so every edge is at the same place in each.
    """

    channels = (*COLOR, *MAPS)
    threshold = 0.46
    directions = "xyz"
    paint = np.array([0.33, 0.58, 0.6]), np.array([0.52, 0.71, 0.69])  # fresh, faded
    rust = np.array([[0.2, 0.1, 0.07], [0.52, 0.26, 0.12], [0.66, 0.38, 0.17]])  # dark to bright
    border, softness = 0.35, 0.2  # of the decay, where paint gives way to rust

    def __init__(self, seed: int = 0) -> None:
        self._decay = Fractal(6.5, 3, 100 * seed)
        self._bends = [Fractal(4.5, 2, 100 * seed + 10 * i) for i in (1, 2, 3)]
        self._bumps = Fractal(1.1, 2, 100 * seed + 40)
        self._patches = Fractal(4.0, 3, 100 * seed + 50)
        self._wear = Fractal(8.0, 2, 100 * seed + 60)

    def __call__(self, points: np.ndarray) -> np.ndarray:
        bent = points + 1.6 * np.stack([bend(points) for bend in self._bends], axis=1)
        decay, bumps = self._decay(bent) - self.border, self._bumps(points)
        patches, wear = self._patches(points), self._wear(points)
        painted = smooth_step(-decay / self.softness)
        lip = np.exp(-np.square((decay + self.softness) / 0.18))
        stain = smooth_step(1 + decay / 1.2) * (0.4 + 0.27 * patches).clip(0, 1)

        coat = mixed((0.5 + 0.25 * wear + 0.03 * bumps).clip(0, 1), *self.paint)
        coat = mixed(0.6 * stain, coat, self.rust[1])
        tone = (0.42 + 0.2 * patches + 0.15 * bumps).clip(0, 1)
        rust = np.stack([np.interp(tone, (0, 0.5, 1), part) for part in self.rust.T], axis=1)
        smooth, rough = 0.3 + 0.05 * wear + 0.2 * stain, 0.82 + 0.04 * bumps
        high, low = 0.6 + 0.015 * wear, 0.3 + 0.06 * bumps + 0.03 * patches
        roughness = rough + painted * (smooth - rough)
        height = low + painted * (high - low) + 0.2 * lip
        values = np.column_stack([mixed(painted, rust, coat), roughness, height])
        return values.clip(0, 1)
