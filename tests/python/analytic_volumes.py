"""Volumes [x, y, z] whose figures are known."""

import numpy as np

RADIUS = 20.3


def ball(radius: float = RADIUS, side: int = 64) -> np.ndarray:
    at = np.indices((side,) * 3) - (side - 1) / 2
    return np.sqrt((at**2).sum(0)) < radius


def cylinder(radius: float, side: int = 64) -> np.ndarray:
    at = np.indices((side,) * 2) - (side - 1) / 2
    return np.repeat((np.hypot(*at) < radius)[:, :, None], side, 2)


def slabs(side: int = 32) -> np.ndarray:
    """Slabs across z: 4 voxels of the phase, 4 of the other."""
    return np.broadcast_to(np.arange(side) % 8 < 4, (side,) * 3).copy()
