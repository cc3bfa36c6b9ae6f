"""The engine's fade steps of a model, recovered from its values with footprints."""

from __future__ import annotations

import numpy as np

from solidtex_export.export.file_format import model_file
from solidtex_export.export.file_format.model_file import ModelFile
from solidtex_export.export.verification import engine, reference

COARSEST = 9
"""Cubes with edges of 2^9 texels and more give the mean of the material."""

POINTS = 512


def fade_steps(model: ModelFile, seed: int) -> np.ndarray:
    """Gains and offsets, float32 [step, 2, channel], for a point and edges of 1, 2, 4 ... 512.

    A mean over a cube is offset + gain * value, in linear light, where value has faded octaves.
    The engine measures gains and offsets of each material (engine/filter/sampler_fade.cpp).
    """
    steps = [_plain_step(model)]
    positions = np.random.default_rng(0).uniform(-4000, 4000, (POINTS, 3)).astype(np.float32)
    noise = reference.sampler_octaves(model, positions.astype(np.float64), seed)
    with engine.open_bytes(model_file.serialize(model), seed) as texture:
        for level in range(COARSEST + 1):
            radius = 2.0**level / 2
            means = texture.eval_points(positions, radii=radius).astype(np.float64)
            divisors = octave_divisors(model, radius)
            values = reference.sampler_network(model, noise / divisors)
            steps.append(_fitted(values, means, light_channels(model)))
    return np.stack(steps).astype(np.float32)


def plain_steps(model: ModelFile) -> np.ndarray:
    """Steps that change nothing."""
    return np.stack([_plain_step(model)] * (COARSEST + 2)).astype(np.float32)


def _plain_step(model: ModelFile) -> np.ndarray:
    channels = len(model.document["channels"])
    return np.stack([np.ones(channels), np.zeros(channels)])


def light_channels(model: ModelFile) -> list[bool]:
    """Whether each channel is sRGB-encoded, so that its means are taken in linear light."""
    is_srgb = model.document["color_space"] == "srgb"
    return [is_srgb and name.startswith("albedo.") for name in model.document["channels"]]


def octave_divisors(model: ModelFile, radius: float) -> np.ndarray:
    transforms = model.tensors["transforms"].astype(np.float64)
    products = transforms @ transforms.swapaxes(1, 2)
    return np.linalg.det(np.eye(3) + radius**2 / 2 * products)


def _fitted(values: np.ndarray, means: np.ndarray, is_light: list[bool]) -> np.ndarray:
    step = np.zeros((2, len(is_light)))
    for channel, light in enumerate(is_light):
        value, mean = values[:, channel], means[:, channel]
        if light:
            # A mean of 0 may have been negative.
            positive = mean > 0
            value, mean = np.maximum(value[positive], 0) ** 2, mean[positive] ** 2
        if len(mean) > 1 and np.ptp(mean) > 1e-6:
            step[:, channel] = np.polyfit(value, mean, 1)
        else:
            step[1, channel] = mean.mean() if len(mean) else 0
    return step
