"""A critic in training, and the slices it remembers."""

from __future__ import annotations

from collections import deque
from typing import Any

import torch
from torch import Tensor
from torch.optim import Adam

from solidtex_export.losses.critic import Critic
from solidtex_export.training.exemplar import random_crops

REMEMBERED_SLICES = 12
CROP = 64  # pixels
CROPS = 4


class Opponent:
    """The critic of one exemplar; recent slices keep it from chasing only the last one."""

    def __init__(self, channels: int, rate: float, device: torch.device) -> None:
        self.critic = Critic(channels).to(device)
        self._optimizer = Adam(self.critic.parameters(), rate, (0.0, 0.99))
        self._slices: deque[Tensor] = deque(maxlen=REMEMBERED_SLICES)
        self._device = device

    def remember(self, slices: Tensor) -> Tensor:
        """Keep `slices`; returns random crops [crop, channel, side, side] of all that are kept."""
        self._slices.extend(slices)
        side = min(slices.shape[2], CROP)
        picks = torch.randint(len(self._slices), (CROPS,)).tolist()
        return torch.cat([random_crops(self._slices[p], 1, side, side) for p in picks])

    def update(self, loss: Tensor) -> None:
        self._optimizer.zero_grad(set_to_none=True)
        loss.backward()
        self._optimizer.step()

    def state(self) -> dict[str, Any]:
        return {
            "critic": self.critic.state_dict(),
            "optimizer": self._optimizer.state_dict(),
            "slices": list(self._slices),
        }

    def restore(self, state: dict[str, Any]) -> None:
        self.critic.load_state_dict(state["critic"])
        self._optimizer.load_state_dict(state["optimizer"])
        self._slices.extend(image.to(self._device) for image in state["slices"])
