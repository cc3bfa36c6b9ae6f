"""Tensors of a network in a file that the user provides."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from torch import Tensor


class WeightsError(ValueError):
    """A file of weights that cannot be used; the message names it and the tensor."""


def weights_of(
    path: Path, state: Mapping[str, Any], key: str, shape: tuple[int, ...], expected: str
) -> Tensor:
    """One tensor in float32: finite, and of this shape."""
    value = state.get(key)
    if not isinstance(value, Tensor) or tuple(value.shape) != shape:
        what = f"shape {tuple(value.shape)}" if isinstance(value, Tensor) else "nothing"
        raise WeightsError(f"{path}: {key}: found {what}, expected shape {shape}: {expected}")
    if not value.is_floating_point() or not value.isfinite().all():
        raise WeightsError(f"{path}: {key}: found values that are not finite floats: {expected}")
    return value.float()
