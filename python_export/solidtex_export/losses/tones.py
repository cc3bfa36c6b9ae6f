"""Which colours there are, and how much of each: sliced Wasserstein distance of pixels.

Gram matrices and covariances fix the second moments of what they see, and leave the rest of a
distribution free: flat grey flakes on rust came out as streaks with white cores, brighter than
anything in the photograph. Sorted projections have no such freedom. The distance is that of Rabin,
Peyré, Delon and Bernot 2012 ("Wasserstein barycenter and its application to texture mixing");
Heitz, Vanhoey, Chambon and Belcour 2021 ("A sliced Wasserstein loss for neural texture synthesis")
take it of VGG-19's features. Ours is of colours, on some octaves, since a flat patch has its tone
when it is reduced, too, and a speckled one has not.

A slice is compared with the whole exemplar: crops whose shares differ would pull it towards their
barycentre, in which two tones have a third between them.

Early it harms: what is dark already becomes darker, so that veins which have yet to be found
leave gaps (marble, 600 steps). So lattice.toml lets it join later.

Tried with crops, 600 steps each, by eye, with weights beside the other losses' 2.4:
0.3 leaves some white cores, 0.5 hardly any, and beige granite has its black specks; 1 gives flatter
flakes yet, but the granite's grains a slant. Our descriptor's features instead of colours (32
directions per layer), beside its Gram matrices or in their place, kept the white cores.
"""

from __future__ import annotations

import torch
import torch.nn.functional as F
from torch import Tensor

OCTAVES = 3
DIRECTIONS = 6  # of each octave, new for every call


def tone_distance(slices: Tensor, exemplar: Tensor) -> Tensor:
    """Sum over octaves of the mean squared distance of sorted projections.

    Whitened values: `slices` [batch, channel, rows, columns], `exemplar` [channel, rows, columns].
    """
    exemplar = exemplar[None]
    distance = _sliced_wasserstein(slices, exemplar)
    for _ in range(OCTAVES - 1):
        if min(*slices.shape[2:], *exemplar.shape[2:]) < 2:
            break
        slices, exemplar = F.avg_pool2d(slices, 2), F.avg_pool2d(exemplar, 2)
        distance = distance + _sliced_wasserstein(slices, exemplar)
    return distance


def _sliced_wasserstein(slices: Tensor, exemplar: Tensor) -> Tensor:
    fakes, reals = (images.float().transpose(0, 1).flatten(1) for images in (slices, exemplar))
    directions = F.normalize(torch.randn(DIRECTIONS, len(fakes)), dim=1).to(fakes.device)
    fake, real = ((directions @ colours).sort(dim=1).values for colours in (fakes, reals))
    even = (torch.arange(fake.shape[1], device=real.device) + 0.5) / fake.shape[1]
    return (fake - real[:, (even * real.shape[1]).long()]).square().mean()
