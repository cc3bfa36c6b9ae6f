"""Reproducible training: the same bits in every run with the same number of threads of one CPU."""

from __future__ import annotations

import torch


def make_reproducible(seed: int, device: torch.device) -> None:
    """Seed torch, and use deterministic sums on a CPU.

    Otherwise threads add in the order of their arrival, as in the gradient of an indexed read: in
    float32 30 runs of 6 steps gave 30 networks. Deterministic sums take 2 % longer (128 x 128 by
    `lattice`, on two cores). On a GPU some operations have none.
    """
    torch.manual_seed(seed)
    torch.use_deterministic_algorithms(device.type == "cpu")
    # Nothing reads uninitialized memory, and filling it takes 2% more. torch's stubs lack the name.
    torch.utils.deterministic.fill_uninitialized_memory = False  # type: ignore[attr-defined]
