"""The generator's loss: a method's terms, mixed into one gradient with respect to the slices."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager
from typing import Any

import torch
from torch import Tensor

from solidtex_export.discriminators.critic import adversarial_loss, style_loss
from solidtex_export.discriminators.trainer import Opponent
from solidtex_export.images.exemplar import random_crops, random_symmetry
from solidtex_export.losses.descriptors import Descriptor, DescriptorSource
from solidtex_export.losses.patches import patch_distance
from solidtex_export.losses.spectrum import SpectrumLoss
from solidtex_export.losses.statistics import Features, feature_loss
from solidtex_export.losses.tones import tone_distance
from solidtex_export.losses.wavelets import WaveletLoss
from solidtex_export.training.preset import CRITIC_OF, DESCRIPTOR_LOSSES, Loss

REAL_SIZE = 1.5  # side of the crop that statistics are taken from, in slices


class Objective:
    """Judges slices beside photographs; draws crops and orientations at random."""

    def __init__(
        self,
        terms: Sequence[Loss],
        mixing: str,
        symmetry: str,
        size: int,
        exemplars: Sequence[Tensor],
        opponents: Sequence[Mapping[str, Opponent]],
        source: DescriptorSource,
        autocast: Callable[[], AbstractContextManager[None]],
    ) -> None:
        self._terms = terms
        self._mixing = mixing
        self._symmetry = symmetry
        self._exemplars = exemplars
        self._opponents = opponents
        self._autocast = autocast
        self._names = _unique_names(terms)
        made: dict[tuple[str, tuple[tuple[int, ...], ...]], Descriptor] = {}
        for term in terms:
            if term.kind in DESCRIPTOR_LOSSES and (term.descriptor, term.groups) not in made:
                made[term.descriptor, term.groups] = source.make(term.descriptor, term.groups)
        self._descriptors = made
        self._wavelets: list[WaveletLoss] = []
        if any(term.kind == "wavelets" for term in terms):
            self._wavelets = [WaveletLoss(e, size, symmetry) for e in exemplars]
        self._spectra: list[SpectrumLoss] = []
        if any(term.kind == "spectrum" for term in terms):
            self._spectra = [SpectrumLoss(e, symmetry) for e in exemplars]

    @property
    def names(self) -> list[str]:
        """Of the terms, as columns of the log."""
        return self._names

    def gradient(
        self, slices: Tensor, index: int, progress: float, view: str = ""
    ) -> tuple[Tensor, dict[str, float]]:
        """Gradient with respect to `slices` [batch, channel, side, side], and each term's value.

        What is remembered of earlier slices is that of the same view (wavelets.py).
        Sum: of weighted losses, as in the papers. Unit gradients: each term's gradient is scaled to
        length one before it is weighted, since a raw sum would be dominated by the critic.
        """
        slices = slices.detach().float().requires_grad_()
        with self._autocast():
            losses = self._losses(slices, index, progress, view)
        if self._mixing == "sum":
            total = torch.stack([term.weight * loss for term, loss in losses.values()]).sum()
            (gradient,) = torch.autograd.grad(total, slices)
        else:
            gradient = torch.zeros_like(slices)
            for term, loss in losses.values():
                (part,) = torch.autograd.grad(loss, slices, retain_graph=True)
                gradient += term.weight / (part.norm() + 1e-12) * part
        values = {name: loss.item() for name, (_, loss) in losses.items()}
        return gradient, {name: values.get(name, math.nan) for name in self._names}

    def slant_gradient(
        self, slices: Tensor, index: int, view: str
    ) -> tuple[Tensor, dict[str, float]]:
        """As `gradient`, of length one, of a view that no photograph shows: against slants that its
        slices share. No term has a value."""
        slices = slices.detach().float().requires_grad_()
        (gradient,) = torch.autograd.grad(self._wavelets[index].slant(slices, view), slices)
        return gradient / (gradient.norm() + 1e-12), dict.fromkeys(self._names, math.nan)

    def state(self) -> list[Any]:
        """What the losses remember of earlier slices."""
        return [loss.state() for loss in self._wavelets]

    def restore(self, state: list[Any]) -> None:
        for loss, saved in zip(self._wavelets, state, strict=True):
            loss.restore(saved)

    def forget(self) -> None:
        """Judge the next slices by themselves."""
        for loss in self._wavelets:
            loss.forget()

    def critic_losses(self, name: str, index: int) -> list[Tensor]:
        """What the critics of that name and photograph have to minimise, on the slices they
        remember."""
        with self._autocast():
            reals = lambda count, side: self._reals(index, count, side)  # noqa: E731
            return self._opponents[index][name].losses(reals, self._turned)

    def _losses(
        self, slices: Tensor, index: int, progress: float, view: str
    ) -> dict[str, tuple[Loss, Tensor]]:
        terms = [
            (name, term)
            for name, term in zip(self._names, self._terms, strict=True)
            if term.judges(progress)
        ]
        losses = {}
        features: dict[object, Features] = {}
        judged: dict[str, Callable[[Loss], Tensor]] = {}  # by the critic's name
        for name, term in terms:
            key = (term.descriptor, term.groups)
            if term.kind == "descriptor":
                reals = self._larger_real(index, slices)
                loss = self._descriptors[key].loss(self._turned(slices), reals)
            elif term.kind == "patches":
                loss = patch_distance(self._turned(slices), self._larger_real(index, slices))
            elif term.kind == "wavelets":
                loss = self._wavelets[index](slices, view)
            elif term.kind == "spectrum":
                loss = self._spectra[index](slices)
            elif term.kind == "tones":
                loss = tone_distance(slices, self._exemplars[index])
            elif term.kind in CRITIC_OF:
                critic = CRITIC_OF[term.kind]
                if critic not in judged:
                    judged[critic] = self._judged(self._opponents[index][critic], slices, index)
                loss = judged[critic](term)
            else:
                if key not in features:
                    reals = self._reals(index, len(slices), slices.shape[2])
                    features[key] = self._descriptors[key].features(self._turned(slices), reals)
                loss = feature_loss(term.kind, term.layers, term.sigma, features[key])
            losses[name] = (term, loss)
        return losses

    def _judged(self, opponent: Opponent, slices: Tensor, index: int) -> Callable[[Loss], Tensor]:
        """A critic's losses, on features that they share."""
        scale = opponent.random_scale()
        critic = opponent.critics[scale]
        reals = opponent.view(self._reals(index, len(slices), slices.shape[2]), scale)
        features = critic.features(opponent.view(self._turned(slices), scale))

        def loss(term: Loss) -> Tensor:
            if term.kind == "style":
                return style_loss(critic, features, reals, term.relative)
            return adversarial_loss(critic, features)

        return loss

    def _larger_real(self, index: int, slices: Tensor) -> Tensor:
        """One crop, of which more is seen than of a slice."""
        return self._reals(index, 1, int(REAL_SIZE * slices.shape[2]))

    def _reals(self, index: int, count: int, side: int) -> Tensor:
        return self._turned(random_crops(self._exemplars[index], count, side, side))

    def _turned(self, images: Tensor) -> Tensor:
        return random_symmetry(images, self._symmetry)


def _unique_names(terms: Sequence[Loss]) -> list[str]:
    """Kinds, with the descriptor's name where one kind comes twice, else with a number."""
    names = [term.kind for term in terms]
    if len(set(names)) < len(names):
        names = [t.kind if t.kind in CRITIC_OF else f"{t.descriptor}-{t.kind}" for t in terms]
    return [n if names.count(n) == 1 else f"{n}-{i}" for i, n in enumerate(names)]
