"""Folds a trained lattice generator into the operations of the model file, in float64.

Batch normalization is y = scale * x + shift with running statistics. It folds into the convolution
before it or, after an upsampling, into the convolution that reads the upsampled channels. The
latter is exact because no convolution is padded: no border lacks the shift.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import torch
from torch import Tensor

from solidtex_export.export.lattice_state import LatticeSizes, check_lattice_state

BATCH_NORM_EPSILON = 1e-5  # torch's default, which the public implementation keeps

Document = dict[str, Any]
Tensors = dict[str, np.ndarray]


def fold_lattice(
    state: Mapping[str, Tensor], negative_slope: float, softmax: bool = False
) -> tuple[Document, Tensors]:
    """The `field` object of the model's document, and its float32 tensors."""
    sizes = check_lattice_state(state)
    folder = _Folder(
        {key: value.detach().cpu().double() for key, value in state.items()}, negative_slope
    )
    folder.fold(sizes)
    if softmax:
        folder.node("phases", "softmax", inputs=["last_conv"])
    tensors = {name: value.float().numpy() for name, value in folder.tensors.items()}
    return {"nodes": folder.nodes, "output": folder.nodes[-1]["name"]}, tensors


class _Folder:
    """Builds the graph from the coarsest level to the finest; methods return the added node."""

    def __init__(self, state: dict[str, Tensor], negative_slope: float) -> None:
        self.state = state
        self.negative_slope = negative_slope
        self.nodes: list[Document] = []
        self.tensors: dict[str, Tensor] = {}

    def fold(self, sizes: LatticeSizes) -> None:
        y = self.block("cb1_1", self.noise(sizes.levels - 1, sizes.noise_channels))
        for stage in range(2, sizes.levels + 1):
            coarse = self.node(f"up{stage - 1}", "upsample", inputs=[y])
            noise = self.noise(sizes.levels - stage, sizes.noise_channels)
            fine = self.block(f"cb{stage}_1", noise)
            joint = self.node(f"cat{stage}", "concat", inputs=[coarse, fine])
            y = self.block(f"cb{stage}_2", joint, norm_before=f"up{stage - 1}.bn")
        self.conv("last_conv", y, *self.colored_output())

    def node(self, name: str, op: str, **fields: Any) -> str:
        self.nodes.append({"name": name, "op": op, **fields})
        return name

    def noise(self, level: int, channels: int) -> str:
        fields = {"level": level, "channels": channels, "distribution": "uniform"}
        return self.node(f"z{level}", "noise", **fields)

    def block(self, name: str, source: str, norm_before: str | None = None) -> str:
        """Three convolutions, each with a batch normalization after it."""
        for i in (1, 2, 3):
            weight, bias = self.parameters(f"{name}.conv{i}")
            if i == 1 and norm_before:
                weight, bias = norm_into_next(weight, bias, *self.norm(norm_before))
            weight, bias = norm_into_previous(weight, bias, *self.norm(f"{name}.bn{i}"))
            source = self.conv(f"{name}.conv{i}", source, weight, bias)
            source = self.node(
                f"{name}.act{i}", "leaky_relu", inputs=[source], slope=self.negative_slope
            )
        return source

    def conv(self, name: str, source: str, weight: Tensor, bias: Tensor) -> str:
        self.tensors[f"{name}.weight"], self.tensors[f"{name}.bias"] = weight, bias
        out_channels, _, kernel = weight.shape[:3]
        return self.node(name, "conv3d", inputs=[source], out_channels=out_channels, kernel=kernel)

    def parameters(self, name: str) -> tuple[Tensor, Tensor]:
        return self.state[f"{name}.weight"], self.state[f"{name}.bias"]

    def norm(self, name: str) -> tuple[Tensor, Tensor]:
        """A batch normalization as (scale, shift)."""
        gamma, beta = self.parameters(name)
        mean, variance = self.state[f"{name}.running_mean"], self.state[f"{name}.running_var"]
        scale = gamma / torch.sqrt(variance + BATCH_NORM_EPSILON)
        return scale, beta - mean * scale

    def colored_output(self) -> tuple[Tensor, Tensor]:
        """Fold the color affine into the last convolution: color = color_mean + color_basis @ y."""
        weight, bias = self.parameters("last_conv")
        mean = self.state.get("color_mean", torch.zeros(len(bias), dtype=torch.float64))
        basis = self.state.get("color_basis", torch.eye(len(bias), dtype=torch.float64))
        return torch.einsum("ij,jkxyz->ikxyz", basis, weight), mean + basis @ bias


def norm_into_previous(
    weight: Tensor, bias: Tensor, scale: Tensor, shift: Tensor
) -> tuple[Tensor, Tensor]:
    """scale * (w * x + b) + shift as one convolution."""
    return weight * scale.view(-1, 1, 1, 1, 1), bias * scale + shift


def norm_into_next(
    weight: Tensor, bias: Tensor, scale: Tensor, shift: Tensor
) -> tuple[Tensor, Tensor]:
    """w * (scale * x + shift) + b as one convolution; x are the first input channels."""
    count = len(scale)
    normed = weight[:, :count]
    bias = bias + torch.einsum("oixyz,i->o", normed, shift)
    normed = normed * scale.view(1, -1, 1, 1, 1)
    return torch.cat([normed, weight[:, count:]], dim=1), bias
