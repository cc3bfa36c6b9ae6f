"""Untrained models with typical values, for measuring and testing numerics."""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

from solidtex_export.export.file_format.model_file import VERSION, ModelFile
from solidtex_export.export.fold import fold_lattice
from solidtex_export.generators.lattice import Box, LatticeGenerator
from solidtex_export.generators.sampler import OctaveSampler

NEGATIVE_SLOPE = 0.01


def lattice_state(levels: int, noise: int, step: int, seed: int = 0) -> dict[str, Tensor]:
    """State dict like a training's: batch statistics differ slightly from the true ones."""
    torch.manual_seed(seed)
    generator = LatticeGenerator(levels, noise, step, slope=NEGATIVE_SLOPE)
    norms = [module for module in generator.modules() if isinstance(module, nn.BatchNorm3d)]
    for norm in norms:
        norm.momentum = None  # average instead of forgetting
        nn.init.uniform_(norm.weight, 0.5, 1.5)
        nn.init.normal_(norm.bias, std=0.3)
    box = Box((0, 0, 0), (12, 12, 12))
    with torch.no_grad():
        generator.train()(generator.draw_noise(box, batch=2), box)
        for norm in norms:
            assert norm.running_mean is not None and norm.running_var is not None
            norm.running_var *= torch.empty_like(norm.running_var).uniform_(0.8, 1.25)
            norm.running_mean += 0.1 * torch.randn_like(norm.running_mean)
        generator.color_mean.uniform_(0.3, 0.6)
        generator.color_basis.normal_(std=0.3)
    return generator.state_dict()


def lattice_model(levels: int = 6, noise: int = 3, step: int = 4, seed: int = 0) -> ModelFile:
    """Gutierrez et al.'s generator, by default of the paper's size."""
    graph, tensors = fold_lattice(lattice_state(levels, noise, step, seed), NEGATIVE_SLOPE)
    return ModelFile(document("field", graph), tensors)


def sampler(octaves: int = 16, hidden: int = 5, width: int = 128, seed: int = 0) -> OctaveSampler:
    """GramGAN's sampler, by default of the paper's size."""
    torch.manual_seed(seed)
    network = OctaveSampler(octaves, hidden, width)
    with torch.no_grad():
        for layer in network.hidden:
            layer.bias.normal_(std=0.3)
        network.color_mean.uniform_(0.3, 0.6)
        network.color_basis.normal_(std=0.3)
    return network


def sampler_model(octaves: int = 16, hidden: int = 5, width: int = 128, seed: int = 0) -> ModelFile:
    network = sampler(octaves, hidden, width, seed)
    sizes = {"octaves": octaves, "hidden_layers": hidden, "width": width, "slope": 0.2}
    tensors = {k: v.float().numpy() for k, v in network.effective_tensors().items()}
    return ModelFile(document("sampler", sizes), tensors)


def every_operation_model(seed: int = 0) -> ModelFile:
    """A graph that uses each operation of the format, and each noise distribution."""
    nodes = [
        _node("z2", "noise", level=2, channels=2, distribution="normal"),
        _node("deep", "conv_transpose3d", "z2", out_channels=3, kernel=4, padding=1),
        _node("squashed", "tanh", "deep"),
        _node("z1", "noise", level=1, channels=3, distribution="uniform"),
        _node("wide", "conv3d", "z1", out_channels=5, kernel=5),
        _node("bent", "leaky_relu", "wide", slope=0.2),
        _node("waves", "periodic", level=1, waves=[[2**32 - 5, 3**19, 7**11, 9], [0, 0, 1, 2**30]]),
        _node("joint", "concat", "squashed", "bent", "z1", "waves"),
        _node("thin", "conv_transpose3d", "joint", out_channels=2, kernel=1, padding=0),
        _node("odd", "conv_transpose3d", "joint", out_channels=3, kernel=3, padding=2),
        _node("big", "upsample", "joint"),
        _node("scaled", "affine", "big"),
        _node("z0", "noise", level=0, channels=1, distribution="normal"),
        _node("all", "concat", "thin", "odd", "scaled", "z0"),
        _node("mixed", "conv3d", "all", out_channels=4, kernel=3),
        _node("gate", "sigmoid", "mixed"),
        _node("colors", "conv3d", "gate", out_channels=3, kernel=1),
    ]
    channels = {"z2": 2, "z1": 3, "joint": 13, "big": 13, "all": 19, "gate": 4}
    rng = np.random.default_rng(seed)
    tensors: dict[str, np.ndarray] = {}
    for node in nodes:
        tensors |= _random_tensors(rng, node, channels.get(node.get("inputs", [""])[0], 0))
    return ModelFile(document("field", {"nodes": nodes, "output": "colors"}), tensors)


def document(
    family: str, architecture: dict[str, Any], scheme: str = "solidtex-1"
) -> dict[str, Any]:
    """Document of a model with three colors and no optional fields."""
    return {
        "version": VERSION,
        "name": "random",
        "family": family,
        "channels": ["albedo.r", "albedo.g", "albedo.b"],
        "color_space": "srgb",
        "noise": {"scheme": scheme},
        family: architecture,
    }


def _node(name: str, op: str, *inputs: str, **fields: Any) -> dict[str, Any]:
    sources = {"inputs": list(inputs)} if inputs else {}
    return {"name": name, "op": op, **sources, **fields}


def _random_tensors(
    rng: np.random.Generator, node: dict[str, Any], channels: int
) -> dict[str, np.ndarray]:
    name = node["name"]
    shapes: dict[str, tuple[int, ...]]
    if node["op"] == "affine":
        shapes = {"scale": (channels,), "shift": (channels,)}
    elif "kernel" in node:
        widths = (node["out_channels"], channels)
        ends = widths if node["op"] == "conv3d" else widths[::-1]
        shapes = {"weight": ends + (node["kernel"],) * 3, "bias": (node["out_channels"],)}
    else:
        return {}
    spread = 1 / np.sqrt(max(channels, 1) * node.get("kernel", 1) ** 3)
    return {
        f"{name}.{part}": rng.normal(0, spread, shape).astype(np.float32)
        for part, shape in shapes.items()
    }
