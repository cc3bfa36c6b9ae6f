"""Float64 oracle: evaluates a model by its definition, without regard to speed.

It shares no code with the engine or generators/regions.py. Each node requests the boxes that it
needs from its inputs, in absolute integer coordinates.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
import torch
import torch.nn.functional as F
from torch import Tensor

from solidtex_export.export.file_format.model_file import ModelFile
from solidtex_export.export.verification import noise

MAX_VOXELS = 1 << 18

Box = tuple[tuple[int, ...], tuple[int, ...]]
"""lo inclusive, hi exclusive."""

Positions = np.ndarray
"""Absolute positions in texels, float64 [point, 3]."""


def evaluate_box(
    model: ModelFile, origin: Sequence[int], size: Sequence[int], seed: int = 0
) -> np.ndarray:
    """The voxels [origin, origin + size) at their centers: float64 [x, y, z, channel]."""
    with torch.no_grad():
        return torch_box(model.document, _exact_tensors(model), origin, size, seed).numpy()


def torch_box(
    document: dict[str, Any],
    tensors: Mapping[str, Tensor],
    origin: Sequence[int],
    size: Sequence[int],
    seed: int,
) -> Tensor:
    """The same in the type and on the device of the tensors, which may require gradients."""
    lo, hi = tuple(origin), tuple(o + s for o, s in zip(origin, size, strict=True))
    if document["family"] == "field":
        return _Lattice(document, tensors, seed).output((lo, hi)).permute(1, 2, 3, 0)
    axes = [np.arange(l, h, dtype=np.float64) + 0.5 for l, h in zip(lo, hi, strict=True)]
    centers = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    return _sampler(document, tensors, centers.reshape(-1, 3), seed).reshape(*size, -1)


def _exact_tensors(model: ModelFile) -> dict[str, Tensor]:
    return {name: torch.from_numpy(values).double() for name, values in model.tensors.items()}


def evaluate_points(model: ModelFile, positions: Positions, seed: int = 0) -> np.ndarray:
    """Colors at continuous positions: float64 [point, channel].

    Positions of a lattice model have to be close together, since all voxels between them are
    evaluated.
    """
    positions = np.asarray(positions, dtype=np.float64)
    tensors = _exact_tensors(model)
    with torch.no_grad():
        if model.document["family"] == "sampler":
            return _sampler(model.document, tensors, positions, seed).numpy()
        return _between_voxels(_Lattice(model.document, tensors, seed), positions)


def _between_voxels(lattice: _Lattice, positions: Positions) -> np.ndarray:
    """Cubic convolution of the 4^3 voxel centers around each position."""
    centered = positions - 0.5
    cells = np.floor(centered)
    lo, hi = cells.min(axis=0).astype(int) - 1, cells.max(axis=0).astype(int) + 3
    if np.prod(hi - lo) > MAX_VOXELS:
        raise ValueError(f"positions: found them in {hi - lo} voxels, expected {MAX_VOXELS} in all")
    box = lattice.output((tuple(lo.tolist()), tuple(hi.tolist()))).numpy()
    colors = []
    for first, t in zip(cells.astype(int) - 1 - lo, centered - cells, strict=True):
        i, j, k = (slice(start, start + 4) for start in first)
        weights = [cubic_convolution(np.arange(-1, 3) - part) for part in t]
        colors.append(np.einsum("cijk,i,j,k->c", box[:, i, j, k], *weights))
    return np.stack(colors)


def cubic_convolution(distance: np.ndarray) -> np.ndarray:
    """Weight of a voxel by distance: Keys 1981, equation 6 with a = -3/4."""
    a, s = -0.75, np.abs(distance)
    near = (a + 2) * s**3 - (a + 3) * s**2 + 1
    far = a * (s**3 - 5 * s**2 + 8 * s - 4)
    return np.where(s < 1, near, np.where(s < 2, far, 0.0))


class _Lattice:
    """The graph of the lattice family."""

    def __init__(self, document: dict[str, Any], tensors: Mapping[str, Tensor], seed: int) -> None:
        self.seed = seed
        self.scheme = document["noise"]["scheme"]
        self.nodes = {node["name"]: node for node in document["field"]["nodes"]}
        self.output_name = document["field"]["output"]
        self.tensors = tensors
        # Of the device and type in which a graph computes; one without weights in float64.
        self.like = next(iter(tensors.values()), torch.empty(0, dtype=torch.float64))

    def output(self, box: Box) -> Tensor:
        """The output [channel, x, y, z] on a box."""
        self.known: dict[tuple[str, Box], Tensor] = {}
        return self.value(self.output_name, box)

    def value(self, name: str, box: Box) -> Tensor:
        if (name, box) not in self.known:
            node = self.nodes[name]
            self.known[name, box] = _OPERATIONS[node["op"]](self, node, box)
        return self.known[name, box]

    def input(self, node: dict[str, Any], box: Box) -> Tensor:
        return self.value(node["inputs"][0], box)

    def tensor(self, node: dict[str, Any], name: str) -> Tensor:
        return self.tensors[f"{node['name']}.{name}"]


def _noise(lattice: _Lattice, node: dict[str, Any], box: Box) -> Tensor:
    values = noise.block(
        lattice.scheme, node["distribution"], lattice.seed, node["level"], node["channels"], *box
    )
    return torch.from_numpy(values).to(lattice.like)


def _periodic(lattice: _Lattice, node: dict[str, Any], box: Box) -> Tensor:
    values = noise.waves(node["waves"], *box)
    return torch.from_numpy(values).to(lattice.like)


def _conv3d(lattice: _Lattice, node: dict[str, Any], box: Box) -> Tensor:
    r = node["kernel"] // 2
    source = lattice.input(node, (tuple(l - r for l in box[0]), tuple(h + r for h in box[1])))
    return F.conv3d(source[None], lattice.tensor(node, "weight"), lattice.tensor(node, "bias"))[0]


def _conv_transpose3d(lattice: _Lattice, node: dict[str, Any], box: Box) -> Tensor:
    """out[o] = b + sum of w[t] in[i] over o = 2i + t - padding."""
    kernel, padding = node["kernel"], node["padding"]
    lo = tuple((l + padding - kernel + 1) // 2 for l in box[0])
    hi = tuple((h - 1 + padding) // 2 + 1 for h in box[1])
    weight, bias = lattice.tensor(node, "weight"), lattice.tensor(node, "bias")
    source = lattice.input(node, (lo, hi))[None]
    # The extra plane of output_padding is only bias: what no tap reaches when the kernel is 1.
    values = F.conv_transpose3d(source, weight, bias, stride=2, output_padding=1)[0]
    first = tuple(2 * l - padding for l in lo)
    return _cropped(values, first, box)


def _upsample(lattice: _Lattice, node: dict[str, Any], box: Box) -> Tensor:
    lo = tuple(l // 2 for l in box[0])
    hi = tuple((h - 1) // 2 + 1 for h in box[1])
    values = lattice.input(node, (lo, hi))
    for axis in (1, 2, 3):
        values = values.repeat_interleave(2, dim=axis)
    return _cropped(values, tuple(2 * l for l in lo), box)


def _cropped(values: Tensor, first: Sequence[int], box: Box) -> Tensor:
    """Cuts `box` out of values [channel, x, y, z] whose first voxel lies at `first`."""
    cut = [slice(l - f, h - f) for f, l, h in zip(first, *box, strict=True)]
    return values[:, cut[0], cut[1], cut[2]]


def _concat(lattice: _Lattice, node: dict[str, Any], box: Box) -> Tensor:
    return torch.cat([lattice.value(name, box) for name in node["inputs"]])


def _affine(lattice: _Lattice, node: dict[str, Any], box: Box) -> Tensor:
    scale, shift = (lattice.tensor(node, name).view(-1, 1, 1, 1) for name in ("scale", "shift"))
    return scale * lattice.input(node, box) + shift


def _leaky_relu(lattice: _Lattice, node: dict[str, Any], box: Box) -> Tensor:
    return F.leaky_relu(lattice.input(node, box), node["slope"])


def _tanh(lattice: _Lattice, node: dict[str, Any], box: Box) -> Tensor:
    return torch.tanh(lattice.input(node, box))


def _sigmoid(lattice: _Lattice, node: dict[str, Any], box: Box) -> Tensor:
    return torch.sigmoid(lattice.input(node, box))


def _softmax(lattice: _Lattice, node: dict[str, Any], box: Box) -> Tensor:
    return torch.softmax(lattice.input(node, box), dim=0)


_OPERATIONS: dict[str, Callable[[_Lattice, dict[str, Any], Box], Tensor]] = {
    "noise": _noise,
    "periodic": _periodic,
    "conv3d": _conv3d,
    "conv_transpose3d": _conv_transpose3d,
    "upsample": _upsample,
    "concat": _concat,
    "affine": _affine,
    "leaky_relu": _leaky_relu,
    "tanh": _tanh,
    "sigmoid": _sigmoid,
    "softmax": _softmax,
}


def _sampler(
    document: dict[str, Any], tensors: Mapping[str, Tensor], positions: Positions, seed: int
) -> Tensor:
    transforms = tensors["transforms"].detach().double().cpu().numpy()
    octaves = _octaves(document["noise"]["scheme"], transforms, positions, seed)
    return _network(document["sampler"], tensors, torch.from_numpy(octaves))


def sampler_octaves(model: ModelFile, positions: Positions, seed: int) -> np.ndarray:
    """Noise of the octaves at T_i c: float64 [point, octave]."""
    transforms = model.tensors["transforms"].astype(np.float64)
    return _octaves(model.document["noise"]["scheme"], transforms, positions, seed)


def _octaves(scheme: str, transforms: np.ndarray, positions: Positions, seed: int) -> np.ndarray:
    octaves = [
        octave_noise(scheme, seed, level, _transformed(positions, transform))
        for level, transform in enumerate(transforms)
    ]
    return np.stack(octaves, axis=-1)


def sampler_network(model: ModelFile, eta: np.ndarray) -> np.ndarray:
    """GramGAN equations 1 and 2: octave noise enters the hidden layers bin by bin."""
    return _network(model.document["sampler"], _exact_tensors(model), torch.from_numpy(eta)).numpy()


def _network(sizes: dict[str, Any], tensors: Mapping[str, Tensor], eta: Tensor) -> Tensor:
    eta = eta.to(tensors["constant"])
    bins = sizes["octaves"] // (sizes["hidden_layers"] - 1)
    x = tensors["constant"].expand(len(eta), sizes["width"])
    for l in range(sizes["hidden_layers"]):
        y = x @ tensors[f"hidden.{l}.weight"].T + tensors[f"hidden.{l}.bias"]
        if l < sizes["hidden_layers"] - 1:
            y = y + eta[:, l * bins : (l + 1) * bins] @ tensors[f"hidden.{l}.noise"].T
        x = F.leaky_relu(y, sizes["slope"])
    return x @ tensors["output.weight"].T + tensors["output.bias"]


def _transformed(positions: Positions, transform: np.ndarray) -> Positions:
    """T c with a fixed order of summation. BLAS's order depends on the number of points, which
    shows far away.
    """
    return sum(positions[:, [axis]] * transform[:, axis] for axis in range(3))


def octave_noise(scheme: str, seed: int, level: int, positions: Positions) -> np.ndarray:
    """Trilinear interpolation of standard normal lattice noise at positions [point, 3]."""
    cells = np.floor(positions)
    t = positions - cells
    total = np.zeros(len(positions))
    for corner in np.ndindex(2, 2, 2):
        weights = np.where(np.array(corner) == 1, t, 1 - t).prod(axis=1)
        lattice = (cells + corner).astype(np.int64).T
        total += weights * noise.normal(scheme, seed, level, 0, *lattice)
    return total
