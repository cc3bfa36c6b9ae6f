"""Contrastive loss: which crops show the same texture? (SimCLR, Chen et al. 2020.)

Each layer has a loss of its own, on the mean and the Gram matrix of its features, so that every
depth becomes a statistic of texture.
"""

from __future__ import annotations

import torch
import torch.nn.functional as F
from torch import Tensor, nn

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
