"""3D operations as 2D operations over the planes of a volume, which trains thin slices fast.

A volume is [batch, plane, row, column, channel]. A k^3 convolution is a k^2 convolution of every
plane and its k - 1 neighbors, stacked as channels: the same sums. It is faster, and avoids oneDNN's
3D weight gradient in bfloat16: docs/experiments/plane-convolutions.md.
"""

from __future__ import annotations

import torch
import torch.nn.functional as F
from torch import Tensor, nn

Axes = tuple[int, int, int]
XYZ: Axes = (0, 1, 2)


def to_planes(x: Tensor) -> Tensor:
    """Convert [batch, channel, plane, row, column] to a volume of planes."""
    return x.movedim(1, 4).contiguous()


def from_planes(x: Tensor) -> Tensor:
    """Convert a volume of planes to [batch, channel, plane, row, column]."""
    return x.movedim(4, 1)


class PlaneConvolution(nn.Conv3d):
    """Unpadded convolution of a volume with axes `axes` by the weight [out, in, x, y, z]."""

    bias: Tensor

    def reset_parameters(self) -> None:
        nn.init.kaiming_normal_(self.weight, a=1.0)  # keeps the variance
        nn.init.zeros_(self.bias)

    def forward(self, x: Tensor, axes: Axes = XYZ, norm: PlaneNorm | None = None) -> Tensor:
        """Convolve, and apply the following normalization, which is free where its statistics are
        fixed.
        """
        weight, bias = self.weight, self.bias
        if norm is not None and not norm.training:
            scale, shift = norm.scale_and_shift()
            weight = weight * scale.view(-1, 1, 1, 1, 1)
            bias = bias * scale + shift
            norm = None
        plane, row, column = (a + 2 for a in axes)
        weight = weight.permute(0, plane, 1, row, column)  # [out, tap, in, row, column]
        y = F.conv2d(_beside_neighbors(x, weight.shape[1]), weight.flatten(1, 2), bias)
        y = y.permute(0, 2, 3, 1).unflatten(0, (x.shape[0], -1))
        return y if norm is None else norm(y)


def _beside_neighbors(x: Tensor, taps: int) -> Tensor:
    """Each plane stacked with the next `taps` - 1 planes: [batch * plane, tap * channel, row,
    column].
    """
    planes = x.shape[1] - taps + 1
    if taps > 1:
        x = torch.cat([x[:, t : t + planes] for t in range(taps)], dim=4)
    return x.flatten(0, 1).permute(0, 3, 1, 2)


class PlaneNorm(nn.BatchNorm3d):
    """Batch normalization of a volume of planes."""

    def scale_and_shift(self) -> tuple[Tensor, Tensor]:
        """Scale and shift [channel] from the running statistics."""
        assert self.running_mean is not None and self.running_var is not None
        scale = self.weight * (self.running_var + self.eps).rsqrt()
        return scale, self.bias - self.running_mean * scale

    def forward(self, x: Tensor) -> Tensor:
        if not self.training:
            scale, shift = self.scale_and_shift()
            return x * scale.to(x.dtype) + shift.to(x.dtype)
        return super().forward(x.movedim(4, 1)).movedim(1, 4)
