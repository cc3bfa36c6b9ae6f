"""The color distribution: exact where it can be, blind to places, sharper than moments."""

from __future__ import annotations

import pytest
import torch
from textures_2d import noise
from torch import Tensor

from solidtex_export.losses.color_distribution import ColorDistribution

SIDE = 64


def two_tones(seed: int, side: int = SIDE) -> Tensor:
    """Mean zero and variance one, as noise has them. [1, side, side]"""
    return noise(1, side, side, seed=seed).sign()


def between(slice_: Tensor, exemplar: Tensor) -> float:
    torch.manual_seed(0)
    return float(ColorDistribution(exemplar)(slice_[None]))


def test_of_a_row_and_a_single_tone_it_is_the_mean_squared_distance() -> None:
    row = noise(1, 1, 9)
    expected = (row - 2).square().mean()
    assert between(row, torch.full((1, 3, 5), 2.0)) == pytest.approx(float(expected), rel=1e-5)


@pytest.mark.parametrize("channels", [1, 3, 5])
def test_it_ignores_the_positions_of_colors_and_the_size_of_the_exemplar(channels: int) -> None:
    image = noise(channels, SIDE, SIDE)
    larger = torch.cat([image.flip(1), image], dim=2)
    assert between(image, larger) < 0.1 * between(image, 1.5 * larger)


def test_it_separates_distributions_of_equal_mean_and_variance() -> None:
    same = between(two_tones(1), two_tones(2, 2 * SIDE))
    assert between(noise(1, SIDE, SIDE), two_tones(2)) > 5 * same


def test_it_sees_whether_a_tone_fills_patches() -> None:
    """Patches and speckles have the same pixels, and differ when they are reduced."""
    patches = two_tones(1)[:, ::8, ::8].repeat_interleave(8, 1).repeat_interleave(8, 2)
    order = torch.randperm(SIDE * SIDE, generator=torch.Generator().manual_seed(3))
    speckles = patches.flatten(1)[:, order].view_as(patches)
    assert between(speckles, patches) > 5 * between(patches, patches)


def test_its_gradient_leads_to_the_colors_of_the_photograph() -> None:
    torch.manual_seed(0)
    exemplar = two_tones(1)
    image = noise(1, SIDE, SIDE, seed=2).requires_grad_()
    begin = between(image.detach(), exemplar)
    optimizer = torch.optim.Adam([image], 0.05)
    distance = ColorDistribution(exemplar)
    for _ in range(60):
        optimizer.zero_grad()
        distance(image[None]).backward()
        optimizer.step()
    assert between(image.detach(), exemplar) < 0.3 * begin
