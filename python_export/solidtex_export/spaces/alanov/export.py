"""Exports a generator with one code: the model of an ordinary lattice.

The code folds into the first layer. In 3D that is a bias. A transposed convolution of stride 2 has
as many biases as parities, so in 2D the code is the weight of one more channel, the constant 1.

A 2D generator gives a solid of sheets, each 2^levels texels thick: within a sheet every section
across z is the same picture, and the next sheet has noise of its own. Columns of a picture run
along x, rows against y, and voxel y is row -y.

A 3D generator gives the probabilities of two phases, as the models of solidtex-train --phases.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import torch
import torch.nn.functional as F
from torch import Tensor

from solidtex_export.export.fold import BATCH_NORM_EPSILON
from solidtex_export.export.verification import noise
from solidtex_export.export.verification.networks import Network
from solidtex_export.generators.regions import Box
from solidtex_export.spaces.alanov.networks import FirstLayer3d, Generator, TransposedLayer

SCHEME = "solidtex-1"
TURN = 1 << 32
CONSTANT = [0, 0, 0, TURN // 4]  # the wave that is 1 everywhere

Wave = list[int]
Document = dict[str, Any]


def random_phases(count: int, seed: int) -> list[int]:
    """xi_k in 2^-32 turns."""
    return np.random.default_rng(seed).integers(TURN, size=count).tolist()


def waves_of(generator: Generator, code: Tensor, phases: Sequence[int]) -> list[Wave]:
    """Waves [f_x, f_y, f_z, phase] of the periodic part."""
    if not phases:
        return []
    radians = generator.angular_frequencies(code[None])[0].detach().double().cpu()
    turns = (radians / (2 * math.pi) * TURN).round().long().tolist()
    if generator.recipe.dimensions == 2:
        turns = [[along_columns, -along_rows, 0] for along_rows, along_columns in turns]
    return [
        [*(number % TURN for number in wave), phase]
        for wave, phase in zip(turns, phases, strict=True)
    ]


def fold_generator(
    generator: Generator, code: Tensor, waves: Sequence[Wave]
) -> tuple[Document, dict[str, np.ndarray]]:
    """The `field` object of the model's document, and its float32 tensors."""
    return _Folder(generator, code.detach().double().cpu()).fold(waves)


class _Folder:
    """Builds the graph from the noise on; methods return the name of the added node."""

    def __init__(self, generator: Generator, code: Tensor) -> None:
        self.generator, self.code = generator, code
        self.nodes: list[Document] = []
        self.tensors: dict[str, np.ndarray] = {}

    def fold(self, waves: Sequence[Wave]) -> tuple[Document, dict[str, np.ndarray]]:
        generator, sizes = self.generator, self.generator.recipe.noise
        level = generator.levels
        fields = {"level": level, "channels": sizes.local, "distribution": "normal"}
        source = self.node("local", "noise", **fields)
        if isinstance(generator.layers[0], TransposedLayer):
            waves = [*waves, CONSTANT]
        if waves:
            periodic = self.node("periodic", "periodic", level=level, waves=list(waves))
            source = self.node("noise", "concat", inputs=[source, periodic])
        slope = generator.recipe.networks.slope
        for i, layer in enumerate(generator.layers):
            source = self.layer(f"layer{i}", source, layer, i)
            if i < len(generator.norms):
                source = self.node(f"layer{i}.act", "leaky_relu", inputs=[source], slope=slope)
        op = "sigmoid" if generator.recipe.dimensions == 2 else "softmax"
        source = self.node("output", op, inputs=[source])
        return {"nodes": self.nodes, "output": source}, self.tensors

    def node(self, name: str, op: str, **fields: Any) -> str:
        self.nodes.append({"name": name, "op": op, **fields})
        return name

    def layer(self, name: str, source: str, layer: TransposedLayer | FirstLayer3d, i: int) -> str:
        """A layer with its normalization."""
        weight = layer.weight.detach().double().cpu()
        transposed = isinstance(layer, TransposedLayer)
        if not transposed:
            weight = weight.transpose(0, 1)  # input channels first
        bias = torch.zeros(weight.shape[1], dtype=torch.float64)
        if i == 0:
            given, weight = weight[: len(self.code)], weight[len(self.code) :]
            by_code = torch.einsum("i,io...->o...", self.code, given)
            if transposed:
                weight = torch.cat([weight, by_code[None]])
            else:
                bias = by_code.flatten(1).sum(1)
        scale, shift = self.normalization(i)
        weight = weight * scale.view(1, -1, *[1] * (weight.ndim - 2))
        bias = bias * scale + shift
        if isinstance(layer, TransposedLayer):
            if layer.dimensions == 2:
                weight = _in_sheets(weight, layer.padding)
            fields = {"kernel": layer.kernel, "padding": layer.padding}
            op = "conv_transpose3d"
        else:  # taps -2 ... 1 of a kernel of 5
            weight = F.pad(weight, (0, 1) * 3).transpose(0, 1)
            fields, op = {"kernel": 5}, "conv3d"
        self.tensors[f"{name}.weight"] = np.ascontiguousarray(weight.float().numpy())
        self.tensors[f"{name}.bias"] = bias.float().numpy()
        return self.node(name, op, inputs=[source], out_channels=len(bias), **fields)

    def normalization(self, i: int) -> tuple[Tensor, Tensor]:
        """Scale and shift after a layer.

        The last one gives tanh(x) of the generator as 2 sigmoid(2 x) - 1. In 3D it has its one
        output twice, as -x and x: softmax(-x, x) is 1 - sigmoid(2 x), sigmoid(2 x).
        """
        if i == len(self.generator.norms):
            recipe = self.generator.recipe
            scales = [2.0] * recipe.channels if recipe.dimensions == 2 else [-1.0, 1.0]
            return torch.tensor(scales).double(), torch.zeros(len(scales)).double()
        norm = self.generator.norms[i]
        mean, variance = norm.running_mean, norm.running_var
        assert mean is not None and variance is not None
        scale = norm.weight.detach().double() / (variance.double() + BATCH_NORM_EPSILON).sqrt()
        return scale.cpu(), (norm.bias.detach().double() - mean.double() * scale).cpu()


def _in_sheets(weight: Tensor, padding: int) -> Tensor:
    """Weight [in, out, x, y, z] of [in, out, row, column]: o_z = 2 i_z and 2 i_z + 1 take i_z."""
    upright = weight.flip(2).transpose(2, 3)
    solid = torch.zeros(*upright.shape, weight.shape[-1], dtype=weight.dtype)
    solid[..., padding : padding + 2] = upright[..., None]
    return solid


def generator_network(generator: Generator, code: Tensor, waves: Sequence[Wave]) -> Network:
    """The generator with its running statistics, in float64 and without folding."""
    generator = generator.double().eval()
    code = code.detach().double().cpu()

    def noise_of(box: Box, seed: int) -> Tensor:
        """z on a box of the noise's level [1, channel, x, y, z]."""
        sizes = generator.recipe.noise
        level, local = generator.levels, sizes.local
        parts = [noise.block(SCHEME, "normal", seed, level, local, box.lo, box.hi)]
        if waves:
            parts.append(noise.waves(waves, box.lo, box.hi))
        shared = code.view(-1, 1, 1, 1).expand(-1, *box.size)
        return torch.cat([shared, *map(torch.from_numpy, parts)])[None]

    @torch.no_grad()
    def evaluate(origin: Sequence[int], size: Sequence[int], seed: int) -> np.ndarray:
        box = Box(tuple(origin), tuple(o + s for o, s in zip(origin, size, strict=True)))
        if generator.recipe.dimensions == 3:
            y = generator.from_noise(noise_of(generator.boxes(box)[0], seed), box)
            y = torch.cat([-y, y], dim=1)  # of either phase
        else:
            y = torch.stack([section(box, z, seed) for z in range(box.lo[2], box.hi[2])], dim=-1)
        return (0.5 + 0.5 * y[0]).permute(1, 2, 3, 0).numpy()

    def section(box: Box, z: int, seed: int) -> Tensor:
        """Values [1, channel, x, y] of one section of the sheets."""
        picture = Box((1 - box.hi[1], box.lo[0]), (1 - box.lo[1], box.hi[0]))
        needed = generator.boxes(picture)[0]
        sheet = z >> generator.levels
        lo, hi = (
            (needed.lo[1], 1 - needed.hi[0], sheet),
            (needed.hi[1], 1 - needed.lo[0], sheet + 1),
        )
        inputs = noise_of(Box(lo, hi), seed)[..., 0].transpose(2, 3).flip(2)
        return generator.from_noise(inputs, picture).flip(2).transpose(2, 3)

    return evaluate
