"""Training of phases: the generator's values are logits, slices show probabilities.

Losses compare a slice with the exemplar's indicators, in their whitened coordinates, so its phases
become sharp. They see softmax(logits) + LEAK * logits. Without the leak a voxel that is sure of its
phase has no gradient: a solid of one phase would stay so. The leak also keeps logits small, since
large ones exceed the indicators, and with them the engine's rounding errors.

The distribution of values, a term of the loss, holds the fractions during the training; at its end
the logits are shifted until the most probable phases have the fractions of the exemplars. Slices
differ: one of 96 pixels may have a tenth more or less of a phase than the solid. So they are drawn
until the standard error of their mean is small.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import torch
from torch import Tensor

from solidtex_export.generators.lattice import BaseLattice
from solidtex_export.generators.slices import LatticeSlices, SliceSource
from solidtex_export.images.exemplar import Exemplar

LEAK = 0.03  # of logits into what losses see
FEWEST_SLICES = 96  # whose fractions are counted at the end
MOST_SLICES = 4096
SLICES_PER_STEP = 16  # at most, so that a trial of a few steps does not wait for its fractions
STANDARD_ERROR = 3e-3  # of the fractions, relative to them, at which no more slices are drawn
RARE = 0.02  # fraction below which the error of a phase does not ask for more slices
STRIDE = 2  # between counted pixels: those between add next to nothing to the mean
ROUNDS = 30
LEAST_FRACTION = 1e-4  # below which a phase counts as this rare


class PhaseTraining:
    """The fractions of the exemplars, and the axes in which slices are compared with them."""

    def __init__(
        self, generator: BaseLattice, exemplars: Sequence[Exemplar], mean: Tensor, basis: Tensor
    ) -> None:
        self.generator = generator
        self.mean = mean
        self.inverse = torch.linalg.inv(basis.double()).float()
        sections = [e.image.double().mean((1, 2)) for e in exemplars]
        self.fractions = torch.stack(sections).mean(0).clamp_min(LEAST_FRACTION)
        generator.color_mean.copy_(self.fractions.log())
        generator.color_basis.copy_(torch.eye(len(mean)))

    def probabilities_of(self, logits: SliceSource) -> PhaseSlices:
        return PhaseSlices(logits, self)

    @torch.no_grad()
    def hold_fractions(
        self, directions: str, size: int, steps: int, goes_on: Callable[[int, int], bool]
    ) -> float | None:
        """Shift the logits until the most probable phases of random slices have the fractions.

        Returns the standard error of the fractions, relative to them. It is above STANDARD_ERROR
        if MOST_SLICES, or SLICES_PER_STEP for each of the training's `steps`, are too few.
        Before each slice goes_on(drawn slices, needed ones) is called; where it returns false, no
        logit is shifted, and None returned.
        """
        most = min(MOST_SLICES, max(FEWEST_SLICES, SLICES_PER_STEP * steps))
        source = LatticeSlices(self.generator)
        drawn: list[Tensor] = []
        needed = FEWEST_SLICES
        while len(drawn) < needed:
            for i in range(len(drawn), needed):
                if not goes_on(i, needed):
                    return None
                y = source.draw(directions[i % len(directions)], size, 1)
                drawn.append(self.generator.linear_colors(y)[0, :, ::STRIDE, ::STRIDE].cpu())
            logits = torch.stack(drawn, 1).flatten(2)  # [phase, slice, pixel]
            shift = fitting_shift(logits.flatten(1), self.fractions)
            error = standard_error((logits + shift[:, None, None]).argmax(0), self.fractions)
            needed = min(most, math.ceil(len(drawn) * (error / STANDARD_ERROR) ** 2))
        self.generator.color_mean += shift.to(self.generator.color_mean)
        return error


def holding(drawn: int, needed: int, seconds: float) -> str:
    """What is said while fractions are held, `seconds` after it began."""
    left = f", {seconds / drawn * (needed - drawn) / 60:.1f} min left" if drawn else ""
    return f"holding the fractions of phases: slice {drawn} of {needed}{left}"


def standard_error(phases: Tensor, fractions: Tensor) -> float:
    """Largest standard error of the mean fractions of `phases` [slice, pixel], relative to
    `fractions`; rare phases do not count.
    """
    errors = [
        float((phases == phase).float().mean(1).std() / fraction)
        for phase, fraction in enumerate(fractions)
        if fraction >= RARE
    ]
    return max(errors) / math.sqrt(len(phases))


def fitting_shift(logits: Tensor, fractions: Tensor) -> Tensor:
    """What to add to `logits` [phase, voxel] so that the most probable phases have `fractions`.

    Each phase in turn gets its fraction exactly, until all keep theirs.
    """
    shift = torch.zeros(len(logits))
    for _ in range(ROUNDS):
        before = shift - shift.mean()
        for phase, fraction in enumerate(fractions.tolist()):
            others = logits + shift[:, None]
            others[phase] = -torch.inf
            needed = others.amax(0) - logits[phase]  # shift from which a voxel has this phase
            voxels = round(fraction * needed.numel())
            shift[phase] = needed.kthvalue(max(voxels, 1)).values
        if torch.allclose(shift - shift.mean(), before, rtol=1e-5, atol=0):
            break
    return shift - shift.mean()


class PhaseSlices:
    """Slices of another source as leaky probabilities, whitened like the exemplars."""

    def __init__(self, logits: SliceSource, phases: PhaseTraining) -> None:
        self.logits = logits
        self.phases = phases

    def draw(self, direction: str, size: int, batch: int) -> Tensor:
        y = self.logits.draw(direction, size, batch)
        with torch.autocast(y.device.type, enabled=False):
            logits = self.phases.generator.linear_colors(y.float())
            leaky = logits.softmax(1) + LEAK * (logits - logits.mean(1, keepdim=True))
            centered = leaky - self.phases.mean.to(y.device).view(1, -1, 1, 1)
            return torch.einsum("ij,bjrc->birc", self.phases.inverse.to(y.device), centered)

    def view(self, direction: str) -> str:
        return self.logits.view(direction)
