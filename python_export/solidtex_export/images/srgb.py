"""Transfer function of sRGB, IEC 61966-2-1, continued linearly below 0."""

from __future__ import annotations

import numpy as np
import torch
from torch import Tensor

LIMIT = 1e15
"""Larger values of damaged files are clipped: their powers are no float32."""


def srgb_encode(linear: np.ndarray) -> np.ndarray:
    linear = np.clip(linear, -LIMIT, LIMIT)
    curve = 1.055 * np.maximum(linear, 0.0031308) ** (1 / 2.4) - 0.055
    return np.where(linear <= 0.0031308, 12.92 * linear, curve).astype(np.float32)


def srgb_decode(encoded: np.ndarray) -> np.ndarray:
    encoded = np.clip(encoded, -LIMIT, LIMIT)
    curve = ((np.maximum(encoded, 0.04045) + 0.055) / 1.055) ** 2.4
    return np.where(encoded <= 0.04045, encoded / 12.92, curve).astype(np.float32)


def srgb_encoded(linear: Tensor) -> Tensor:
    """sRGB-encode a tensor, with gradients."""
    curve = 1.055 * linear.clamp_min(0.0031308) ** (1 / 2.4) - 0.055
    return torch.where(linear <= 0.0031308, 12.92 * linear, curve)
