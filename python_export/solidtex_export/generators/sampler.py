"""Generator of the sampler family.

Portenier et al. 2020, "GramGAN: Deep 3D texture synthesis from 2D exemplars", section 3.1,
equations 1 and 2.

The initial T_i differ from the paper: a rotation times a scale from a ladder, coarse to fine. The
paper draws N(0, 1) * 2^i, which trains far more slowly. The lattice noise is hashed instead of a
repeating 64^3 tile. Weights are stored at unit variance and multiplied by 1/sqrt(fan-in) when used
("equalized" learning rates, as in the paper).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from itertools import product
from typing import ClassVar

import torch
import torch.nn.functional as F
from torch import Tensor, nn

Lattice = Callable[[Tensor], Tensor]
"""Lattice coordinates [octave, point, 3] (integral, any dtype) -> their standard normal values."""


class HashedLattice:
    """Aperiodic standard normal noise at integer lattice points: a hash into a table.

    It has the statistics of the engine's noise. A new object is a new realization. The table fits
    into a core's own cache.
    """

    SIZE = 1 << 16
    FACTORS = (73856093, 19349663, 83492791)
    _tables: ClassVar[dict[torch.device, Tensor]] = {}

    def __init__(self, octaves: int, device: torch.device) -> None:
        if device not in self._tables:
            fixed = torch.Generator().manual_seed(0)
            self._tables[device] = torch.randn(self.SIZE, generator=fixed).to(device)
        self.table = self._tables[device]
        self.salt = torch.randint(1 << 30, (octaves, 1), device=device, dtype=torch.int32)

    def __call__(self, cells: Tensor) -> Tensor:
        key = self.salt
        for axis, cell in enumerate(cells.int().unbind(-1)):
            key = self._hash(key, cell * self.FACTORS[axis])
        return self._values(key)

    def corners(self, cells: Tensor) -> Tensor:
        """As `corner_values`; corners share the hashes of their first coordinates."""
        key = self.salt
        for axis, cell in enumerate(cells.int().unbind(-1)):
            factor = self.FACTORS[axis]
            both = torch.stack([cell * factor, cell * factor + factor])
            key = self._hash(key.unsqueeze(axis), both)
        return self._values(key)

    def _hash(self, key: Tensor, coordinate: Tensor) -> Tensor:
        key = (key ^ coordinate) * 0x2545F491 + self.salt
        return key ^ (key >> 17)

    def _values(self, key: Tensor) -> Tensor:
        return self.table.index_select(0, (key & (self.SIZE - 1)).flatten()).view(key.shape)


def corner_values(lattice: Lattice, cells: Tensor) -> Tensor:
    """Values [2, 2, 2, octave, point] at the corners (x, y, z) of cells [octave, point, 3]."""
    if isinstance(lattice, HashedLattice):
        return lattice.corners(cells)
    values = [lattice(cells + cells.new_tensor(corner)) for corner in product((0, 1), repeat=3)]
    return torch.stack(values).unflatten(0, (2, 2, 2))


def trilinear(lattice: Lattice, positions: Tensor) -> Tensor:
    """eta_i(c) [octave, point]: noise at continuous positions [octave, point, 3]."""
    cell = positions.detach().floor()
    t = (positions - cell).unbind(-1)
    values = corner_values(lattice, cell)
    for fraction in t:
        values = torch.lerp(values[0], values[1], fraction.to(values.dtype))
    return values


def ladder(first: float, last: float, octaves: int) -> Tensor:
    """Geometric ladder of scales [octave, 1, 1] from the first to the last."""
    return torch.logspace(math.log10(first), math.log10(last), octaves).view(-1, 1, 1)


class HiddenLayer(nn.Module):
    """Layer y = phi(W x + A eta + b), equation 2; `octaves` is 0 for the last hidden layer."""

    def __init__(self, width: int, octaves: int, negative_slope: float) -> None:
        super().__init__()
        self.gain = math.sqrt(2 / (1 + negative_slope**2))
        self.negative_slope = negative_slope
        self.weight = nn.Parameter(torch.randn(width, width))
        self.bias = nn.Parameter(torch.zeros(width))
        self.noise = nn.Parameter(torch.randn(width, octaves)) if octaves else None

    def effective(self, dtype: torch.dtype | None = None) -> dict[str, Tensor]:
        """Tensors of the model file, with the equalized learning rate multiplied in."""
        tensors = {
            "weight": _equalized(self.weight, self.gain, dtype),
            "bias": self.bias.to(dtype or self.bias.dtype),
        }
        if self.noise is not None:
            tensors["noise"] = _equalized(self.noise, self.gain, dtype)
        return tensors

    def forward(self, x: Tensor, eta: Tensor | None) -> Tensor:
        tensors = self.effective()
        y = F.linear(x, tensors["weight"], tensors["bias"])
        if eta is not None:
            y = y + F.linear(eta, tensors["noise"])
        return F.leaky_relu(y, self.negative_slope)


class OctaveSampler(nn.Module):
    """S of equation 1: octave noise at c -> color at c."""

    scales: Tensor
    color_mean: Tensor
    color_basis: Tensor

    def __init__(
        self,
        octaves: int = 16,
        hidden_layers: int = 5,
        width: int = 128,
        slope: float = 0.2,
        out_channels: int = 3,
        coarsest: float = 48.0,
        finest: float = 1.0,
        noise_at: str = "hidden",
        conditions: bool = False,
    ) -> None:
        """`coarsest` and `finest`: the lattice spacings, in texels, that the octaves start with.

        `noise_at`: a bin of octaves enters each hidden layer but the last ("hidden", GramGAN), or
        all octaves enter the first ("input", Henzler et al. 2020, the ablation NI of GramGAN).

        `conditions`: scale gamma and shift delta of each hidden layer's output, equation 5.
        """
        super().__init__()
        if noise_at not in ("hidden", "input"):
            raise ValueError(f"noise_at: found {noise_at}, expected hidden or input")
        if hidden_layers < 2 or (noise_at == "hidden" and octaves % (hidden_layers - 1)):
            raise ValueError(
                f"octaves: found {octaves}, expected a multiple of hidden_layers - 1"
                f" = {hidden_layers - 1}"
            )
        self.octaves = octaves
        bins = hidden_layers - 1 if noise_at == "hidden" else 1
        self.bin_size = octaves // bins
        self.linear = nn.Parameter(_rotations(octaves))
        self.constant = nn.Parameter(torch.randn(width))
        self.hidden: Sequence[HiddenLayer] = nn.ModuleList(  # type: ignore[assignment]
            HiddenLayer(width, self.bin_size if i < bins else 0, slope)
            for i in range(hidden_layers)
        )
        self.gamma = nn.Parameter(torch.ones(hidden_layers, width)) if conditions else None
        self.delta = nn.Parameter(torch.zeros(hidden_layers, width)) if conditions else None
        self.output_weight = nn.Parameter(torch.randn(out_channels, width))
        self.output_bias = nn.Parameter(torch.zeros(out_channels))
        scales = ladder(1 / coarsest, 1 / finest, octaves)
        self.register_buffer("scales", scales.expand(-1, 3, 3).clone())
        self.register_buffer("color_mean", torch.zeros(out_channels))
        self.register_buffer("color_basis", torch.eye(out_channels))

    @property
    def transforms(self) -> Tensor:
        """T_i [octave, 3, 3]; scales are separate parameters so that one learning rate suits all
        octaves.
        """
        return self.linear * self.scales

    def forward(self, points: Tensor, lattice: Lattice) -> Tensor:
        """Whitened colors y [point, channel] at points [point, 3]."""
        with torch.autocast(points.device.type, enabled=False):  # positions need all their bits
            positions = torch.einsum("nij,pj->npi", self.transforms, points)
            eta = trilinear(lattice, positions).T
        x = self.constant[None]
        for i, layer in enumerate(self.hidden):
            octaves = eta[:, i * self.bin_size : (i + 1) * self.bin_size]
            x = layer(x, octaves if layer.noise is not None else None)
            if self.gamma is not None and self.delta is not None:
                x = torch.addcmul(self.delta[i].to(x.dtype), x, self.gamma[i].to(x.dtype))
        return F.linear(x, _equalized(self.output_weight), self.output_bias)

    def colors(self, y: Tensor) -> Tensor:
        """Colors of whitened values y [batch, channel, ...]."""
        shape = (1, -1, *[1] * (y.ndim - 2))
        mixed = torch.einsum("ij,bj...->bi...", self.color_basis, y)
        return mixed + self.color_mean.view(shape)

    @torch.no_grad()
    def effective_tensors(self) -> dict[str, Tensor]:
        """The tensors of the file format, in float64; the color affine is folded into `output`.

        The format has a bin of octaves for each hidden layer but the last. Where the network has
        none, transforms and noise columns are zero.
        """
        f64 = torch.float64
        basis = self.color_basis.to(f64)
        bins = len(self.hidden) - 1
        absent = basis.new_zeros(bins * self.bin_size - self.octaves, 3, 3)
        tensors = {
            "transforms": torch.cat([self.linear.to(f64) * self.scales.to(f64), absent]),
            "constant": self.constant.to(f64),
            "output.weight": basis @ _equalized(self.output_weight, dtype=f64),
            "output.bias": basis @ self.output_bias.to(f64) + self.color_mean.to(f64),
        }
        for i, layer in enumerate(self.hidden):
            for name, tensor in layer.effective(f64).items():
                tensors[f"hidden.{i}.{name}"] = tensor
            if i < bins and layer.noise is None:
                tensors[f"hidden.{i}.noise"] = basis.new_zeros(len(layer.bias), self.bin_size)
        self._fold_conditions(tensors)
        return tensors

    def _fold_conditions(self, tensors: dict[str, Tensor]) -> None:
        """Fold gamma and delta of each hidden layer into the layer after it."""
        if self.gamma is None or self.delta is None:
            return
        after = [f"hidden.{i}" for i in range(1, len(self.hidden))] + ["output"]
        for name, gamma, delta in zip(after, self.gamma.double(), self.delta.double(), strict=True):
            weight = tensors[f"{name}.weight"]
            tensors[f"{name}.bias"] = tensors[f"{name}.bias"] + weight @ delta
            tensors[f"{name}.weight"] = weight * gamma


def _equalized(weight: Tensor, gain: float = 1.0, dtype: torch.dtype | None = None) -> Tensor:
    return weight.to(dtype or weight.dtype) * (gain / math.sqrt(weight.shape[1]))


def _rotations(count: int) -> Tensor:
    """`count` uniformly random rotations [count, 3, 3]."""
    q, r = torch.linalg.qr(torch.randn(count, 3, 3))
    q = q * torch.sign(torch.diagonal(r, dim1=1, dim2=2))[:, None, :]
    return q * torch.linalg.det(q)[:, None, None]
