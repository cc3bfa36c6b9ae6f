"""Training of the descriptor network on a task: to tell textures apart, or to follow a teacher."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

import torch
from torch import Tensor, nn
from torch.optim import AdamW

from solidtex_export.losses.descriptor.heads import Heads
from solidtex_export.losses.descriptor.network import (
    DISTILLED_WIDTHS,
    WIDTHS,
    DescriptorNetwork,
)
from solidtex_export.losses.descriptor.weights import feature_deviations, save_weights
from solidtex_export.research.descriptor.contrast import Contrast
from solidtex_export.research.procedural import families
from solidtex_export.training.loop import ResumableTraining
from solidtex_export.training.ranks import Ranks
from solidtex_export.training.reproducible import make_reproducible
from solidtex_export.training.result import ResultFolder

RATE, FINAL_RATE, WARMUP_STEPS = 1.5e-3, 0.02, 100  # FINAL_RATE is a fraction of RATE
WEIGHT_DECAY = 1e-2
MAX_GRADIENT = 1.0
SHEET_COLUMNS = 3  # images of one batch, side by side
SHEET_ROWS = 12
SHEET_SIDE = 96  # pixels


@dataclass(frozen=True)
class PretrainConfig:
    """All inputs of the weights, apart from the number of threads."""

    steps: int
    seed: int
    teacher: str = ""
    """SHA-256 of the teacher's weights."""
    photographs: tuple[dict[str, str], ...] = ()

    def document(self) -> dict[str, Any]:
        found: dict[str, Any] = {"steps": self.steps, "seed": self.seed}
        if self.teacher:
            found |= {"teacher": self.teacher, "photographs": list(self.photographs)}
        return found


class Task(Protocol):
    """What the network learns. `heads` are trained with it."""

    data: str
    """Where the images are from, for the metadata of the weights."""
    measured: str
    """What `measures` are."""

    @property
    def heads(self) -> nn.Module: ...

    def loss(self, step: int) -> Tensor: ...

    def measures(self) -> dict[str, float]:
        """How well it is learned, by layer."""
        ...

    @property
    def textures(self) -> Tensor:
        """Images [image, 3, row, column] over which deviations of features are measured."""
        ...


class Pretrainer(ResumableTraining):
    """A training; `run` may be interrupted between any two steps and resumed later."""

    checkpoint_seconds = 120.0
    log_steps = 100

    def __init__(
        self,
        config: PretrainConfig,
        folder: ResultFolder,
        make_task: Callable[[int, DescriptorNetwork], Task] = Contrast,
    ) -> None:
        make_reproducible(config.seed, torch.device("cpu"))
        self.config, self.folder, self.ranks = config, folder, Ranks()
        self.steps = config.steps
        self.network = DescriptorNetwork(DISTILLED_WIDTHS if config.teacher else WIDTHS)
        self.task = make_task(config.seed, self.network)
        self.heads = self.task.heads
        parameters = [*self.network.parameters(), *self.heads.parameters()]
        self.optimizer = AdamW(parameters, RATE, (0.9, 0.99), weight_decay=WEIGHT_DECAY)

    def _train_step(self) -> dict[str, float]:
        for group in self.optimizer.param_groups:
            group["lr"] = RATE * _schedule(self.step, self.config.steps)
        loss = self.task.loss(self.step)
        self.optimizer.zero_grad(set_to_none=True)
        loss.backward()
        nn.utils.clip_grad_norm_(self.network.parameters(), MAX_GRADIENT)
        self.optimizer.step()
        self.step += 1
        return {"loss": loss.item()}

    def _summary(self, rows: list[dict[str, float]]) -> dict[str, float]:
        return super()._summary(rows) | self.task.measures()

    def save_preview(self) -> None:
        """Images of the first batches, which the training does not change."""
        self.folder.save_preview(contact_sheet(self.config.seed))

    def save(self) -> None:
        super().save()
        metadata = {**self.config.document(), "step": self.step, "accuracies": self.task.measures(),
                    "license": "Apache-2.0", "data": self.task.data}  # fmt: skip
        deviations = feature_deviations(self.network, self.task.textures)
        path = self.folder.path / "weights.safetensors"
        heads = self.heads if isinstance(self.heads, Heads) else None
        save_weights(path, self.network, deviations, metadata, heads)

    def state(self) -> dict[str, Any]:
        return {
            "network": self.network.state_dict(),
            "heads": self.heads.state_dict(),
            "optimizer": self.optimizer.state_dict(),
            "step": self.step,
            "seconds": self.seconds,
        }

    def restore(self, state: dict[str, Any]) -> None:
        self.network.load_state_dict(state["network"])
        self.heads.load_state_dict(state["heads"])
        self.optimizer.load_state_dict(state["optimizer"])
        self.step = state["step"]
        self.seconds = state["seconds"]
        self.folder.trim_log(self.step)


def _schedule(step: int, steps: int) -> float:
    """Linear warm-up, then half a cosine."""
    cosine = 0.5 + 0.5 * math.cos(math.pi * step / steps)
    return min(1.0, (step + 1) / WARMUP_STEPS) * (FINAL_RATE + (1 - FINAL_RATE) * cosine)


def contact_sheet(seed: int) -> Tensor:
    """Textures [3, rows, columns] of every family, one row each, then of mixtures."""
    strips = [
        torch.cat(tuple(families.batch(seed, i, SHEET_COLUMNS, SHEET_SIDE)), dim=2)
        for i in range(families.ROUND)
    ]
    columns = [
        torch.cat(strips[i : i + SHEET_ROWS], dim=1) for i in range(0, families.ROUND, SHEET_ROWS)
    ]
    return torch.cat([c for c in columns if c.shape == columns[0].shape], dim=2)
