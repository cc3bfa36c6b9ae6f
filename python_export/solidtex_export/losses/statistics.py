"""Statistics of feature maps and their distances, as in the papers.

Features of a slice and of a photograph come from one descriptor, as a dictionary from layer names
to pairs of maps [batch, channel, rows, columns]. Terms other than `gram` compare pixel by pixel, so
both maps need the same size.

Babichev and Frolov 2021, "Structure preserving exemplar-based 3D texture synthesis", equations 1, 2
and 5 to 10. Where the paper is ambiguous: equation 10 sums over the eight neighbors of a pixel, and
the sums of equation 6 run over the pixels that overlap (the image is padded with zeros before the
Fourier transform). `gram` itself is a mean over pixels, equation 2 of Gutierrez et al. 2020.
"""

from __future__ import annotations

from typing import Any

import torch
from torch import Tensor

Features = dict[str, tuple[Tensor, Tensor]]
"""Layer name -> features of the slices, features of the photograph."""


class LayerError(ValueError):
    """A preset names layers that its descriptor does not have."""


NEIGHBORS = 1  # pixels around one that equation 10 sums over


class _Products(torch.autograd.Function):
    """rows @ rows.T, whose gradient takes one product instead of two."""

    @staticmethod
    def forward(ctx: Any, rows: Tensor) -> Tensor:
        ctx.save_for_backward(rows)
        return rows @ rows.T

    @staticmethod
    def backward(ctx: Any, gradient: Tensor) -> Tensor:
        (rows,) = ctx.saved_tensors
        return (gradient + gradient.T).to(rows.dtype) @ rows


def second_moments(rows: Tensor) -> Tensor:
    """Mean products [channel, channel] of `rows` [channel, pixel]."""
    products: Tensor = _Products.apply(rows)
    return products.float() / rows.shape[1]


def gram(features: Tensor) -> Tensor:
    """Gram matrix [channel, channel], the mean over all pixels of a batch."""
    return second_moments(features.float().transpose(0, 1).flatten(1))


def gram_distance(fakes: Tensor, reals: Tensor) -> Tensor:
    """L_G of one layer, equation 2.

    With G = M * gram(F), N channels and M pixels: 1 / (N M) * ||G - G'||^2 = M / N * ||gram(F) -
    gram(F')||^2.
    """
    channels, pixels = fakes.shape[1], fakes[0, 0].numel()
    return (gram(fakes) - gram(reals)).square().sum() * (pixels / channels)


def autocorrelation(features: Tensor) -> Tensor:
    """R of equation 6 for lags up to half the size, [channel, lag, lag], mean over the batch.

    The weights of equation 7 make each lag a mean over the pixels that overlap. The map is
    symmetric, R(i, j) = R(-i, -j), so lags with i >= 0 suffice.
    """
    features = features.float()
    rows, columns = features.shape[2:]
    spectrum = torch.fft.rfft2(features, s=(2 * rows, 2 * columns))
    power = spectrum.real.square() + spectrum.imag.square()
    sums = torch.fft.irfft2(power, s=(2 * rows, 2 * columns)).mean(0)
    half = columns // 2
    sums = torch.cat([sums[..., -half:], sums[..., : half + 1]], dim=-1)[..., : rows // 2 + 1, :]
    i = torch.arange(sums.shape[1], device=sums.device).view(-1, 1)
    j = torch.arange(-half, half + 1, device=sums.device).abs()
    return sums / ((rows - i) * (columns - j))


def autocorrelation_distance(fakes: Tensor, reals: Tensor) -> Tensor:
    """L_C of one layer, equation 5."""
    difference = (autocorrelation(fakes) - autocorrelation(reals)).square().sum()
    return difference / fakes[0, 0].numel()


def feature_distance(fakes: Tensor, reals: Tensor) -> Tensor:
    """L_D of one layer, equation 8; a negative weight keeps slices from copying the photograph."""
    return (fakes.float() - reals.float()).square().sum() / len(fakes)


def smoothness(features: Tensor, sigma: float) -> Tensor:
    """S of equation 10, over the eight neighbors of every pixel that has them."""
    features = features.float()
    rows, columns = features.shape[2:]
    n = NEIGHBORS
    center = features[:, :, n : rows - n, n : columns - n]
    lags = [(i, j) for i in range(2 * n + 1) for j in range(2 * n + 1) if (i, j) != (n, n)]
    terms = [
        -sigma * (center - features[:, :, i : i + rows - 2 * n, j : j + columns - 2 * n]).square()
        for i, j in lags
    ]
    return torch.logsumexp(torch.stack(terms), dim=0) / (2 * sigma)


def smoothness_distance(fakes: Tensor, reals: Tensor, sigma: float) -> Tensor:
    """L_S of one layer, equation 9."""
    return (smoothness(fakes, sigma) - smoothness(reals, sigma)).square().sum() / len(fakes)


def feature_loss(
    name: str, kind: str, layers: tuple[str, ...], sigma: float, features: Features
) -> Tensor:
    """The term `name`: the mean over those of `layers` that the descriptor has (table 1)."""
    pairs = [features[layer] for layer in layers if layer in features]
    if not pairs:
        raise LayerError(
            f"losses.{name}.layers: found {', '.join(layers)}, expected some of"
            f" {', '.join(features)}, the layers that the descriptor has for slices of this size"
        )
    distances = {
        "gram": gram_distance,
        "autocorrelation": autocorrelation_distance,
        "diversity": feature_distance,
        "smoothness": lambda fakes, reals: smoothness_distance(fakes, reals, sigma),
    }
    return torch.stack([distances[kind](*pair) for pair in pairs]).mean()
