"""Weights file of a descriptor: safetensors, convolutions in float16.

It holds `<layer>.weight`, `<layer>.bias`, and `<layer>.deviation`, the standard deviation of each
feature over the procedural textures. The file of a distilled network has
`heads.<teacher's layer>.weight` and `.bias` too, maps of 1 x 1 from its layers to the teacher's.
`__metadata__` describes the training.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, NamedTuple

import torch
from safetensors import SafetensorError, safe_open
from safetensors.torch import save
from torch import Tensor

from solidtex_export.losses.descriptor.heads import Heads
from solidtex_export.losses.descriptor.network import (
    DISTILLED_WIDTHS,
    WIDTHS,
    DescriptorNetwork,
    layer_names,
)
from solidtex_export.networks.weights import WeightsError
from solidtex_export.whole_file import write_whole

DISTILLED = Path(__file__).with_name("distilled.safetensors")
"""Weights that follow SqueezeNet: docs/descriptor.md has the command."""

PROCEDURAL = Path(__file__).with_name("procedural.safetensors")
"""Weights of `solidtex-pretrain-descriptor` with its default options. Limits of measurements were
set by them."""

SHIPPED = {"procedural": PROCEDURAL, "distilled": DISTILLED}

METADATA_KEY = "solidtex-descriptor"
EXPECTED = "expected weights.safetensors of solidtex-pretrain-descriptor"


class Trained(NamedTuple):
    """A frozen network, the deviation [channels] of each layer's features, and its history."""

    network: DescriptorNetwork
    deviations: dict[str, Tensor]
    metadata: dict[str, Any]
    heads: Heads | None = None
    """Of a distilled network."""


def save_weights(
    path: Path,
    network: DescriptorNetwork,
    deviations: dict[str, Tensor],
    metadata: dict[str, Any],
    heads: Heads | None = None,
) -> None:
    state = network.state_dict()
    state |= {f"heads.{k}": v for k, v in heads.state_dict().items()} if heads else {}
    tensors = {k: v.half().contiguous() for k, v in state.items()}
    tensors |= {f"{name}.deviation": d.float() for name, d in deviations.items()}
    write_whole(path, save(tensors, {METADATA_KEY: json.dumps(metadata, sort_keys=True)}))


def load_weights(path: Path) -> Trained:
    try:
        with safe_open(path, "pt") as file:
            metadata = json.loads((file.metadata() or {}).get(METADATA_KEY, "null"))
            tensors = {k: file.get_tensor(k).float() for k in file.keys()}  # noqa: SIM118
    except (SafetensorError, OSError, ValueError) as error:
        raise WeightsError(
            f"{path}: found no readable safetensors ({error}), {EXPECTED}"
        ) from error
    if not isinstance(metadata, dict):
        raise WeightsError(f"{path}: {METADATA_KEY}: found no such metadata, {EXPECTED}")
    is_distilled = any(k.startswith("heads.") for k in tensors)
    network = DescriptorNetwork(DISTILLED_WIDTHS if is_distilled else WIDTHS)
    names = layer_names(network.widths)
    expected = {k: v.shape for k, v in network.state_dict().items()}
    expected |= {f"{name}.deviation": expected[f"{name}.bias"] for name in names}
    heads = Heads(network.widths) if is_distilled else None
    if heads:
        expected |= {f"heads.{k}": v.shape for k, v in heads.state_dict().items()}
    for name in sorted(expected.keys() | tensors.keys()):
        found = tuple(tensors[name].shape) if name in tensors else "nothing"
        wanted = tuple(expected[name]) if name in expected else "nothing"
        if found != wanted:
            raise WeightsError(f"{path}: {name}: found {found}, expected {wanted}")
        if not tensors[name].isfinite().all():
            raise WeightsError(f"{path}: {name}: found a value that is not finite")
    network.load_state_dict({k: tensors[k] for k in network.state_dict()})
    network.requires_grad_(False).eval()
    if heads:
        heads.load_state_dict({k: tensors[f"heads.{k}"] for k in heads.state_dict()})
        heads.requires_grad_(False)
    deviations = {name: tensors[f"{name}.deviation"] for name in names}
    return Trained(network, deviations, metadata, heads)


@torch.no_grad()
def feature_deviations(network: DescriptorNetwork, images: Tensor) -> dict[str, Tensor]:
    """Standard deviation [channels] of each layer's features over images and pixels."""
    return {name: f.float().std((0, 2, 3)) for name, f in network.features(images).items()}
