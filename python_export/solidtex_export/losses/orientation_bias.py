"""Orientation bias that all slices of one view share, though the photograph has none.

A bias is what a symmetry of the photograph excludes. Where the photograph may be flipped, it is a
difference of energy between the two diagonals; where it may be turned too, also one between columns
and rows. Single slices have a random bias. So the bias is averaged over recent slices of a view,
and the loss uses only the significant part of the average: docs/experiments/orientation-bias.md.
"""

from __future__ import annotations

import torch
from torch import Tensor

WEIGHT = 0.2
MEMORY = 32.0  # slices that the average goes back
CERTAINTY = 2.0  # variances of the average that its square must exceed to be significant


def orientation_bias(energies: Tensor, symmetry: str) -> Tensor:
    """Shares of energy [octave, 1 or 2] that vanish for an image with the symmetry.

    `energies` [octave, 4] are those of waves across columns, rising, across rows and falling.
    """
    across, rising, down, falling = energies.unbind(1)
    forbidden = [rising - falling]
    if symmetry == "all":
        forbidden.append(across - down)
    return torch.stack(forbidden, dim=1) / (across + rising + down + falling).unsqueeze(1)


class CommonBias:
    """Running average of the bias of the slices of one view."""

    def __init__(self) -> None:
        self._seen = 0
        self._mean = self._square = torch.zeros(())

    def loss(self, found: Tensor) -> Tensor:
        """Product of a slice's bias [octave, 1 or 2] and the significant part of the average bias.

        Units are their variances. The loss is negative where the slice's bias opposes the average.
        The call adds the slice to the average.
        """
        share = max(1 / MEMORY, 1 / (self._seen + 1))
        seen = found.detach()
        square = seen.square().sum(1, keepdim=True)
        if self._seen == 0:
            self._mean, self._square = seen, square
        self._mean = torch.lerp(self._mean, seen, share)
        self._square = torch.lerp(self._square, square, share)
        self._seen += 1
        chance = share * self._square / (self._mean.square().sum(1, keepdim=True) + 1e-12)
        certain = (1 - CERTAINTY * chance).clamp_min(0)
        common = certain * self._mean / (self._square + 1e-12)
        return WEIGHT * (common * found).sum(1).mean()

    def state(self) -> list[object]:
        return [self._seen, self._mean.cpu(), self._square.cpu()]

    def restore(self, state: list[object], device: torch.device) -> None:
        seen, mean, square = state
        assert isinstance(seen, int) and isinstance(mean, Tensor) and isinstance(square, Tensor)
        self._seen, self._mean, self._square = seen, mean.to(device), square.to(device)
