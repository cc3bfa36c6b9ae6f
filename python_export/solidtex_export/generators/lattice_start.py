"""Initial weights of the lattice generator that draw outlines before they draw grain.

As it is built, all levels of noise speak alike, and what comes from a coarser level is met by
random kernels, which roughen it and bring out the edges of its voxels. Training then has to unlearn
both: long veins were rows of short strokes, along the axes.
"""

from __future__ import annotations

import torch

from solidtex_export.generators.lattice import LatticeGenerator


@torch.no_grad()
def smooth_coarse_features(generator: LatticeGenerator, share: float) -> None:
    """Lets that share of the variance of the weights that read upsampled features smooth them.

    Channels are mixed at random, each by a binomial kernel [1 2 1]^3, which makes nearly linear
    interpolation of nearest-neighbour upsampling. The size of the weights stays.
    """
    if share == 0:
        return  # draws no random numbers
    row = torch.tensor([1.0, 2.0, 1.0])
    kernel = torch.einsum("x,y,z->xyz", row, row, row)
    kernel /= kernel.norm()
    for stage in range(2, generator.levels + 1):
        weight = generator.get_parameter(f"cb{stage}_2.conv1.weight")
        channels = len(generator.get_parameter(f"up{stage - 1}.bn.weight"))
        coarse = weight[:, :channels]
        size = coarse.square().sum((2, 3, 4)).mean().sqrt()
        mixing = size * torch.randn(coarse.shape[:2])
        coarse.mul_((1 - share) ** 0.5)
        coarse.add_(share**0.5 * mixing[..., None, None, None] * kernel)


@torch.no_grad()
def quiet_fine_noise(generator: LatticeGenerator, gain: float) -> None:
    """Scales what the noise of each level but the coarsest gives."""
    for stage in range(2, generator.levels + 1):
        generator.get_parameter(f"cb{stage}_1.bn3.weight").mul_(gain)
