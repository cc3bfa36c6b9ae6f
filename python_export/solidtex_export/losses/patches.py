"""Distance of patches of a slice to the nearest patches of the photograph, and the reverse.

After "Summarizing visual data using bidirectional similarity" (Simakov, Caspi, Shechtman and Irani
2008, equation 1). Gram matrices and covariances measure the amount of edges, not their continuity;
a broken edge gives patches without a near neighbor. The finest octave is left out, since the mean
of near patches has no grain. docs/experiments/patches.md lists what was tried.
"""

from __future__ import annotations

import torch
import torch.nn.functional as F
from torch import Tensor

SIDE = 7  # of a patch, in pixels of its octave
FIRST_OCTAVE, OCTAVES = 1, 3
FAKES, REALS = 1536, 2048  # patches of each octave, new for every call
MISSING = 4.0  # how much more it counts that the slice lacks a patch; with 1 there were few cracks


def patch_distance(slices: Tensor, reals: Tensor) -> Tensor:
    """Sum over octaves of mean squared distances of patches, in both directions.

    Arguments are whitened values of two batches [batch, channel, rows, columns], which may differ
    in size.
    """
    slices, reals = slices.float(), reals.float()
    distances = []
    for octave in range(FIRST_OCTAVE, FIRST_OCTAVE + OCTAVES):
        pair = [F.avg_pool2d(images, 2**octave) for images in (slices, reals)]
        if min(side for images in pair for side in images.shape[2:]) < SIDE:
            break
        distances.append(_distance(*pair))
    if not distances:
        least = SIDE * 2**FIRST_OCTAVE
        raise ValueError(
            f"images: found {tuple(slices.shape[2:])} and {tuple(reals.shape[2:])} pixels,"
            f" expected at least {least} x {least}"
        )
    return torch.stack(distances).sum()


def _distance(slices: Tensor, reals: Tensor) -> Tensor:
    with torch.autocast(slices.device.type, enabled=False):
        fakes, reals = random_patches(slices, FAKES), random_patches(reals, REALS)
        between = torch.cdist(fakes.detach(), reals)
        strange = (fakes - reals[between.argmin(1)]).square().mean()
        missing = (reals - fakes[between.argmin(0)]).square().mean()
        return strange + MISSING * missing


def random_patches(images: Tensor, count: int) -> Tensor:
    """Patches at random places, at most the given number: [patch, value]."""
    windows = images.unfold(2, SIDE, 1).unfold(3, SIDE, 1).permute(0, 2, 3, 1, 4, 5)
    places = torch.randperm(windows.shape[:3].numel())[:count].to(images.device)
    return windows[torch.unravel_index(places, windows.shape[:3])].flatten(1)
