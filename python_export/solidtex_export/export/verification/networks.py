"""Trained torch networks evaluated in float64 on the engine's noise, without folding.

An exported file has to reproduce their values. Batch normalization, color affine and equalized
learning rates are as training left them.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import torch
from torch import Tensor

from solidtex_export.export.verification import noise
from solidtex_export.generators.lattice import BaseLattice, Box
from solidtex_export.generators.sampler import OctaveSampler

Network = Callable[[Sequence[int], Sequence[int], int], np.ndarray]
"""(origin, size, seed) -> the voxels of a box, float64 [x, y, z, channel]."""


def lattice_network(generator: BaseLattice, scheme: str) -> Network:
    """The generator with its running statistics; it is converted to float64."""
    generator = generator.double().eval()
    draws = generator.distribution

    @torch.no_grad()
    def evaluate(origin: Sequence[int], size: Sequence[int], seed: int) -> np.ndarray:
        box = Box(tuple(origin), tuple(o + s for o, s in zip(origin, size, strict=True)))
        z = [
            noise.block(scheme, draws, seed, level, generator.noise_channels, b.lo, b.hi)
            for level, b in enumerate(generator.noise_boxes(box))
        ]
        y = generator([torch.from_numpy(values)[None] for values in z], box)
        return generator.colors(y)[0].permute(1, 2, 3, 0).numpy()

    return evaluate


def sampler_network(network: OctaveSampler, scheme: str) -> Network:
    """The network in float64; transforms are rounded to float32, as files store them.

    This rounding is a choice of transforms, not an error: far from the origin it moves the lookup
    by whole cells.
    """
    network = network.double().eval()
    stored = network.transforms.detach().float().double()
    network.scales = torch.ones_like(network.scales)
    network.linear = torch.nn.Parameter(stored)

    @torch.no_grad()
    def evaluate(origin: Sequence[int], size: Sequence[int], seed: int) -> np.ndarray:
        axes = [o + 0.5 + torch.arange(s).double() for o, s in zip(origin, size, strict=True)]
        points = torch.stack(torch.meshgrid(*axes, indexing="ij"), dim=-1).view(-1, 3)

        def lattice(cells: Tensor) -> Tensor:
            octaves = enumerate(cells.long().numpy())
            return torch.from_numpy(
                np.stack([noise.normal(scheme, seed, i, 0, *octave.T) for i, octave in octaves])
            )

        colors = network.colors(network(points, lattice))
        return colors.view(*size, -1).numpy()

    return evaluate
