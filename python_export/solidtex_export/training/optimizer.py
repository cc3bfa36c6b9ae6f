"""Adam for a generator, with a schedule and optional per-layer learning-rate scaling."""

from __future__ import annotations

import math
from typing import Any

from torch import nn
from torch.optim import Adam

from solidtex_export.training.recipe import Optimizer


class GeneratorOptimizer:
    """Adam: call `prepare` before the backward passes of a step, `step` after them."""

    def __init__(self, generator: nn.Module, settings: Optimizer) -> None:
        self._settings = settings
        groups = parameter_groups(generator, settings.per_layer_scaling)
        on_cpu = next(generator.parameters()).device.type == "cpu"
        fused = on_cpu or None  # elsewhere torch chooses
        self._adam = Adam(groups, settings.learning_rate, settings.betas, fused=fused)

    def prepare(self, step: int, progress: float) -> float:
        """Clears gradients and sets the learning rate, which it returns."""
        rate = learning_rate(step, progress, self._settings)
        for group in self._adam.param_groups:
            group["lr"] = rate * group["scale"]
        self._adam.zero_grad(set_to_none=True)
        return rate

    def step(self) -> None:
        self._adam.step()

    def state_dict(self) -> dict[str, Any]:
        return self._adam.state_dict()

    def load_state_dict(self, state: dict[str, Any]) -> None:
        self._adam.load_state_dict(state)


def learning_rate(step: int, progress: float, settings: Optimizer) -> float:
    """Learning rate of a step: linear warm-up, then half a cosine."""
    warmup = min(1.0, (step + 1) / max(settings.warmup_steps, 1))
    first = settings.learning_rate
    return warmup * half_cosine(progress, first, settings.final_rate * first)


def half_cosine(progress: float, first: float, last: float) -> float:
    """Half a cosine from the first value to the last."""
    return last + (first - last) * (0.5 + 0.5 * math.cos(math.pi * min(progress, 1.0)))


def parameter_groups(network: nn.Module, per_layer_scaling: bool) -> list[dict[str, Any]]:
    """Parameter groups; scaled learning rates are proportional to the size of weights."""
    if not per_layer_scaling:
        return [{"params": list(network.parameters()), "scale": 1.0}]
    groups = []
    for module in network.modules():
        scale = 1.0
        if isinstance(module, nn.Conv2d | nn.Conv3d | nn.Linear):
            # sqrt(3): weights start uniformly between -b and b, and b is the size that is meant
            scale = module.weight.detach().square().mean().mul(3).sqrt().item()
        if parameters := list(module.parameters(recurse=False)):
            groups.append({"params": parameters, "scale": scale})
    return groups
