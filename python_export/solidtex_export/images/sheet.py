"""A sheet of images: exemplars beside slices.

One row for the color, and one below it for each further channel.
"""

from __future__ import annotations

from collections.abc import Sequence

import torch
import torch.nn.functional as F
from torch import Tensor

from solidtex_export.images.display import Display
from solidtex_export.images.exemplar import Exemplar

GAP = 4  # pixels


def sheet_of(slices: Sequence[Tensor], exemplars: Sequence[Exemplar], size: int) -> Tensor:
    """Exemplars, cropped to the size of a slice, beside slices [channel, row, column]."""
    display = Display(exemplars)
    columns = [display.images(i) for i in [*(e.image[:, :size, :size] for e in exemplars), *slices]]
    return _stacked([_stacked(list(row), 2) for row in zip(*columns, strict=True)], 1)


def _stacked(images: list[Tensor], dim: int) -> Tensor:
    """Images [3, row, column] stacked along `dim` with white margins."""
    height, width = (max(i.shape[d] for i in images) for d in (1, 2))
    padded = []
    for image in images:
        right = GAP if dim == 2 else width - image.shape[2]
        below = GAP if dim == 1 else height - image.shape[1]
        padded.append(F.pad(image, (0, right, 0, below), value=1.0))
    return torch.cat(padded, dim=dim).narrow(dim, 0, sum(p.shape[dim] for p in padded) - GAP)


def sheet_of_rows(images: Sequence[Tensor], columns: int) -> Tensor:
    """Colors [3, row, column] in rows of `columns` images."""
    images = [i.clamp(0, 1) for i in images]
    rows = [_stacked(list(images[i : i + columns]), 2) for i in range(0, len(images), columns)]
    return _stacked(rows, 1)
