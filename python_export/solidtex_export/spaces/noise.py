"""Octave noise for training many materials: random tiles read by trilinear interpolation.

GramGAN, section 4: noise instances of 64^3. A tile wraps around, so it repeats after 64 lattice
spacings; a training slice is too small to show it. Reading a tile is several times as fast as
hashing (generators/sampler.py), which a space's training would spend most of its time on.
"""

from __future__ import annotations

import torch
import torch.nn.functional as F
from torch import Tensor

TILE = 64


class TiledNoise:
    """Standard normal noise: one tile for each octave, at random places for each material."""

    def __init__(self, octaves: int, device: torch.device) -> None:
        tile = torch.randn(octaves, 1, TILE, TILE, TILE, device=device)
        for axis in (2, 3, 4):  # a margin of one, so that the last cell sees the first again
            tile = torch.cat([tile, tile.narrow(axis, 0, 1)], dim=axis)
        self._tiles = tile

    @classmethod
    def restored(cls, tiles: Tensor) -> TiledNoise:
        noise = cls.__new__(cls)
        noise._tiles = tiles
        return noise

    def state(self) -> Tensor:
        return self._tiles.cpu()

    def __call__(self, positions: Tensor) -> Tensor:
        """Noise [batch, octave, point] at positions [batch, octave, point, 3] of the lattices."""
        batch, octaves, points, _ = positions.shape
        place = TILE * torch.rand(batch, octaves, 1, 3, device=positions.device)
        inside = (positions + place).remainder(TILE).transpose(0, 1)
        grid = (2 / TILE * inside.flip(-1) - 1).reshape(octaves, batch, points, 1, 3)
        values = F.grid_sample(self._tiles, grid, mode="bilinear", align_corners=True)
        return values.view(octaves, batch, points).transpose(0, 1)
