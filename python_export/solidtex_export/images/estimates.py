"""Height and roughness estimated from one photograph: plausible maps, not measured ones.

Height: what is darker than its surroundings is taken for deeper, at every scale up to an eighth of
the photograph; larger differences are taken for uneven light. Roughness: what is bright without
color is taken for a highlight, so for smooth. Neither has a unit, and paint of two tones on a flat
board gets a relief. docs/experiments/estimated-maps.md has how near they come.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
from PIL import Image
from scipy import ndimage

from solidtex_export.images.channels import COLOR, Reading, photo_channels
from solidtex_export.images.file_kinds import refuse
from solidtex_export.images.photographs import Picture, read_picture
from solidtex_export.whole_file import replacing

METHOD = "estimated from the photograph, method 1"
"""What results record of such a map. Another method gets another number."""

LARGEST_PART = 8
"""Scales up to this part of the shorter side are relief; larger ones are light."""
SCALE_POWER = 0.5
"""How much larger structures are taken for higher: their scale to this power."""
HIGHLIGHT_SIGMA = 2.0
LUMINANCE = np.array([0.2126, 0.7152, 0.0722], np.float32)
ENDS = (1.0, 99.0)
"""Percentiles that become the ends of the map's range."""
HEIGHT_RANGE = (0.0, 1.0)
ROUGHNESS_RANGE = (0.3, 0.9)


def estimate_height(colors: np.ndarray) -> np.ndarray:
    """Height [row, column], 0 ... 1, of sRGB-encoded colors [row, column, 3]."""
    luminance = _level(colors @ LUMINANCE)
    largest = min(luminance.shape) / LARGEST_PART
    sigma, finer = 1.0, _blurred(luminance, 1.0)
    height = luminance - finer
    while sigma < largest:
        coarser = _blurred(luminance, 2 * sigma)
        height += (finer - coarser) * sigma**SCALE_POWER
        sigma, finer = 2 * sigma, coarser
    return _stretched(height, HEIGHT_RANGE)


def estimate_roughness(colors: np.ndarray) -> np.ndarray:
    """Roughness [row, column], 0.3 ... 0.9, of sRGB-encoded colors [row, column, 3]."""
    return _stretched(-_blurred(colors.min(axis=2), HIGHLIGHT_SIGMA), ROUGHNESS_RANGE)


METHODS: dict[str, Callable[[np.ndarray], np.ndarray]] = {
    "height": estimate_height,
    "roughness": estimate_roughness,
}


def write_estimates(
    photo: Path, names: list[str], folder: Path, reading: Reading
) -> dict[str, Path]:
    """Estimate maps of a photograph as 16-bit PNG files in `folder`; return them by name.

    A file that exists is kept: the name has the photograph's hash, and a training that is resumed
    must read the same map, also when it was touched up.
    """
    picture = read_picture(photo, reading.layer)
    colors = _colors(picture, reading)
    files = {name: folder / f"{photo.stem}-{picture.sha256[:8]}-{name}.png" for name in names}
    folder.mkdir(parents=True, exist_ok=True)
    for name, file in files.items():
        if file.exists():
            continue
        values = (METHODS[name](colors) * 65535).round().astype(np.uint16)
        with replacing(file) as temporary:
            Image.fromarray(values).save(temporary, format="PNG")
    return files


def _colors(picture: Picture, reading: Reading) -> np.ndarray:
    channels = photo_channels(picture, "srgb", reading).channels
    if COLOR[0] not in channels:
        raise refuse(picture.path, f"the channels {', '.join(channels)}", "color for --estimate")
    return np.stack([channels[name] for name in COLOR], axis=-1).clip(0, 1)


def _level(plane: np.ndarray) -> np.ndarray:
    """A plane without its linear slope, which is uneven light."""
    rows, columns = (np.linspace(-1, 1, n, dtype=np.float32) for n in plane.shape)
    for axis, ramp in ((1, rows), (0, columns)):
        slope = plane.mean(axis=axis) @ ramp / (ramp @ ramp)
        plane = plane - slope * np.expand_dims(ramp, axis)
    return plane


def _blurred(plane: np.ndarray, sigma: float) -> np.ndarray:
    """A plane blurred by three boxes, near a Gaussian; the time does not grow with sigma."""
    width = 2 * round(sigma) + 1  # three of them have about the variance sigma^2 + sigma
    for _ in range(3):
        plane = ndimage.uniform_filter(plane, width, mode="reflect")
    return plane


def _stretched(values: np.ndarray, limits: tuple[float, float]) -> np.ndarray:
    """Values with ENDS at the limits, clamped; a constant gets the middle."""
    low, high = np.percentile(values, ENDS)
    if high - low < 1e-6:
        return np.full_like(values, sum(limits) / 2)
    part = ((values - low) / (high - low)).clip(0, 1)
    return limits[0] + part * (limits[1] - limits[0])
