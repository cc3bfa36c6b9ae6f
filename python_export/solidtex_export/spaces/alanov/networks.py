"""The five networks of Alanov et al. 2019, appendices C and E, for images and volumes.

Differences from the paper: the generator is not padded, so it has no border and its crops begin at
any texel, not at multiples of its coarsest pitch. Batch normalization keeps a slow average of its
statistics, where the paper's momentum of 1 keeps those of the last batch.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Sequence
from typing import Any, TypeVar

import torch
import torch.nn.functional as F
from torch import Tensor, nn
from torch.nn.utils.parametrizations import spectral_norm

from solidtex_export.generators.regions import Box
from solidtex_export.spaces.alanov.settings import AlanovRecipe, Networks

INITIAL_DEVIATION = 0.02
# Convolution of D_psi and D_tau without spectral normalization (tables 6, 7, 13 and 14), or the
# last of fewer. Without a free one D_tau's logits stay near 0, and it tells nothing:
# docs/experiments/alanov.md.
FREE_CONVOLUTION = 2
FREQUENCY_RANGE = math.pi / 2  # of the first frequencies, either sign, in radians a voxel
STATISTICS_MOMENTUM = 0.05
MEASURED_BATCHES = 16  # that statistics of batch normalization are measured over
# Of convolutions by the number of dimensions; those of stride 2 halve the side exactly.
KERNELS, PADDINGS = {2: 5, 3: 4}, {2: 2, 3: 1}

Module = TypeVar("Module", bound=nn.Module)

_CONVOLUTIONS: dict[int, type[nn.Conv2d | nn.Conv3d]] = {2: nn.Conv2d, 3: nn.Conv3d}


def convolution(dimensions: int, channels: tuple[int, int], last: bool = False) -> nn.Module:
    """A convolution of stride 2; the last one in 3D has stride 1 and no padding."""
    kernel, padding = KERNELS[dimensions], PADDINGS[dimensions]
    stride = 2
    if last and dimensions == 3:
        stride, padding = 1, 0
    return drawn(_CONVOLUTIONS[dimensions](*channels, kernel, stride, padding))


@torch.no_grad()
def drawn(network: Module) -> Module:
    """Draw the weights from N(0, 0.02) (table 10). Scales of batch normalizations stay 1."""
    for name, parameter in network.named_parameters():
        if "norms" in name:
            continue
        if name.endswith("bias"):
            parameter.zero_()
        else:
            parameter.normal_(0, INITIAL_DEVIATION)
    return network


def normalizations(dimensions: int, widths: Sequence[int]) -> nn.ModuleList:
    norm = nn.BatchNorm2d if dimensions == 2 else nn.BatchNorm3d
    return nn.ModuleList(norm(width, momentum=STATISTICS_MOMENTUM) for width in widths)


def measure_statistics(
    network: nn.Module, norms: Iterable[nn.Module], batches: Iterable[Any]
) -> None:
    """Set the running statistics of `norms` to plain averages over batches; leaves eval mode."""
    for norm in norms:
        norm.reset_running_stats()  # type: ignore[operator]
        norm.momentum = None  # type: ignore[assignment]  # a plain average
    network.train()
    for batch in batches:
        network(*batch) if isinstance(batch, tuple) else network(batch)
    for norm in norms:
        norm.momentum = STATISTICS_MOMENTUM  # type: ignore[assignment]
    network.eval()


class TransposedLayer(nn.Module):
    """Transposed convolution of stride 2 without bias: o = 2 i + t - padding."""

    def __init__(self, dimensions: int, inputs: int, outputs: int) -> None:
        super().__init__()
        self.dimensions = dimensions
        self.kernel, self.padding = KERNELS[dimensions], PADDINGS[dimensions]
        self.weight = nn.Parameter(torch.empty(inputs, outputs, *[self.kernel] * dimensions))

    def needed(self, box: Box) -> Box:
        return box.of_transpose(self.kernel, self.padding)

    def forward(self, x: Tensor, box: Box) -> Tensor:
        """Values on `box` from inputs on its needed box."""
        transposed = F.conv_transpose2d if self.dimensions == 2 else F.conv_transpose3d
        y = transposed(x, self.weight, stride=2)
        for axis, (first, lo, hi) in enumerate(
            zip(self.needed(box).lo, box.lo, box.hi, strict=True)
        ):
            y = y.narrow(2 + axis, lo - (2 * first - self.padding), hi - lo)
        return y


class FirstLayer3d(nn.Module):
    """First layer of the 3D generator: stride 1, kernel 4, no padding, no bias."""

    BEFORE, AFTER = 2, 1  # voxels that a value needs on either side of its own

    def __init__(self, inputs: int, outputs: int) -> None:
        super().__init__()
        self.weight = nn.Parameter(torch.empty(outputs, inputs, 4, 4, 4))

    def needed(self, box: Box) -> Box:
        lo, hi = (v - self.BEFORE for v in box.lo), (v + self.AFTER for v in box.hi)
        return Box(tuple(lo), tuple(hi))

    def forward(self, x: Tensor, box: Box) -> Tensor:
        return F.conv3d(x, self.weight)


def positions(box: Box, device: torch.device) -> Tensor:
    """Coordinates [axis, ...] of the voxels of a box."""
    axes = [torch.arange(a, b, device=device) for a, b in zip(box.lo, box.hi, strict=True)]
    return torch.stack(torch.meshgrid(*axes, indexing="ij")).float()


class Generator(nn.Module):
    """G_theta: noise z = [code, local, periodic] on a coarse lattice to values of -1 ... 1."""

    def __init__(self, recipe: AlanovRecipe) -> None:
        super().__init__()
        self.recipe, dims = recipe, recipe.dimensions
        noise, widths = recipe.noise, recipe.networks.generator
        inputs = recipe.code + noise.local + noise.periodic
        sizes = list(itertools.pairwise((inputs, *widths, recipe.channels)))
        layers: list[nn.Module] = []
        if dims == 3:
            layers.append(FirstLayer3d(*sizes.pop(0)))
        layers += [TransposedLayer(dims, *pair) for pair in sizes]
        self.layers: Sequence[TransposedLayer | FirstLayer3d] = nn.ModuleList(layers)  # type: ignore[assignment]
        self.norms: Sequence[nn.BatchNorm2d] = normalizations(dims, widths)  # type: ignore[assignment]
        self.frequencies = nn.Sequential()
        if noise.periodic:
            last = nn.Linear(noise.hidden, dims * noise.periodic)
            self.frequencies.extend([nn.Linear(recipe.code, noise.hidden), nn.ReLU(), last])
        drawn(self)
        if noise.periodic:
            nn.init.uniform_(last.bias, -FREQUENCY_RANGE, FREQUENCY_RANGE)

    @property
    def levels(self) -> int:
        """Level of the noise: one of its voxels is 2^levels texels wide."""
        return sum(isinstance(layer, TransposedLayer) for layer in self.layers)

    def boxes(self, box: Box) -> list[Box]:
        """Boxes of the noise and of every layer's output for a box of texels."""
        found = [box]
        for layer in reversed(self.layers):
            found.insert(0, layer.needed(found[0]))
        return found

    def angular_frequencies(self, codes: Tensor) -> Tensor:
        """a_k and b_k [batch, channel, axis], in radians a voxel of the noise."""
        return self.frequencies(codes).unflatten(1, (self.recipe.noise.periodic, -1))

    def noise(self, codes: Tensor, box: Box) -> Tensor:
        """z of section 2 on a box of the noise's level; draws z^l and xi."""
        sizes, count = self.recipe.noise, len(codes)
        spatial = [1] * len(box.size)
        shared = codes.view(*codes.shape, *spatial).expand(-1, -1, *box.size)
        local = torch.randn(count, sizes.local, *box.size, device=codes.device)
        if sizes.periodic == 0:
            return torch.cat([shared, local], dim=1)
        offset = 2 * math.pi * torch.rand(count, sizes.periodic, device=codes.device)
        frequencies = self.angular_frequencies(codes)
        angles = torch.einsum("bka,a...->bk...", frequencies, positions(box, codes.device))
        periodic = torch.sin(angles + offset.view(*offset.shape, *spatial))
        return torch.cat([shared, local, periodic], dim=1)

    def forward(self, codes: Tensor, box: Box) -> Tensor:
        """Samples [batch, channel, ...] of a box, each with noise of its own."""
        return self.from_noise(self.noise(codes, self.boxes(box)[0]), box)

    def from_noise(self, z: Tensor, box: Box) -> Tensor:
        """Samples of a box from z on the box of noise that it needs."""
        boxes, x = self.boxes(box), z
        for i, layer in enumerate(self.layers):
            x = layer(x, boxes[i + 1])
            if i < len(self.norms):
                x = F.leaky_relu(self.norms[i](x), self.recipe.networks.slope)
        return torch.tanh(x)

    def random_box(self, size: int) -> Box:
        """A cube at a random place in one voxel of the noise."""
        dims = self.recipe.dimensions
        lo = tuple(int(v) for v in torch.randint(2**self.levels, (dims,)))
        return Box(lo, tuple(v + size for v in lo))

    @torch.no_grad()
    def measure(self, codes: Tensor, size: int) -> None:
        """Set the running statistics to averages over batches of codes [batches, batch, code]."""
        inputs = ((batch, self.random_box(size)) for batch in codes)
        measure_statistics(self, self.norms, inputs)


class Encoder(nn.Module):
    """E_phi: crop to the mean and the logarithm of the deviation of its code."""

    def __init__(self, recipe: AlanovRecipe) -> None:
        super().__init__()
        dims, widths = recipe.dimensions, recipe.networks.encoder
        self.slope = recipe.networks.slope
        self.convolutions = nn.ModuleList(
            convolution(dims, pair) for pair in itertools.pairwise((recipe.channels, *widths))
        )
        self.norms = normalizations(dims, widths[1:])
        self.last = convolution(dims, (widths[-1], 2 * recipe.code), last=True)

    def features(self, x: Tensor) -> Tensor:
        """Mean and logarithm of the deviation at every position, before they are averaged."""
        for i, layer in enumerate(self.convolutions):
            x = layer(x)
            if i > 0:
                x = self.norms[i - 1](x)
            x = F.leaky_relu(x, self.slope)
        return self.last(x)

    @torch.no_grad()
    def measure(self, crops: Iterable[Tensor]) -> None:
        """Set the running statistics to averages over batches of crops."""
        measure_statistics(self, self.norms, crops)

    def forward(self, x: Tensor) -> tuple[Tensor, Tensor]:
        """Mean and deviation [batch, code]."""
        mean, log_deviation = self.features(x).flatten(2).mean(2).chunk(2, dim=1)
        return mean, log_deviation.exp()


def networks_of(model: nn.Module) -> tuple[Generator, Encoder]:
    """The two networks of a model {generator, encoder}."""
    generator, encoder = model.get_submodule("generator"), model.get_submodule("encoder")
    assert isinstance(generator, Generator) and isinstance(encoder, Encoder)
    return generator, encoder


class PatchDiscriminator(nn.Module):
    """D_psi: a logit for each receptive field of a crop."""

    def __init__(self, recipe: AlanovRecipe) -> None:
        super().__init__()
        self.layers = _normalized_layers(recipe, recipe.networks.patches, 1)
        self.slope = recipe.networks.slope

    def forward(self, x: Tensor) -> Tensor:
        return _chain(self.layers, x, self.slope)


class PairDiscriminator(nn.Module):
    """D_tau of figure 3: whether two crops are of one texture, for each receptive field of both."""

    def __init__(self, recipe: AlanovRecipe) -> None:
        super().__init__()
        networks: Networks = recipe.networks
        self.layers = _normalized_layers(recipe, networks.pairs, networks.embedding)
        widths = (networks.embedding, *networks.products, 1)
        self.products = nn.ModuleList(
            spectral_norm(drawn(nn.Conv2d(a, b, 1))) for a, b in itertools.pairwise(widths)
        )
        self.slope = networks.slope

    def embed(self, x: Tensor) -> Tensor:
        """Embeddings [batch, channel, position]."""
        return _chain(self.layers, x, self.slope).flatten(2)

    def compare(self, first: Tensor, second: Tensor) -> Tensor:
        """Logits [batch, positions of the first, then of the second]."""
        # Products of all pairs of positions meet the first layer without being stored.
        layer = self.products[0]
        assert isinstance(layer, nn.Conv2d) and layer.bias is not None
        weighted = torch.einsum("oc,bci->boic", layer.weight.flatten(1), first)
        x = torch.einsum("boic,bcj->boij", weighted, second)
        x = x + layer.bias.to(x.dtype)[:, None, None]
        for layer in self.products[1:]:
            x = layer(F.leaky_relu(x, self.slope))
        similarity = x[:, 0]
        return torch.cat([similarity.mean(2), similarity.mean(1)], dim=1)

    def forward(self, first: Tensor, second: Tensor) -> Tensor:
        return self.compare(self.embed(first), self.embed(second))


class CodeDiscriminator(nn.Module):
    """D_zeta: whether a code is of the prior N(0, 1)."""

    def __init__(self, recipe: AlanovRecipe) -> None:
        super().__init__()
        widths = (recipe.code, *recipe.networks.codes, 1)
        self.layers = nn.ModuleList(nn.Linear(a, b) for a, b in itertools.pairwise(widths))
        self.slope = recipe.networks.slope
        drawn(self)

    def forward(self, codes: Tensor) -> Tensor:
        return _chain(self.layers, codes, self.slope)


def _normalized_layers(recipe: AlanovRecipe, widths: Sequence[int], outputs: int) -> nn.ModuleList:
    """Strided convolutions, all but one with spectral normalization; the last has `outputs`."""
    pairs = itertools.pairwise((recipe.channels, *widths, outputs))
    count = len(widths)

    def layer(i: int, channels: tuple[int, int]) -> nn.Module:
        made = convolution(recipe.dimensions, channels, i == count)
        return made if i == min(FREE_CONVOLUTION, count) else spectral_norm(made)

    return nn.ModuleList(layer(i, channels) for i, channels in enumerate(pairs))


def _chain(layers: nn.ModuleList, x: Tensor, slope: float) -> Tensor:
    """Layers with leaky ReLUs between them."""
    for i, layer in enumerate(layers):
        x = layer(x if i == 0 else F.leaky_relu(x, slope))
    return x
