"""Initial octaves of a sampler.

With grain along z it starts with long octaves, and with short ones of weight zero:
docs/experiments/sampler-octaves.md.
"""

from __future__ import annotations

import torch

from solidtex_export.generators.sampler import OctaveSampler, ladder


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
