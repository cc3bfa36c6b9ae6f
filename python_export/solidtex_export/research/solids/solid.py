"""Interface of an analytic solid, and its slices and samples."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Protocol

import numpy as np
from PIL import Image

from solidtex_export.evaluation.pictures import luminance
from solidtex_export.export.verification.model_output import check_output
from solidtex_export.images.channels import COLOR
from solidtex_export.whole_file import write_whole

CHUNK = 1 << 16  # points evaluated at a time: bounds the memory
MAPS = ("roughness", "height")


class Solid(Protocol):
    """A function of points [n, 3] in texels; `channels` names its values, which are 0 ... 1.

    `threshold` divides the solid into two phases: where luminance is at least that, and the rest.
    `directions` are the normals of the slices that look like its exemplar, as in solidtex-train.
    """

    channels: tuple[str, ...]
    threshold: float
    directions: str

    def __call__(self, points: np.ndarray) -> np.ndarray: ...


def box(solid: Solid, origin: tuple[int, int, int], size: tuple[int, int, int]) -> np.ndarray:
    """Values at voxel centers: float32 [x, y, z, channel]."""
    axes = [start + np.arange(extent) + 0.5 for start, extent in zip(origin, size, strict=True)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    parts = [solid(points[i : i + CHUNK]) for i in range(0, len(points), CHUNK)]
    return np.concatenate(parts).astype(np.float32).reshape(*size, -1)


def exemplar(solid: Solid, rows: int, columns: int) -> np.ndarray:
    """Slice normal to x, y to the right and z upwards: [row, column, channel]."""
    return box(solid, (0, 0, 0), (1, columns, rows))[0].swapaxes(0, 1)[::-1]


def end_section(solid: Solid, rows: int, columns: int) -> np.ndarray:
    """Slice normal to z, x to the right and y upwards: [row, column, channel]."""
    return box(solid, (0, 0, 0), (columns, rows, 1))[:, :, 0].swapaxes(0, 1)[::-1]


def phase(values: np.ndarray, solid: Solid) -> np.ndarray:
    """Mask of the brighter phase in values [..., channel] of the solid or of an imitation."""
    return luminance(values[..., : len(COLOR)]) >= solid.threshold


def mixed(weights: np.ndarray, first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Colors [n, 3] between `first` (weight 0) and `second` (weight 1), each [3] or [n, 3]."""
    return first + weights[:, None] * (second - first)


def write_picture(path: Path, picture: np.ndarray, force: bool) -> None:
    """An 8-bit PNG of values 0 ... 1."""
    check_output(path, force, ".png")
    data = io.BytesIO()
    Image.fromarray(np.rint(picture.clip(0, 1) * 255).astype(np.uint8)).save(data, "PNG")
    write_whole(path, data.getvalue())
    print(path)
