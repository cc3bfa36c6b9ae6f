"""Adam for a generator, with a schedule and, if the method says so, equalised steps."""

from __future__ import annotations

import math
from typing import Any

from torch import nn
from torch.optim import Adam

from solidtex_export.training.method import Optimiser


class GeneratorOptimiser:
    """`prepare` before the backward passes of a step, `step` after them."""

    def __init__(self, generator: nn.Module, settings: Optimiser) -> None:
        self._settings = settings
        groups = _parameter_groups(generator, settings.equalised)
        self._adam = Adam(groups, settings.learning_rate, settings.betas)

    def prepare(self, step: int, progress: float, critic_on: bool) -> float:
        """Clears gradients and sets the learning rate, which it returns."""
        settings = self._settings
        rate = settings.learning_rate * schedule(step, progress, settings)
        first, second = settings.betas
        if critic_on and settings.beta_with_critic is not None:
            first = settings.beta_with_critic
        for group in self._adam.param_groups:
            group["lr"] = rate * group["scale"]
            group["betas"] = (first, second)
        self._adam.zero_grad(set_to_none=True)
        return rate

    def step(self) -> None:
        self._adam.step()

    def state_dict(self) -> dict[str, Any]:
        return self._adam.state_dict()

    def load_state_dict(self, state: dict[str, Any]) -> None:
        self._adam.load_state_dict(state)


def schedule(step: int, progress: float, settings: Optimiser) -> float:
    """Fraction of the learning rate: linear warm-up, then half a cosine down to `final_rate`."""
    cosine = 0.5 + 0.5 * math.cos(math.pi * min(progress, 1.0))
    warmup = min(1.0, (step + 1) / max(settings.warmup_steps, 1))
    return warmup * (settings.final_rate + (1 - settings.final_rate) * cosine)


def _parameter_groups(generator: nn.Module, equalised: bool) -> list[dict[str, Any]]:
    """Equalised: groups whose steps are proportional to the size that their weights start with."""
    if not equalised:
        return [{"params": list(generator.parameters()), "scale": 1.0}]
    groups = []
    for module in generator.modules():
        scale = 1.0
        if isinstance(module, nn.Conv3d):
            scale = module.weight[0].numel() ** -0.5
        if parameters := list(module.parameters(recurse=False)):
            groups.append({"params": parameters, "scale": scale})
    return groups
