"""Training loop of every recipe.

A step generates slices of the solid, computes the objective's gradient with respect to them, and
backpropagates it through the generator. Then it trains the recipe's discriminators on recent
slices.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from typing import Any, Self

import torch
from torch import Tensor

from solidtex_export.analysis.grain import channel_axes, whiten
from solidtex_export.discriminators.trainer import DiscriminatorTrainer
from solidtex_export.generators.lattice import BaseLattice
from solidtex_export.images.exemplar import Exemplar
from solidtex_export.losses.descriptors import DescriptorSource, PretrainedWeights
from solidtex_export.training.acceleration import fast_autocast
from solidtex_export.training.batch_norm import measure_statistics
from solidtex_export.training.config import Config
from solidtex_export.training.divergence import DivergenceWatch, gradient_not_finite, not_finite
from solidtex_export.training.families import build
from solidtex_export.training.loop import ResumableTraining
from solidtex_export.training.objective import Objective
from solidtex_export.training.optimizer import GeneratorOptimizer
from solidtex_export.training.phases import PhaseTraining, holding
from solidtex_export.training.preview import preview_sheet
from solidtex_export.training.ranks import Ranks, on_cpu
from solidtex_export.training.reproducible import make_reproducible
from solidtex_export.training.result import ResultFolder
from solidtex_export.training.start import Start, freeze


class Trainer(ResumableTraining):
    """The training of a solid from one to three photographs."""

    checkpoint_seconds = 60.0
    preview_seconds = 120.0
    log_steps = 20

    def __init__(
        self,
        config: Config,
        exemplars: list[Exemplar],
        device: torch.device,
        folder: ResultFolder,
        ranks: Ranks | None = None,
        weights: PretrainedWeights | None = None,
        start: Start | None = None,
    ) -> None:
        make_reproducible(config.seed, device)
        self.config = config
        self.steps, self.minutes = config.steps, config.minutes
        if config.clock == "processor":
            self.clock = time.process_time
        self.recipe = config.recipe
        self.device = device
        self.folder = folder
        self.ranks = ranks or Ranks()
        self.originals = exemplars
        self.generator, self.slices, self.oblique = build(config)
        mean, basis = start.axes if start else channel_axes(exemplars)
        self.generator.color_mean.copy_(mean)
        self.generator.color_basis.copy_(basis)
        self.phases: PhaseTraining | None = None
        self.fraction_error: float | None = None
        """Standard error of the fractions of phases, relative to them, when they were held."""
        if isinstance(self.generator, BaseLattice) and self.generator.softmax:
            self.phases = PhaseTraining(self.generator, exemplars, mean, basis)
            self.slices = self.phases.probabilities_of(self.slices)
            self.oblique = self.oblique and self.phases.probabilities_of(self.oblique)
        if start is not None:
            self.generator.load_state_dict(start.state)
            self.generator.eval()
            freeze(self.generator, self.recipe.fine_tuning)
        self.generator.to(device)
        self.optimizer = GeneratorOptimizer(self.generator, self.recipe.optimizer)
        photographs = [whiten(e.image, mean, basis).to(device) for e in exemplars]
        source = DescriptorSource(
            mean, basis, weights or PretrainedWeights(), config.color_space == "linear"
        )
        settings = self.recipe.discriminators
        self.discriminators = [
            {name: DiscriminatorTrainer(name, s, p, source) for name, s in settings.items()}
            for p in photographs
        ]
        self._critic_is_frozen = self.recipe.has_frozen_critic
        if self._critic_is_frozen:
            assert start is not None and start.critic is not None
            for discriminators in self.discriminators:
                discriminators["critic"].load(start.critic)
        self.objective = Objective(
            config,
            photographs,
            self.discriminators,
            source,
            lambda: fast_autocast(device),
        )
        self.watch = DivergenceWatch()
        self.finished = False
        if start is None and self.recipe.generator.statistics == "measured":
            self.measure_statistics()
        if not self.ranks.is_main:
            torch.manual_seed(self.ranks.seed(config.seed))

    def _summary(self, rows: list[dict[str, float]]) -> dict[str, float]:
        return rows[-1]

    def _finish(self, stop: Callable[[], bool], report: Callable[[Self], None]) -> None:
        if self.finished:
            return
        random = self._random_state()
        if self.recipe.generator.statistics == "trained":
            self.measure_statistics()
        held = self.phases is None or self._hold_fractions(self.phases, stop, report)
        self.finished = bool(self.ranks.agree(held)[0])
        if not self.finished:
            self._set_random_state(random)  # so that a resumed training draws the same slices

    def _hold_fractions(
        self, phases: PhaseTraining, stop: Callable[[], bool], report: Callable[[Self], None]
    ) -> bool:
        """Returns whether it came to its end. Rank 0 does it alone: it saves the result."""
        if not self.ranks.is_main:
            return True

        began = time.monotonic()

        def goes_on(drawn: int, needed: int) -> bool:
            self.activity = holding(drawn, needed, time.monotonic() - began)
            report(self)
            return not stop()

        config = self.config
        self.fraction_error = phases.hold_fractions(
            config.directions, config.size, self.step, goes_on
        )
        self.activity = ""
        return self.fraction_error is not None

    def _train_step(self) -> dict[str, float]:
        progress = self.progress
        active = [] if self._critic_is_frozen else self.recipe.discriminators_at(progress)
        rate = self.optimizer.prepare(self.step, progress)
        passes = self._passes()
        compared = set()
        sums: dict[str, float] = {}
        for direction, oblique in passes:
            index = self.config.exemplar_index(direction)
            values, slices = self._backward(direction, oblique, progress, 1 / len(passes))
            sums = {name: sums.get(name, 0.0) + v / len(passes) for name, v in values.items()}
            if direction in self.config.directions:
                for name in active:
                    self.discriminators[index][name].remember(slices)
                compared.add(index)
        self.ranks.average_gradients(self.generator)
        self.optimizer.step()
        for name in self.discriminators[0]:
            indices = sorted(compared) if name in active else []
            losses = [self._train_discriminators(name, i) for i in indices]
            sums[name] = sum(losses) / len(losses) if losses else math.nan
        self.watch.check(self.step, sums)
        self.step += 1
        return {"rate": rate, **sums}

    def _passes(self) -> list[tuple[str, bool]]:
        """Direction of each pass through the generator in this step, and whether it is oblique."""
        slicing, directions = self.recipe.slicing, self.config.directions
        free_share = slicing.free_share if self._z_is_free else 0.0
        free_steps = math.ceil(self.step * free_share)  # first of four: the log has the last of 20
        if math.ceil((self.step + 1) * free_share) > free_steps:
            return [("z", False)]
        if not slicing.every_direction:
            directions = directions[(self.step - free_steps) % len(directions)]
        share = slicing.oblique_share
        oblique = math.floor((self.step + 1) * share) > math.floor(self.step * share)
        return [(d, oblique and self.oblique is not None) for d in directions] * slicing.passes

    def _backward(
        self, direction: str, oblique: bool, progress: float, weight: float
    ) -> tuple[dict[str, float], Tensor]:
        """Accumulate the gradient of one pass; returns the detached slices."""
        source, size = self.slices, self.config.size
        if oblique:
            assert self.oblique is not None
            source, size = self.oblique, self._oblique_size()
        with fast_autocast(self.device):
            drawn = source.draw(direction, size, self.recipe.slicing.batch)
        index = self.config.exemplar_index(direction)
        view = source.view(direction)
        if direction in self.config.directions:
            gradient, values = self.objective.gradient(drawn, index, progress, view)
            counted = {n: values[n] for n, t in self.recipe.losses.items() if t.active(progress)}
        else:
            gradient, values = self.objective.orientation_bias_gradient(drawn, index, view)
            counted = {"the orientation bias": 0.0}
        if not gradient.isfinite().all():
            raise gradient_not_finite(self.step, counted)
        drawn.backward((weight * gradient).to(drawn.dtype))
        return values, drawn.detach().float()

    @property
    def _z_is_free(self) -> bool:
        """Whether slices normal to z have no photograph and are only known to be symmetric."""
        config = self.config
        one = len(config.exemplars) == 1 and config.directions == "xy"
        return one and config.symmetry != "none" and config.family == "field"

    def _oblique_size(self) -> int:
        side = round(self.recipe.slicing.oblique_size * self.config.size)
        return max(self.recipe.smallest_slice, side)

    def _train_discriminators(self, name: str, index: int) -> float:
        losses = self.objective.discriminator_losses(name, index)
        self.discriminators[index][name].update(losses, self.ranks.average_gradients)
        mean = sum(loss.item() for loss in losses) / len(losses)
        if not math.isfinite(mean):
            raise not_finite(self.step, f"a loss of the discriminator {name}")
        return mean

    def measure_statistics(self) -> None:
        """Set the statistics of batch normalization by slices of the present weights."""
        config = self.config
        measure_statistics(self.generator, self.slices, config.directions, config.size, self.ranks)

    def save_preview(self) -> None:
        if not self.ranks.is_main:
            return
        with torch.random.fork_rng(devices=[self.device] if self._on_cuda else []):
            torch.manual_seed(0)  # so that previews of one training can be compared
            sheet = preview_sheet(self.generator, self.originals, self.config.size)
        self.folder.save_preview(sheet)

    def state(self) -> dict[str, Any]:
        own = self._random_state() | {
            "replay_buffers": [
                {name: on_cpu(d.replay_buffer) for name, d in discriminators.items()}
                for discriminators in self.discriminators
            ],
            "objective": self.objective.state(),
        }
        return {
            "generator": self.generator.state_dict(),
            "optimizer": self.optimizer.state_dict(),
            "discriminators": [
                {name: d.state() for name, d in discriminators.items()}
                for discriminators in self.discriminators
            ],
            "watch": self.watch.state(),
            "step": self.step,
            "seconds": self.seconds,
            "finished": self.finished,
            "ranks": self.ranks.gather(own),
        }

    def restore(self, state: dict[str, Any]) -> None:
        own = self.ranks.own(state["ranks"])
        self.generator.load_state_dict(state["generator"])
        self.optimizer.load_state_dict(state["optimizer"])
        saved, buffers = state["discriminators"], own["replay_buffers"]
        states = zip(self.discriminators, saved, buffers, strict=True)
        for discriminators, saved_states, saved_buffers in states:
            for name, discriminator in discriminators.items():
                discriminator.restore(saved_states[name])
                discriminator.replay_buffer = saved_buffers[name]
        self.objective.restore(own["objective"])
        self.watch.restore(state["watch"])
        self.step = state["step"]
        self.seconds = state["seconds"]
        self.finished = state["finished"] and self.progress >= 1  # not if it is lengthened
        self._set_random_state(own)
        if self.ranks.is_main:
            self.folder.trim_log(self.step)

    def _random_state(self) -> dict[str, Any]:
        return {
            "rng": torch.get_rng_state(),
            "cuda_rng": torch.cuda.get_rng_state(self.device) if self._on_cuda else None,
        }

    def _set_random_state(self, state: dict[str, Any]) -> None:
        torch.set_rng_state(state["rng"])
        if self._on_cuda and state["cuda_rng"] is not None:
            torch.cuda.set_rng_state(state["cuda_rng"], self.device)

    @property
    def _on_cuda(self) -> bool:
        return self.device.type == "cuda"
