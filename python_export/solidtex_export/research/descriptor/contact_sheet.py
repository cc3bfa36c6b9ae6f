"""Contact sheet of the training images of the descriptor."""

from __future__ import annotations

import torch
from torch import Tensor

from solidtex_export.research.procedural import families

EACH = 3  # images of one batch, side by side
ROWS = 12
SIDE = 96  # pixels


def contact_sheet(seed: int) -> Tensor:
    """Textures [3, rows, columns] of every family, one row each, then of mixtures."""
    strips = [
        torch.cat(tuple(families.batch(seed, i, EACH, SIDE)), dim=2) for i in range(families.ROUND)
    ]
    columns = [torch.cat(strips[i : i + ROWS], dim=1) for i in range(0, families.ROUND, ROWS)]
    return torch.cat([c for c in columns if c.shape == columns[0].shape], dim=2)
