"""Critics on the features of the frozen descriptor network.

Sauer et al. 2021, "Projected GANs converge faster": several small discriminators, each on features
of one layer of a frozen pretrained network, with a hinge loss and no gradient penalty. Their
network is an EfficientNet with random mixing of its layers. Ours is the descriptor
(losses/descriptor) without mixing; each feature is divided by its deviation on the photograph.

A critic on pixels has to learn all features from one photograph within minutes. This one starts
with features that discriminate textures.
"""

from __future__ import annotations

from collections.abc import Mapping

import torch
import torch.nn.functional as F
from torch import Tensor, nn
from torch.nn.utils.parametrizations import spectral_norm

from solidtex_export.discriminators.critic import NEGATIVE_SLOPE
from solidtex_export.losses.descriptor.network import INPUT_CHANNELS, DescriptorNetwork
from solidtex_export.losses.filled import filled_channels

SILENT_SHARE = 0.1  # of a layer's mean deviation: added to what its features are divided by


class ProjectedCritic(nn.Module):
    """One head for each layer; the score is the mean over positions, then over layers.

    `network` is not part of the state: it is frozen, and shared.
    """

    def __init__(
        self,
        network: DescriptorNetwork,
        photograph: Tensor,
        layers: tuple[str, ...],
        width: int,
    ) -> None:
        """Normalize features by those of the whitened `photograph` [channel, rows, columns]."""
        super().__init__()
        self._network = (network,)  # in a tuple, so that it is no submodule
        self._layers = layers
        self._filled = filled_channels(photograph)
        with torch.no_grad():
            found = self._activations(photograph[None])
        if missing := [name for name in layers if name not in found]:
            raise ValueError(
                f"photograph: found {tuple(photograph.shape[1:])} pixels,"
                f" expected as many as projected_critic.layers {', '.join(missing)} need"
            )
        heads = {name: _Head(found[name].shape[1], width) for name in layers}
        self.heads: Mapping[str, _Head] = nn.ModuleDict(heads)  # type: ignore[assignment]
        for name in layers:
            mean, gain = _normalization(found[name])
            self.register_buffer(f"{name}_mean", mean)
            self.register_buffer(f"{name}_gain", gain)

    def features(self, images: Tensor) -> list[Tensor]:
        """Hidden activations of the heads, for images [batch, channel, rows, columns]."""
        found = self._activations(images)
        hidden = []
        for name in self._layers:
            mean, gain = self.get_buffer(f"{name}_mean"), self.get_buffer(f"{name}_gain")
            hidden.append(self.heads[name].hidden((found[name] - mean) * gain))
        return hidden

    def score(self, features: list[Tensor]) -> Tensor:
        maps = self._maps(features)
        return torch.stack([m.mean((1, 2, 3)) for m in maps]).mean(0)

    def loss(self, fakes: Tensor, reals: Tensor) -> Tensor:
        """Hinge loss at each position: above 1 for the photograph, below -1 for slices."""
        on_fakes, on_reals = (self._maps(self.features(images)) for images in (fakes, reals))
        losses = [F.relu(1 + m).mean() for m in on_fakes] + [F.relu(1 - m).mean() for m in on_reals]
        return torch.stack(losses).sum() / len(self._layers)

    def _maps(self, features: list[Tensor]) -> list[Tensor]:
        pairs = zip(self._layers, features, strict=True)
        return [self.heads[name].last(f).float() for name, f in pairs]

    def _activations(self, images: Tensor) -> dict[str, Tensor]:
        """Activations of all filled channels in groups of three, zero-padded: [batch, group x
        width, ...].
        """
        (network,) = self._network
        network = network.to(images.device)
        images = images[:, self._filled]
        images = F.pad(images, (0, 0, 0, 0, 0, -images.shape[1] % INPUT_CHANNELS))
        groups = [network.features(part) for part in images.split(INPUT_CHANNELS, dim=1)]
        judged = [name for name in self._layers if name in groups[0]]
        return {n: torch.cat([g[n] for g in groups], dim=1).float() for n in judged}


class _Head(nn.Module):
    def __init__(self, channels: int, width: int) -> None:
        super().__init__()
        self.first = spectral_norm(nn.Conv2d(channels, width, 1))
        self.second = spectral_norm(nn.Conv2d(width, width, 3, padding=1, padding_mode="replicate"))
        self.last = spectral_norm(nn.Conv2d(width, 1, 1))

    def hidden(self, x: Tensor) -> Tensor:
        x = F.leaky_relu(self.first(x), NEGATIVE_SLOPE)
        return F.leaky_relu(self.second(x), NEGATIVE_SLOPE)


def _normalization(features: Tensor) -> tuple[Tensor, Tensor]:
    """Mean and reciprocal deviation, each [1, channel, 1, 1]."""
    mean = features.mean((0, 2, 3), keepdim=True)
    deviation = (features - mean).square().mean((0, 2, 3), keepdim=True).sqrt()
    return mean, 1 / (deviation + SILENT_SHARE * deviation.mean() + 1e-6)
