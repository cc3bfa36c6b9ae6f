"""Loss of the generator: a recipe's terms, combined into one gradient of the slices."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager
from typing import Any

import torch
from torch import Tensor

from solidtex_export.discriminators.critic import adversarial_loss, style_loss
from solidtex_export.discriminators.trainer import DiscriminatorTrainer
from solidtex_export.images.exemplar import random_crops, random_symmetry
from solidtex_export.losses import own
from solidtex_export.losses.color_distribution import ColorDistribution
from solidtex_export.losses.descriptors import Descriptor, DescriptorSource
from solidtex_export.losses.spectrum import SpectrumLoss
from solidtex_export.losses.statistics import Features, feature_loss
from solidtex_export.losses.wavelets import WaveletLoss
from solidtex_export.training.config import Config
from solidtex_export.training.recipe import DESCRIPTOR_LOSSES, Loss, discriminator_of

REAL_SIZE = 1.5  # side of the crops that the descriptor measures, in slices
CROPS = 32  # that it measures of each photograph, in random orientations


class Objective:
    """Compares slices with photographs; draws crops and orientations at random."""

    def __init__(
        self,
        config: Config,
        exemplars: Sequence[Tensor],
        discriminators: Sequence[Mapping[str, DiscriminatorTrainer]],
        source: DescriptorSource,
        autocast: Callable[[], AbstractContextManager[None]],
    ) -> None:
        self._terms = config.recipe.losses
        self._mixing = config.recipe.mixing
        self._symmetry = config.symmetry
        self._exemplars = exemplars
        self._discriminators = discriminators
        self._autocast = autocast
        self._descriptors: dict[str, Descriptor] = {}
        for term in self._terms.values():
            if term.kind in DESCRIPTOR_LOSSES and term.descriptor not in self._descriptors:
                self._descriptors[term.descriptor] = source.make(term.descriptor)
        self._measured: dict[tuple[str, int, int], list[Any]] = {}
        """Statistics of crops, by descriptor, photograph and side of the crops."""
        self._wavelets: list[WaveletLoss] = []
        if config.recipe.of_kind("wavelets"):
            self._wavelets = [WaveletLoss(e, config.size, self._symmetry) for e in exemplars]
        self._colors: list[ColorDistribution] = []
        if config.recipe.of_kind("color_distribution"):
            self._colors = [ColorDistribution(e) for e in exemplars]
        self._spectra: list[SpectrumLoss] = []
        if config.recipe.of_kind("spectrum"):
            self._spectra = [SpectrumLoss(e, self._symmetry) for e in exemplars]

    @property
    def names(self) -> list[str]:
        """Names of the terms, as columns of the log."""
        return list(self._terms)

    def gradient(
        self, slices: Tensor, index: int, progress: float, view: str = ""
    ) -> tuple[Tensor, dict[str, float]]:
        """Gradient with respect to `slices` [batch, channel, side, side], and each term's value.

        Running averages are kept by view (wavelets.py). Mixing "sum" adds weighted losses, as in
        the papers. Mixing "unit-gradients" scales each term's gradient to unit length before
        weighting, since the critic would dominate a raw sum.
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
        return gradient, {name: values.get(name, math.nan) for name in self._terms}

    def orientation_bias_gradient(
        self, slices: Tensor, index: int, view: str
    ) -> tuple[Tensor, dict[str, float]]:
        """Unit gradient that reduces the orientation bias of slices of a view without a photograph.

        The result is as in `gradient`; no term has a value.
        """
        slices = slices.detach().float().requires_grad_()
        (gradient,) = torch.autograd.grad(
            self._wavelets[index].orientation_bias(slices, view), slices
        )
        return gradient / (gradient.norm() + 1e-12), dict.fromkeys(self._terms, math.nan)

    def state(self) -> list[Any]:
        """State of the losses' running averages."""
        return [loss.state() for loss in self._wavelets]

    def restore(self, state: list[Any]) -> None:
        for loss, saved in zip(self._wavelets, state, strict=True):
            loss.restore(saved)

    def discriminator_losses(self, name: str, index: int) -> list[Tensor]:
        """Losses of the discriminators of that name and photograph, on their replay buffer."""
        with self._autocast():
            reals = lambda count, side: self._reals(index, count, side)  # noqa: E731
            return self._discriminators[index][name].losses(reals, self._turned)

    def _losses(
        self, slices: Tensor, index: int, progress: float, view: str
    ) -> dict[str, tuple[Loss, Tensor]]:
        terms = [(name, term) for name, term in self._terms.items() if term.active(progress)]
        losses = {}
        features: dict[str, Features] = {}
        evaluated: dict[str, Callable[[Loss], Tensor]] = {}  # by the discriminator's name
        for name, term in terms:
            descriptor = term.descriptor
            if term.kind == "descriptor":
                side = int(REAL_SIZE * slices.shape[2])
                target = self._measured_crop(descriptor, index, side)
                loss = self._descriptors[descriptor].distance(self._turned(slices), target)
            elif term.kind == "wavelets":
                loss = self._wavelets[index](slices, view)
            elif term.kind == "spectrum":
                loss = self._spectra[index](slices)
            elif term.kind == "color_distribution":
                loss = self._colors[index](slices)
            elif (table := discriminator_of(term.kind)) is not None:
                if table not in evaluated:
                    trainer = self._discriminators[index][table]
                    evaluated[table] = self._discriminator_loss(trainer, slices, index)
                loss = evaluated[table](term)
            elif own.is_own(term.kind):
                reals = self._reals(index, len(slices), slices.shape[2])
                loss = own.loss(name, term.kind, self._turned(slices), reals)
            else:
                if descriptor not in features:
                    reals = self._reals(index, len(slices), slices.shape[2])
                    source = self._descriptors[descriptor]
                    features[descriptor] = source.features(self._turned(slices), reals)
                found = features[descriptor]
                loss = feature_loss(name, term.kind, term.layers, term.sigma, found)
            losses[name] = (term, loss)
        return losses

    def _discriminator_loss(
        self, trainer: DiscriminatorTrainer, slices: Tensor, index: int
    ) -> Callable[[Loss], Tensor]:
        """Losses of one discriminator, which share its features."""
        scale = trainer.random_scale()
        critic = trainer.discriminators[scale]
        reals = trainer.view(self._reals(index, len(slices), slices.shape[2]), scale)
        features = critic.features(trainer.view(self._turned(slices), scale))

        def loss(term: Loss) -> Tensor:
            if term.kind == "style":
                return style_loss(critic, features, reals)
            return adversarial_loss(critic, features)

        return loss

    def _measured_crop(self, descriptor: str, index: int, side: int) -> Any:
        """Statistics of a random crop of the photograph, one of `CROPS` that are measured once."""
        key = descriptor, index, side
        if key not in self._measured:
            with torch.random.fork_rng(devices=[]):
                torch.manual_seed(0)  # a training that is resumed measures the same crops
                measure = self._descriptors[descriptor].measure
                self._measured[key] = [measure(self._reals(index, 1, side)) for _ in range(CROPS)]
        return self._measured[key][int(torch.randint(CROPS, ()))]

    def _reals(self, index: int, count: int, side: int) -> Tensor:
        return self._turned(random_crops(self._exemplars[index], count, side, side))

    def _turned(self, images: Tensor) -> Tensor:
        return random_symmetry(images, self._symmetry)
