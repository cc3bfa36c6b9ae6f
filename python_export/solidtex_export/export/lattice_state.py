"""State dicts of the lattice generator: their sizes and their completeness."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

import torch
from torch import Tensor

from solidtex_export.generators.lattice import LatticeGenerator

COLOR_BUFFERS = ("color_mean", "color_basis")

MAX_LEVEL = 20  # of noise in a model file


class StateError(ValueError):
    """An invalid state dict: the key, found, expected."""


@dataclass(frozen=True)
class LatticeSizes:
    """Sizes of Gutierrez et al.'s generator: levels = K + 1, noise_channels = M_i, step = M_s."""

    levels: int
    noise_channels: int
    step_channels: int
    out_channels: int

    def generator(self, negative_slope: float) -> LatticeGenerator:
        return LatticeGenerator(**asdict(self), slope=negative_slope)


def lattice_sizes(state: Mapping[str, Any]) -> LatticeSizes:
    """Derive the sizes from the shapes."""
    stages = [re.fullmatch(r"cb([1-9]\d{0,3})_1\.conv1\.weight", str(key)) for key in state]
    levels = max((int(match[1]) for match in stages if match), default=0)
    if levels > MAX_LEVEL + 1:
        raise StateError(f"cb{levels}_1: found {levels} levels, expected at most {MAX_LEVEL + 1}")
    step, noise_channels = _weight(state, "cb1_1.conv1.weight").shape[:2]
    out_channels = _weight(state, "last_conv.weight").shape[0]
    return LatticeSizes(levels, noise_channels, step, out_channels)


def check_lattice_state(state: Mapping[str, Any]) -> LatticeSizes:
    """Check that the state dict holds exactly the tensors of its sizes, finite and of the right
    shape.

    The color buffers may be missing, as in imported dicts; num_batches_tracked is ignored.
    """
    sizes = lattice_sizes(state)
    with torch.device("meta"):
        expected = sizes.generator(negative_slope=0.0).state_dict()
    expected = {k: v for k, v in expected.items() if not k.endswith("num_batches_tracked")}
    for key, like in expected.items():
        if key in state or key not in COLOR_BUFFERS:
            _check_tensor(state, key, tuple(like.shape))
        if key.endswith("running_var") and (state[key] < 0).any():
            raise StateError(f"{key}: found a negative variance, expected none below 0")
    for key in state:
        if key not in expected and not str(key).endswith("num_batches_tracked"):
            raise StateError(
                f"{key}: found an unexpected key, expected those of a generator with {sizes}"
            )
    return sizes


def _weight(state: Mapping[str, Any], key: str) -> Tensor:
    value = _tensor(state, key)
    if value.ndim != 5 or min(value.shape) < 1:
        raise StateError(f"{key}: found shape {tuple(value.shape)}, expected [out, in, x, y, z]")
    return value


def _tensor(state: Mapping[str, Any], key: str) -> Tensor:
    if key not in state:
        raise StateError(f"{key}: found nothing, expected this tensor")
    value = state[key]
    if not isinstance(value, Tensor):
        raise StateError(f"{key}: found {type(value).__name__}, expected a tensor")
    return value


def _check_tensor(state: Mapping[str, Any], key: str, shape: tuple[int, ...]) -> None:
    value = _tensor(state, key)
    if tuple(value.shape) != shape:
        raise StateError(f"{key}: found shape {tuple(value.shape)}, expected {shape}")
    if not value.is_floating_point() or not torch.isfinite(value).all():
        raise StateError(f"{key}: found {value.dtype} with non-finite values or not floating point")
