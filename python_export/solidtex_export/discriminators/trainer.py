"""Training of the discriminators of one kind and one photograph, with their replay buffer."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping
from typing import Any

import torch
import torch.nn.functional as F
from torch import Tensor, nn
from torch.optim import Adam

from solidtex_export.discriminators.critic import Critic, Penalties
from solidtex_export.discriminators.projected import ProjectedCritic
from solidtex_export.discriminators.settings import AnyDiscriminator, ProjectedCriticSettings
from solidtex_export.images.exemplar import random_crops
from solidtex_export.losses import own
from solidtex_export.losses.descriptors import DescriptorSource
from solidtex_export.settings import SettingsError, show

Reals = Callable[[int, int], Tensor]
"""(count, side) -> crops of the photograph [count, channel, side, side]."""


class DiscriminatorTrainer:
    """Trains one discriminator per scale; a replay buffer keeps them from overfitting to the last
    slices.

    Zhao et al. 2022 ("STS-GAN"), section 3.2: a critic of scale s sees crops of s times the side,
    magnified to the whole side, of slices and of the photograph alike. Theirs are slices of smaller
    solids; without padding, a crop of a larger slice has the same distribution.
    """

    def __init__(
        self,
        name: str,
        settings: AnyDiscriminator,
        photograph: Tensor,
        source: DescriptorSource,
    ) -> None:
        """`name` is that of the table, or "module:class". `photograph` [channel, rows, columns] is
        whitened, on the device of the training.
        """
        self._settings = settings
        self.discriminators = [
            _discriminator(name, settings, photograph, source).to(photograph.device)
            for _ in settings.scales
        ]
        fused = photograph.device.type == "cpu" or None  # elsewhere torch chooses
        self._optimizers = [
            Adam(discriminator.parameters(), settings.learning_rate, settings.betas, fused=fused)
            for discriminator in self.discriminators
        ]
        self._buffer: deque[Tensor] = deque(maxlen=settings.replay_buffer)
        self._device = photograph.device

    def random_scale(self) -> int:
        """Random discriminator for the generator's loss in this step (STS-GAN, section 3.3)."""
        count = len(self.discriminators)
        return 0 if count == 1 else int(torch.randint(count, ()))

    def view(self, images: Tensor, scale: int) -> Tensor:
        """Input of the discriminator of that scale for images [batch, channel, side, side]."""
        fraction, side = self._settings.scales[scale], images.shape[2]
        if fraction == 1:
            return images
        part = max(1, round(fraction * side))
        crops = torch.cat([random_crops(image, 1, part, part) for image in images])
        return F.interpolate(crops, size=(side, side), mode="bilinear", align_corners=False)

    def remember(self, slices: Tensor) -> None:
        self._buffer.extend(slices)

    def losses(self, reals: Reals, turned: Callable[[Tensor], Tensor]) -> list[Tensor]:
        """Loss of each discriminator on slices of the replay buffer."""
        losses = []
        for scale, discriminator in enumerate(self.discriminators):
            fakes = turned(self._crops())
            views = [self.view(i, scale) for i in (fakes, reals(len(fakes), fakes.shape[2]))]
            losses.append(discriminator.loss(*views))
        return losses

    def update(self, losses: list[Tensor], average: Callable[[nn.Module], None]) -> None:
        """Train each discriminator by one step; `average` may change its gradients before."""
        trained = zip(self.discriminators, self._optimizers, losses, strict=True)
        for discriminator, optimizer, loss in trained:
            optimizer.zero_grad(set_to_none=True)
            loss.backward()
            average(discriminator)
            optimizer.step()

    def _crops(self) -> Tensor:
        """Random crops [crop, channel, side, side] of the replay buffer."""
        side = min(image.shape[1] for image in self._buffer)
        side = min(side, self._settings.crop or side)
        order = torch.randperm(len(self._buffer)).tolist()
        picks = [order[i % len(order)] for i in range(self._settings.batch)]
        return torch.cat([random_crops(self._buffer[p], 1, side, side) for p in picks])

    def load(self, weights: Mapping[str, Tensor]) -> None:
        """Give every discriminator these weights; raises RuntimeError where they do not fit."""
        for discriminator in self.discriminators:
            discriminator.load_state_dict(dict(weights))

    def state(self) -> dict[str, Any]:
        return {
            "discriminators": [d.state_dict() for d in self.discriminators],
            "optimizers": [optimizer.state_dict() for optimizer in self._optimizers],
        }

    def restore(self, state: dict[str, Any]) -> None:
        for discriminator, saved in zip(self.discriminators, state["discriminators"], strict=True):
            discriminator.load_state_dict(saved)
        for optimizer, saved in zip(self._optimizers, state["optimizers"], strict=True):
            optimizer.load_state_dict(saved)

    @property
    def replay_buffer(self) -> list[Tensor]:
        return list(self._buffer)

    @replay_buffer.setter
    def replay_buffer(self, slices: list[Tensor]) -> None:
        self._buffer.extend(image.to(self._device) for image in slices)


def _discriminator(
    name: str, settings: AnyDiscriminator, photograph: Tensor, source: DescriptorSource
) -> Any:
    if own.is_own(name):
        made = own.load(name)(len(photograph))
        if not any(True for _ in made.parameters()):
            raise SettingsError(
                f"losses: found the kind {show(name)}, a discriminator without parameters,"
                " expected some to train"
            )
        return made
    if isinstance(settings, ProjectedCriticSettings):
        network = source.learned("projected_critic").network
        return ProjectedCritic(network, photograph, settings.layers, settings.head_width)
    penalties = Penalties(settings.penalty, settings.drift, settings.rms)
    return Critic(len(photograph), settings.widths, settings.equalized_learning_rate, penalties)
