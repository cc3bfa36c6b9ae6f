"""Channels of a solid as displayable images: colors as they are, other channels in gray."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import torch
from torch import Tensor

from solidtex_export.images.channels import Group, groups
from solidtex_export.images.exemplar import Exemplar
from solidtex_export.images.srgb import srgb_encode

QUANTILES = (0.005, 0.995)


class Display:
    """Shows each group of channels as an image, the color first.

    Black and white of a gray channel are the extremes of the exemplars (without the outermost 0.5
    %). Small contrast is visible, and solids are comparable with their exemplars.
    """

    def __init__(self, exemplars: Sequence[Exemplar]) -> None:
        first = exemplars[0]
        self.groups = sorted(groups(first.channels), key=lambda g: g.name != "albedo")
        self.color_space = first.color_space
        self.ranges = [_range(exemplars, group) for group in self.groups]

    def images(self, image: Tensor) -> list[Tensor]:
        """An sRGB-encoded image [3, row, column] for each group of channels of `image` [channel,
        ...].
        """
        return [
            self._show(image[list(group.indices)], group, *limits)
            for group, limits in zip(self.groups, self.ranges, strict=True)
        ]

    def _show(self, values: Tensor, group: Group, low: float, high: float) -> Tensor:
        if group.name == "albedo" and self.color_space == "linear":
            return torch.from_numpy(srgb_encode(values.cpu().numpy()))
        if len(values) == 1:
            values = (values - low) / (high - low)
        return values.expand(3, -1, -1)


def _range(exemplars: Sequence[Exemplar], group: Group) -> tuple[float, float]:
    values = np.concatenate([e.image[list(group.indices)].flatten() for e in exemplars])
    low, high = (float(v) for v in np.quantile(values, QUANTILES))
    return low, max(high, low + 1e-6)
