"""A lit ball of gray stone, as docs/hosts/ shows it: seen along z, lit from one side."""

import numpy as np

from solidtex import Texture

RADIUS = 150  # in texels
DIRECTION = np.array([1, 2, 3]) / 14**0.5


def ball(width: int, height: int) -> tuple[np.ndarray, np.ndarray]:
    """Where a picture has its ball, as normals, and which pixels show it well inside."""
    rows, columns = np.mgrid[height - 0.5 : -0.5 : -1, 0.5:width]
    at = np.stack([2 * columns - width, 2 * rows - height], axis=-1) / height
    square = 1 - (at**2).sum(axis=-1)
    return np.dstack([at, np.sqrt(square.clip(0))]), square > 0.05


def shown(texture: Texture, normals: np.ndarray, texels: np.ndarray, radii: object) -> np.ndarray:
    """What the engine gives at `texels`, lit, as colors of sRGB."""
    albedo = texture.eval_points(texels, radii=radii).clip(0, 1) ** 2.2
    light = 0.3 + 0.9 * (normals @ DIRECTION).clip(0)
    return (light[:, None] * albedo).clip(0, 1) ** (1 / 2.2)
