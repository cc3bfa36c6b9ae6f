"""Contrastive loss: which crops show the same texture? (SimCLR, Chen et al. 2020.)

Each layer has a loss of its own, on the mean and the Gram matrix of its features, so that every
depth becomes a statistic of texture.
"""

from __future__ import annotations

import math

import torch
import torch.nn.functional as F
from torch import Tensor, nn

from solidtex_export.losses.descriptor.network import DescriptorNetwork, layer_names
from solidtex_export.research.descriptor.pairs import Pool, held_out_pairs, training_pairs

DEPTH_WEIGHTS = (0.5, 1.5)  # of the loss of the first and of the last layer
EVALUATION_BATCH = 74
PROJECTED = 24  # channels of the Gram matrix
EMBEDDING = 96
TEMPERATURE = 0.1


class LayerHead(nn.Module):
    """Maps features [batch, channel, rows, columns] of one layer to unit vectors [batch,
    EMBEDDING].
    """

    def __init__(self, width: int) -> None:
        super().__init__()
        self.project = nn.Conv2d(width, PROJECTED, 1, bias=False)
        numbers = width + PROJECTED * (PROJECTED + 1) // 2
        self.norm = nn.LayerNorm(numbers)
        self.embed = nn.Linear(numbers, EMBEDDING)
        row, column = torch.triu_indices(PROJECTED, PROJECTED).unbind()
        self.register_buffer("pairs", row * PROJECTED + column, persistent=False)

    def forward(self, features: Tensor) -> Tensor:
        flat = self.project(features).flatten(2)
        gram = (flat @ flat.transpose(1, 2) / flat.shape[2]).flatten(1)[:, self.pairs].float()
        rooted = gram.sign() * (gram.abs() + 1e-3).sqrt()  # large entries would drown the others
        mean = features.mean((2, 3)).float()
        return F.normalize(self.embed(self.norm(torch.cat((mean, rooted), dim=1))), dim=1)


def similarities(embeddings: Tensor) -> Tensor:
    """Cosines [2n, 2n] of unit vectors; the diagonal is minus infinity."""
    return (embeddings @ embeddings.T).fill_diagonal_(-torch.inf)


def partners(count: int) -> Tensor:
    """Index of each crop's partner: rows i and i + n of 2n crops show the same texture."""
    return torch.arange(2 * count).roll(count)


def contrastive_loss(cosines: Tensor) -> Tensor:
    return F.cross_entropy(cosines / TEMPERATURE, partners(len(cosines) // 2))


def accuracy(cosines: Tensor) -> float:
    """Share of crops whose most similar crop shows the same texture."""
    return float((cosines.argmax(1) == partners(len(cosines) // 2)).float().mean())


class Contrast:
    """The task of telling procedural textures apart."""

    data = "procedural images only"
    measured = "held-out crops whose most similar crop shows the same texture"

    def __init__(self, seed: int, network: DescriptorNetwork) -> None:
        self._seed = seed
        self._network = network
        self._pool = Pool(seed)
        self._held_out: Tensor | None = None
        self.heads = nn.ModuleList(LayerHead(width) for width in sum(network.widths, ()))

    def loss(self, step: int) -> Tensor:
        crops = training_pairs(self._pool, self._seed, step)
        losses = [contrastive_loss(c) for c in self._cosines(crops)]
        low, high = DEPTH_WEIGHTS
        weights = torch.linspace(low, high, len(losses))
        return (torch.stack(losses) * weights).sum() / weights.sum()

    @torch.no_grad()
    def measures(self) -> dict[str, float]:
        """Share of held-out crops whose most similar one shows the same texture, by layer."""
        names = (*layer_names(self._network.widths), "all")
        found = zip(names, self._cosines(self.textures), strict=True)
        return {name: round(accuracy(cosines), 4) for name, cosines in found}

    @property
    def textures(self) -> Tensor:
        """Held-out crops, over which deviations of features are measured, too."""
        if self._held_out is None:
            self._held_out = held_out_pairs()
        return self._held_out

    def _cosines(self, crops: Tensor) -> list[Tensor]:
        """Similarities of all crops by each layer, and by the layers together."""
        embeddings = []
        for part in crops.split(EVALUATION_BATCH) if not torch.is_grad_enabled() else (crops,):
            with torch.autocast("cpu", torch.bfloat16):
                features = self._network.features(part).values()
                found = [h(f) for h, f in zip(self.heads, features, strict=True)]
            embeddings.append([e.float() for e in found])
        layers = [torch.cat(parts) for parts in zip(*embeddings, strict=True)]
        together = torch.cat(layers, dim=1) / math.sqrt(len(layers))
        return [similarities(e) for e in (*layers, together)]
