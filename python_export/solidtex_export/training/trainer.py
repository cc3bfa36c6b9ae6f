"""The training loop of both families.

A slice of the solid is compared with the exemplar by up to two losses: Gram matrices of a redrawn
random network (losses/random_network.py) from the start, GramGAN's critic (losses/critic.py) once
colours and scales are right. The gradient of each loss with respect to the slice is normalised
before they are added: a raw sum would be dominated by the critic.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from typing import Any

import torch
from torch import Tensor, nn
from torch.optim import Adam

from solidtex_export.losses.critic import critic_loss, generator_losses
from solidtex_export.losses.random_network import RandomDescriptor
from solidtex_export.training.axes import channel_axes, whiten
from solidtex_export.training.config import Config
from solidtex_export.training.exemplar import Exemplar, random_crops, random_symmetry
from solidtex_export.training.families import build
from solidtex_export.training.opponent import Opponent
from solidtex_export.training.preview import preview_sheet
from solidtex_export.training.result import ResultFolder

CHECKPOINT_SECONDS = 60.0
PREVIEW_SECONDS = 120.0
LOG_STEPS = 20
STATISTICS_SLICES = 12


class TrainError(RuntimeError):
    """A training that cannot go on."""


class Trainer:
    """One training; `run` may be interrupted between any two steps and continued later."""

    def __init__(
        self, config: Config, exemplars: list[Exemplar], device: torch.device, folder: ResultFolder
    ) -> None:
        torch.manual_seed(config.seed)
        self.config = config
        self.device = device
        self.folder = folder
        self.originals = exemplars
        self.generator, self.slices = build(config, exemplars)
        mean, basis = channel_axes(exemplars)
        self.generator.color_mean.copy_(mean)
        self.generator.color_basis.copy_(basis)
        self.generator.to(device)
        self.exemplars = [whiten(e.image, mean, basis).to(device) for e in exemplars]
        self.optimizer = Adam(_equalized_groups(self.generator), betas=(0.9, 0.99))
        self.opponents = [
            Opponent(len(config.channels), config.recipe.critic_rate, device) for _ in exemplars
        ]
        self.descriptor = RandomDescriptor()
        self._measure_statistics()
        self.step = 0
        self.seconds = 0.0
        self.finished = False

    @property
    def progress(self) -> float:
        """Fraction of the training that is done."""
        if self.config.steps is not None:
            return self.step / self.config.steps
        assert self.config.minutes is not None
        return self.seconds / (60 * self.config.minutes)

    def run(self, stop: Callable[[], bool], report: Callable[[Trainer], None]) -> None:
        """Train to the end, or until `stop` says so; a checkpoint is saved either way."""
        saved = previewed = time.monotonic()
        while self.progress < 1 and not stop():
            start = time.monotonic()
            row = self._train_step()
            self.seconds += time.monotonic() - start
            if self.step % LOG_STEPS == 0 or self.step == 1:
                self.folder.log(row)
            report(self)
            if time.monotonic() - saved > CHECKPOINT_SECONDS:
                self.save()
                saved = time.monotonic()
            if time.monotonic() - previewed > PREVIEW_SECONDS:
                self._save_preview()
                previewed = time.monotonic()
        if self.progress >= 1 and not self.finished:
            self.finished = True
            self._save_preview()
        self.save()

    def _train_step(self) -> dict[str, float]:
        recipe, progress = self.config.recipe, self.progress
        direction = self.config.directions[self.step % len(self.config.directions)]
        index = self.config.exemplar_index(direction)
        rate = recipe.learning_rate * _schedule(self.step, progress, recipe)
        critic_on = progress >= recipe.critic_start
        for group in self.optimizer.param_groups:
            group["lr"] = rate * group["scale"]
            group["betas"] = (0.5 if critic_on else 0.9, 0.99)
        with self._autocast():
            drawn = self.slices.draw(direction, self.config.size, recipe.batch)
        slices = drawn.detach().float().requires_grad_()
        gradient, row = self._slice_gradient(slices, index, critic_on)
        if not gradient.isfinite().all():
            raise TrainError(
                f"step {self.step}: found a gradient that is not finite, expected a finite one; the"
                " last checkpoint is kept, another --seed may work"
            )
        self.optimizer.zero_grad(set_to_none=True)
        drawn.backward(gradient.to(drawn.dtype))
        self.optimizer.step()
        if critic_on:
            row["critic"] = self._train_critic(slices.detach(), index)
        self.step += 1
        return {"step": self.step, "seconds": round(self.seconds, 1), "rate": rate, **row}

    def _slice_gradient(
        self, slices: Tensor, index: int, critic_on: bool
    ) -> tuple[Tensor, dict[str, float]]:
        """The weighted sum of the losses' unit gradients with respect to the slices."""
        recipe, size = self.config.recipe, self.config.size
        reals = self._reals(index, 1, size + size // 2)
        with self._autocast():
            loss = self.descriptor.loss(self._turned(slices), reals)
        gradient = recipe.descriptor_weight * _unit_gradient(loss, slices)
        row = {"descriptor": loss.item(), "style": math.nan, "critic": math.nan}
        if critic_on:
            reals = self._reals(index, len(slices), size)
            with self._autocast():
                critic = self.opponents[index].critic
                style, adversarial = generator_losses(critic, self._turned(slices), reals)
            gradient = gradient + recipe.style_weight * _unit_gradient(style, slices, keep=True)
            gradient = gradient + recipe.adversarial_weight * _unit_gradient(adversarial, slices)
            row["style"] = style.item()
        return gradient, row

    def _train_critic(self, slices: Tensor, index: int) -> float:
        opponent = self.opponents[index]
        fakes = opponent.remember(slices)
        reals = self._reals(index, len(fakes), fakes.shape[2])
        with self._autocast():
            loss = critic_loss(opponent.critic, self._turned(fakes), reals)
        opponent.update(loss)
        return loss.item()

    def _reals(self, index: int, count: int, side: int) -> Tensor:
        return self._turned(random_crops(self.exemplars[index], count, side, side))

    def _turned(self, images: Tensor) -> Tensor:
        return random_symmetry(images, self.config.symmetry)

    def _autocast(self) -> torch.autocast:
        """bfloat16 where the processor computes in it, for speed."""
        supported = getattr(torch.cpu, "_is_avx512_bf16_supported", lambda: False)
        fast = self.device.type == "cpu" and supported()
        return torch.autocast(self.device.type, torch.bfloat16, enabled=fast)

    @torch.no_grad()
    def _measure_statistics(self) -> None:
        """Set the running batch-norm statistics to averages over several slices."""
        norms = [m for m in self.generator.modules() if isinstance(m, nn.BatchNorm3d)]
        if not norms:
            return
        for norm in norms:
            norm.reset_running_stats()
            norm.momentum = None  # a plain average
        for i in range(STATISTICS_SLICES):
            direction = self.config.directions[i % len(self.config.directions)]
            self.slices.draw(direction, self.config.size, 1)
        self.generator.eval()

    def _save_preview(self) -> None:
        with torch.random.fork_rng(devices=[]):
            torch.manual_seed(0)  # so that previews of one training can be compared
            sheet = preview_sheet(self.generator, self.originals, self.config.size)
        self.folder.save_preview(sheet)

    def save(self) -> None:
        self.folder.save_checkpoint(self.state())

    def state(self) -> dict[str, Any]:
        return {
            "generator": self.generator.state_dict(),
            "optimizer": self.optimizer.state_dict(),
            "opponents": [o.state() for o in self.opponents],
            "step": self.step,
            "seconds": self.seconds,
            "finished": self.finished,
            "rng": torch.get_rng_state(),
        }

    def restore(self, state: dict[str, Any]) -> None:
        self.generator.load_state_dict(state["generator"])
        self.optimizer.load_state_dict(state["optimizer"])
        for opponent, saved in zip(self.opponents, state["opponents"], strict=True):
            opponent.restore(saved)
        self.step = state["step"]
        self.seconds = state["seconds"]
        self.finished = state["finished"]
        torch.set_rng_state(state["rng"])
        self.folder.trim_log(self.step)


def _equalized_groups(generator: nn.Module) -> list[dict[str, Any]]:
    """Parameter groups whose steps are proportional to the size that their weights start with."""
    groups = []
    for module in generator.modules():
        scale = 1.0
        if isinstance(module, nn.Conv3d):
            scale = module.weight[0].numel() ** -0.5
        if parameters := list(module.parameters(recurse=False)):
            groups.append({"params": parameters, "scale": scale})
    return groups


def _schedule(step: int, progress: float, recipe: Any) -> float:
    """Linear warm-up, then half a cosine."""
    cosine = 0.5 + 0.5 * math.cos(math.pi * min(progress, 1.0))
    warmup = min(1.0, (step + 1) / recipe.warmup_steps)
    return warmup * (recipe.final_rate + (1 - recipe.final_rate) * cosine)


def _unit_gradient(loss: Tensor, slices: Tensor, keep: bool = False) -> Tensor:
    (gradient,) = torch.autograd.grad(loss, slices, retain_graph=keep)
    return gradient / (gradient.norm() + 1e-12)
