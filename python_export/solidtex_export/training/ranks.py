"""Distributed training: the ranks that torchrun starts, or a single process.

Each rank draws its own slices. Gradients are averaged, so all ranks hold the same networks. Rank 0
alone writes the result, and decides by its clock when to save and stop.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from typing import Any

import torch
import torch.distributed as dist

# Before there is a group: default arguments of its functions keep one that they find. Optimizers
# import it later, so Gloo's threads outlived Python, which sometimes aborted a finished training.
import torch.distributed.nn.functional
from torch import Tensor, nn

SEED_STEP = 1_000_003  # between the random streams of two ranks


class Ranks:
    """Communication between ranks; does nothing for a single process."""

    def __init__(self, rank: int = 0, count: int = 1, device: torch.device | None = None) -> None:
        self.rank = rank
        self.count = count
        self._device = device or torch.device("cpu")

    @property
    def is_main(self) -> bool:
        return self.rank == 0

    def seed(self, seed: int) -> int:
        """Random seed of this rank; rank 0 uses the training's own."""
        return seed + SEED_STEP * self.rank

    def average_gradients(self, network: nn.Module) -> None:
        self.average([p.grad for p in network.parameters() if p.grad is not None])

    def average(self, tensors: Sequence[Tensor]) -> None:
        """Average tensors over the ranks in place."""
        if self.count == 1:
            return
        flat = torch.cat([t.flatten() for t in tensors])
        dist.all_reduce(flat)
        parts = (flat / self.count).split([t.numel() for t in tensors])
        for tensor, part in zip(tensors, parts, strict=True):
            tensor.copy_(part.view_as(tensor))

    def agree(self, *values: float) -> list[float]:
        """Broadcast rank 0's values."""
        if self.count == 1:
            return list(values)
        shared = torch.tensor(values, dtype=torch.float64, device=self._device)
        dist.broadcast(shared, src=0)
        return shared.tolist()

    def gather(self, value: Any) -> list[Any]:
        """Gather every rank's value on rank 0; other ranks get only their own."""
        if self.count == 1:
            return [value]
        values: list[Any] | None = [None] * self.count if self.is_main else None
        dist.gather_object(value, values, dst=0)
        return values if values is not None else [value]

    def own(self, values: list[Any]) -> Any:
        """This rank's value of those that `gather` returned; refuses another number of ranks."""
        if len(values) != self.count:
            raise ValueError(f"found the state of {len(values)} processes, expected {self.count}")
        return values[self.rank]

    def wait(self) -> None:
        if self.count > 1:
            dist.barrier()


def join(use_cuda: bool) -> tuple[Ranks, torch.device]:
    """Join torchrun's process group; returns the communication and this rank's device."""
    count = int(os.environ.get("WORLD_SIZE", "1"))
    if count == 1:
        return Ranks(), torch.device("cuda" if use_cuda else "cpu")
    rank, local = int(os.environ["RANK"]), int(os.environ["LOCAL_RANK"])
    device = torch.device(f"cuda:{local}" if use_cuda else "cpu")
    if use_cuda:
        torch.cuda.set_device(device)
    if not dist.is_initialized():
        dist.init_process_group("nccl" if use_cuda else "gloo")
    return Ranks(rank, count, device), device


def leave() -> None:
    if dist.is_initialized():
        dist.destroy_process_group()


def on_cpu(tensors: Iterable[Tensor]) -> list[Tensor]:
    return [t.cpu() for t in tensors]
