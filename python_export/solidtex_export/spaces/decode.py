"""Decoding: a code of a space to the weights of an ordinary generator.

libsolidtex does the same (engine/space). Here the scale and shift of each layer stay parameters of
their own, since a training goes on from them; export folds them.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import torch
from torch import Tensor

from solidtex_export.export.fold import BATCH_NORM_EPSILON
from solidtex_export.generators.build import build_generator
from solidtex_export.generators.sampler import HiddenLayer, OctaveSampler
from solidtex_export.spaces.generators import (
    BOUNDED,
    MATRIX_SHARE,
    SCALE_SHARE,
    STRETCH_SHARE,
)
from solidtex_export.spaces.space_reader import OpenSpace

State = dict[str, Tensor]


def generator_arguments(space: OpenSpace) -> dict[str, object]:
    """Kind and constructor arguments of the generator, without its channels."""
    document = space.document
    if document.lattice is not None:
        return {"kind": "lattice", **document.lattice.model_dump()}
    assert document.sampler is not None
    sizes = document.sampler.model_dump(exclude={"transforms"})
    return {"kind": "sampler", **sizes, "conditions": True}


def decode(space: OpenSpace, code: np.ndarray, mean: Tensor, basis: Tensor) -> State:
    """State of the generator for a code; it gives values y with colors = mean + basis y."""
    style = _two_layers(space, "style", code)
    conditions = {}
    for name in space.tensors:
        if name.startswith("condition.") and name.endswith(".weight"):
            layer = name.removeprefix("condition.").removesuffix(".weight")
            gamma, delta = np.split(_dense(space, f"condition.{layer}", style), 2)
            conditions[layer] = (1 + gamma, delta)
    arrays = {k: v.astype(np.float64) for k, v in space.tensors.items()}
    last = "last_conv" if space.document.lattice is not None else "output"
    if space.document.colors == "network":  # the file's network gives colors
        inverse = np.linalg.inv(basis.double().numpy())
        weight = arrays[f"{last}.weight"]
        arrays[f"{last}.weight"] = np.tensordot(inverse, weight, 1)
        arrays[f"{last}.bias"] = inverse @ (arrays[f"{last}.bias"] - mean.double().numpy())
    family = "field" if space.document.lattice is not None else "sampler"
    generator = build_generator(family, {**generator_arguments(space), "out_channels": 3})
    if isinstance(generator, OctaveSampler):
        transforms = octave_transforms(space, code)
        _fill_sampler(generator, arrays, conditions, transforms)
        state = generator.state_dict()
    else:
        state = _lattice_state(generator.state_dict(), arrays, conditions)
    return state | {"color_mean": mean, "color_basis": basis}


def _lattice_state(
    state: State,
    arrays: Mapping[str, np.ndarray],
    conditions: Mapping[str, tuple[np.ndarray, np.ndarray]],
) -> State:
    """Normalizations have the statistics 0 and 1; scale and shift are gamma and delta."""
    found = dict(state)
    for key, value in state.items():
        if key in arrays:
            found[key] = _tensor(arrays[key])
        elif key.endswith("running_mean"):
            found[key] = torch.zeros_like(value)
        elif key.endswith("running_var"):
            found[key] = torch.full_like(value, 1 - BATCH_NORM_EPSILON)
    for layer, (gamma, delta) in conditions.items():
        norm = layer.replace("conv", "bn")
        found[f"{norm}.weight"], found[f"{norm}.bias"] = _tensor(gamma), _tensor(delta)
    return found


@torch.no_grad()
def _fill_sampler(
    sampler: OctaveSampler,
    arrays: Mapping[str, np.ndarray],
    conditions: Mapping[str, tuple[np.ndarray, np.ndarray]],
    transforms: np.ndarray,
) -> None:
    # one scale for each axis of space: long grain along z stays long while it is trained
    scales = np.exp2(np.round(np.log2(np.abs(transforms).max(1, keepdims=True) + 1e-30)))
    sampler.scales.copy_(_tensor(np.broadcast_to(scales, transforms.shape)))
    sampler.linear.copy_(_tensor(transforms / scales))  # exact: scales are powers of two
    sampler.constant.copy_(_tensor(arrays["constant"]))
    for l, layer in enumerate(sampler.hidden):
        _fill_hidden(layer, l, arrays)
        gamma, delta = conditions[f"hidden.{l}"]
        assert sampler.gamma is not None and sampler.delta is not None
        sampler.gamma[l], sampler.delta[l] = _tensor(gamma), _tensor(delta)
    width = len(sampler.constant)
    sampler.output_weight.copy_(_tensor(arrays["output.weight"] * width**0.5))
    sampler.output_bias.copy_(_tensor(arrays["output.bias"]))


def _fill_hidden(layer: HiddenLayer, place: int, arrays: Mapping[str, np.ndarray]) -> None:
    """Weights are stored at unit variance (generators/sampler.py)."""
    for name, parameter in (("weight", layer.weight), ("noise", layer.noise)):
        if parameter is not None:
            stored = arrays[f"hidden.{place}.{name}"]
            parameter.copy_(_tensor(stored * (stored.shape[1] ** 0.5 / layer.gain)))
    layer.bias.copy_(_tensor(arrays[f"hidden.{place}.bias"]))


def octave_transforms(space: OpenSpace, code: np.ndarray) -> np.ndarray:
    """T_i [octave, 3, 3]."""
    sizes = space.document.sampler
    assert sizes is not None
    q = _two_layers(space, "transforms", code).reshape(sizes.octaves, -1)
    scales = space.tensors["scales"].astype(np.float64)[:, None, None]
    if sizes.transforms == "linear":
        return scales * q.reshape(-1, 3, 3)
    assert q.shape[1] == BOUNDED
    soft = q / (1 + np.abs(q))
    matrix = np.eye(3) + MATRIX_SHARE * soft[:, :9].reshape(-1, 3, 3)
    t, e = SCALE_SHARE * soft[:, 9, None, None], STRETCH_SHARE * soft[:, 10, None]
    transforms = scales * (1 + t) / (1 - t) * (matrix @ space.tensors["base"].astype(np.float64))
    transforms[:, :, 2] *= (1 + e) / (1 - e)
    return transforms


def _two_layers(space: OpenSpace, name: str, x: np.ndarray) -> np.ndarray:
    h = _dense(space, f"{name}.0", x)
    return _dense(space, f"{name}.1", np.where(h < 0, space.document.style.slope * h, h))


def _dense(space: OpenSpace, name: str, x: np.ndarray) -> np.ndarray:
    weight, bias = (space.tensors[f"{name}.{k}"].astype(np.float64) for k in ("weight", "bias"))
    return weight @ x + bias


def _tensor(values: np.ndarray) -> Tensor:
    return torch.from_numpy(np.ascontiguousarray(values, np.float32))
