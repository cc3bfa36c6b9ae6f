"""Initial weights of generators.

A lattice that starts smooth forms outlines before grain. A sampler with grain along z starts with
long octaves, and with short ones of weight zero: docs/experiments/sampler-octaves.md.
"""

from __future__ import annotations

import torch

from solidtex_export.generators.lattice import LatticeGenerator
from solidtex_export.generators.sampler import OctaveSampler, ladder


@torch.no_grad()
def smooth_coarse_features(generator: LatticeGenerator, share: float) -> None:
    """Give `share` of the variance of the weights that read upsampled features to smoothing
    filters.

    Channels are mixed at random, each through a binomial kernel [1 2 1]^3, which turns
    nearest-neighbor upsampling into nearly linear interpolation. The variance of the weights stays.
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
    """Scale the noise output of every level but the coarsest."""
    for stage in range(2, generator.levels + 1):
        generator.get_parameter(f"cb{stage}_1.bn3.weight").mul_(gain)


@torch.no_grad()
def init_grain(sampler: OctaveSampler, grain: float, short: int) -> None:
    """Stretch all octaves but the last `short` ones by `grain` along z, or by 1 / `grain` along x
    and y where it is below 1.

    The stretched octaves cover the ladder from the coarsest spacing to the finest. The short ones
    start near the finest spacing, from round to almost as long, with weight zero; training raises
    those weights where the long octaves do not suffice.
    """
    coarsest, finest = (float(sampler.scales[i, 0, 0]) for i in (0, -1))
    long = sampler.octaves - short
    part = (torch.arange(short) / max(short, 1)).view(-1, 1, 1)
    sampler.scales[:long] = ladder(coarsest, finest, long)
    sampler.scales[long:] = finest / 2**part
    scales, stretch = sampler.scales[..., 2:], grain
    if grain < 1:
        scales, stretch = sampler.scales[..., :2], 1 / grain
    scales[:long] /= stretch
    scales[long:] /= stretch**part
    for octave in range(long, sampler.octaves):
        layer, column = divmod(octave, sampler.bin_size)
        noise = sampler.hidden[layer].noise
        assert noise is not None
        noise[:, column] = 0
