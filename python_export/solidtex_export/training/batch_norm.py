"""Statistics of batch normalization, measured over several slices."""

from __future__ import annotations

import torch
from torch import nn

from solidtex_export.generators.slices import SliceSource
from solidtex_export.training.ranks import Ranks

SLICES = 12


@torch.no_grad()
def measure_statistics(
    generator: nn.Module, slices: SliceSource, directions: str, size: int, ranks: Ranks
) -> None:
    """Set running statistics to averages over slices of all ranks; leaves the generator in eval
    mode.

    Each slice is normalized by its own statistics during the measurement.
    """
    norms = [m for m in generator.modules() if isinstance(m, nn.BatchNorm3d)]
    if norms:
        generator.train()
        momenta = [norm.momentum for norm in norms]
        for norm in norms:
            norm.reset_running_stats()
            norm.momentum = None  # a plain average
        for i in range(SLICES):
            slices.draw(directions[i % len(directions)], size, 1)
        for norm, momentum in zip(norms, momenta, strict=True):
            norm.momentum = momentum
        averages = [s for n in norms for s in (n.running_mean, n.running_var)]
        ranks.average([s for s in averages if s is not None])
    generator.eval()
