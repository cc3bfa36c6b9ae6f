"""Differences between the C++ engine, a model file's definition, and the trained network."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from solidtex_export.export.file_format import model_file
from solidtex_export.export.verification import engine, reference
from solidtex_export.export.verification.networks import Network

if TYPE_CHECKING:
    from solidtex import Texture

BOUND = 5e-5
"""Largest difference allowed between engine and float64: docs/numerics.md."""

FAR = 1 << 30
BOXES = (
    ((0, 0, 0), (9, 8, 7)),
    ((-37, 5, -3), (8, 9, 10)),
    ((31, -33, 64), (1, 1, 1)),
    ((-1, -1, -1), (2, 3, 2)),
    ((FAR - 3, -FAR, 12345), (3, 2, 5)),
    ((-FAR, FAR - 4, -FAR + 1), (4, 4, 1)),
)
POINT_ORIGINS = ((0.0, 0.0, 0.0), (-1000.25, 77.5, -3.0), (FAR - 20.0, 20.0 - FAR, 0.5))
POINT_COUNT = 40
POINT_SPREAD = 3.0  # texels: few bricks of the cache, yet some on all sides of the origin
SEEDS = (0, 20260101)


@dataclass(frozen=True)
class Differences:
    """Largest absolute differences, relative to the larger of 1 and the model's largest value."""

    boxes: float
    points: float
    network: float = 0.0

    @property
    def largest(self) -> float:
        return float(np.max([self.boxes, self.points, self.network]))  # NaN wins


def differences(path: str | os.PathLike[str], network: Network | None = None) -> Differences:
    """Compare the engine with the float64 oracle and, if given, with the network."""
    model = model_file.read(path)
    boxes, points, networks = [], [], [0.0]
    for index, seed in enumerate(SEEDS):  # each seed takes its share of the places
        with engine.open_model(path, seed) as texture:
            for origin, size in BOXES[index :: len(SEEDS)]:
                found = texture.eval_box(origin, size)
                boxes.append(distance(found, reference.evaluate_box(model, origin, size, seed)))
                if network:
                    networks.append(distance(found, network(origin, size, seed)))
            for base in POINT_ORIGINS[index :: len(SEEDS)]:
                points.append(_point_difference(texture, model, seed, base))
    return Differences(*(float(np.max(values)) for values in (boxes, points, networks)))


def distance(found: np.ndarray, expected: np.ndarray) -> float:
    """Largest absolute difference, relative to the largest value where that exceeds 1."""
    return float(np.abs(found - expected).max() / max(1.0, np.abs(expected).max()))


def _point_difference(
    texture: Texture,
    model: model_file.ModelFile,
    seed: int,
    origin: tuple[float, float, float],
) -> float:
    rng = np.random.default_rng(seed)
    points = rng.uniform(-POINT_SPREAD, POINT_SPREAD, (POINT_COUNT, 3)).astype(np.float32)
    positions = np.array(origin) + points.astype(np.float64)
    expected = reference.evaluate_points(model, positions, seed)
    return distance(texture.eval_points(points, origin), expected)
