"""Training of the descriptor network on procedural textures."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any

import torch
from torch import Tensor, nn
from torch.optim import AdamW

from solidtex_export.losses.descriptor.network import WIDTHS, DescriptorNetwork, layer_names
from solidtex_export.losses.descriptor.weights import feature_deviations, save_weights
from solidtex_export.research.descriptor.contrast import (
    LayerHead,
    accuracy,
    contrastive_loss,
    similarities,
)
from solidtex_export.research.descriptor.pairs import Pool, held_out_pairs, training_pairs
from solidtex_export.research.procedural import families
from solidtex_export.training.reproducible import make_reproducible
from solidtex_export.training.result import ResultFolder

RATE, FINAL_RATE, WARMUP_STEPS = 1.5e-3, 0.02, 100  # FINAL_RATE is a fraction of RATE
WEIGHT_DECAY = 1e-2
MAX_GRADIENT = 1.0
DEPTH_WEIGHTS = (0.5, 1.5)  # of the loss of the first and of the last layer
CHECKPOINT_SECONDS = 120.0
LOG_STEPS = 100
EVALUATION_BATCH = 74
SHEET_COLUMNS = 3  # images of one batch, side by side
SHEET_ROWS = 12
SHEET_SIDE = 96  # pixels


@dataclass(frozen=True)
class PretrainConfig:
    """All inputs of the weights, apart from the number of threads."""

    steps: int
    seed: int

    def document(self) -> dict[str, Any]:
        return asdict(self)


class Pretrainer:
    """A training; `run` may be interrupted between any two steps and resumed later."""

    def __init__(self, config: PretrainConfig, folder: ResultFolder) -> None:
        make_reproducible(config.seed, torch.device("cpu"))
        self.config = config
        self.folder = folder
        self.network = DescriptorNetwork()
        self.heads = nn.ModuleList(LayerHead(width) for width in sum(WIDTHS, ()))
        parameters = [*self.network.parameters(), *self.heads.parameters()]
        self.optimizer = AdamW(parameters, RATE, (0.9, 0.99), weight_decay=WEIGHT_DECAY)
        self.pool = Pool(config.seed)
        self.step = 0
        self.seconds = 0.0
        self.activity = ""
        self._held_out: Tensor | None = None

    @property
    def progress(self) -> float:
        """Fraction of the training that is done."""
        return self.step / self.config.steps

    def run(self, stop: Callable[[], bool], report: Callable[[Pretrainer], None]) -> None:
        """Train to the end, or until `stop` returns true; saves a checkpoint in either case."""
        if self.step == 0:
            self.folder.save_preview(contact_sheet(self.config.seed))
        saved = time.monotonic()
        while self.step < self.config.steps and not stop():
            start = time.monotonic()
            loss = self._train_step()
            self.seconds += time.monotonic() - start
            if self.step % LOG_STEPS == 0 or self.step == self.config.steps:
                self.folder.log({"step": self.step, "seconds": round(self.seconds), "loss": loss,
                                 **self.accuracies()})  # fmt: skip
            report(self)
            if time.monotonic() - saved > CHECKPOINT_SECONDS:
                self.save()
                saved = time.monotonic()
        self.save()

    def _train_step(self) -> float:
        for group in self.optimizer.param_groups:
            group["lr"] = RATE * _schedule(self.step, self.config.steps)
        crops = training_pairs(self.pool, self.config.seed, self.step)
        losses = [contrastive_loss(c) for c in self._cosines(crops)]
        low, high = DEPTH_WEIGHTS
        weights = torch.linspace(low, high, len(losses))
        loss = (torch.stack(losses) * weights).sum() / weights.sum()
        self.optimizer.zero_grad(set_to_none=True)
        loss.backward()
        nn.utils.clip_grad_norm_(self.network.parameters(), MAX_GRADIENT)
        self.optimizer.step()
        self.step += 1
        return loss.item()

    def _cosines(self, crops: Tensor) -> list[Tensor]:
        """Similarities of all crops by each layer, and by the layers together."""
        embeddings = []
        for part in crops.split(EVALUATION_BATCH) if not torch.is_grad_enabled() else (crops,):
            with torch.autocast("cpu", torch.bfloat16):
                features = self.network.features(part).values()
                found = [h(f) for h, f in zip(self.heads, features, strict=True)]
            embeddings.append([e.float() for e in found])
        layers = [torch.cat(parts) for parts in zip(*embeddings, strict=True)]
        together = torch.cat(layers, dim=1) / math.sqrt(len(layers))
        return [similarities(e) for e in (*layers, together)]

    @torch.no_grad()
    def accuracies(self) -> dict[str, float]:
        """Share of held-out crops whose most similar one shows the same texture, by layer."""
        names = (*layer_names(), "all")
        found = zip(names, self._cosines(self.held_out), strict=True)
        return {name: round(accuracy(cosines), 4) for name, cosines in found}

    @property
    def held_out(self) -> Tensor:
        if self._held_out is None:
            self._held_out = held_out_pairs()
        return self._held_out

    def save(self) -> None:
        self.folder.save_checkpoint(self.state())
        metadata = {**self.config.document(), "step": self.step, "accuracies": self.accuracies(),
                    "license": "Apache-2.0", "data": "procedural images only"}  # fmt: skip
        deviations = feature_deviations(self.network, self.held_out)
        path = self.folder.path / "weights.safetensors"
        save_weights(path, self.network, deviations, metadata)

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
