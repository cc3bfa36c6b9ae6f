"""The loss of patches: what a slice has too much and what it lacks, at any shape."""

from __future__ import annotations

import pytest
import torch
import torch.nn.functional as F
from textures_2d import noise
from torch import Tensor

from solidtex_export.losses import patches
from solidtex_export.losses.patches import patch_distance

SIDE = 64


def cracks(seed: int, side: int = SIDE) -> Tensor:
    """Dark lines where a smooth field passes zero [1, 1, side, side]."""
    coarse = noise(1, 1, side // 8, side // 8, seed=seed)
    field = F.interpolate(coarse, (side, side), mode="bicubic")
    lines = -torch.exp(-((field / field.std() / 0.3) ** 2))
    return (lines - lines.mean()) / lines.std()


def broken(image: Tensor) -> Tensor:
    """In squares of 8 pixels, each moved to a place of its own."""
    squares = F.unfold(image, 8, stride=8)
    order = torch.randperm(squares.shape[2], generator=torch.Generator().manual_seed(1))
    return F.fold(squares[:, :, order], image.shape[2:], 8, stride=8)


def between(slices: Tensor, reals: Tensor) -> float:
    torch.manual_seed(0)
    return float(patch_distance(slices, reals))


@pytest.mark.parametrize("shape", [(1, 1, 16, 19), (2, 3, 33, 47), (1, 5, 40, 28)])
def test_an_image_has_patch_distance_zero_to_itself(
    shape: tuple[int, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(patches, "FAKES", 10**6)
    monkeypatch.setattr(patches, "REALS", 10**6)
    image = noise(*shape)
    assert between(image, image) == pytest.approx(0, abs=1e-5)
    assert between(image, image[:, :, :15, :17]) > 0.05


def test_it_is_the_mean_squared_distance_of_nearest_patches_both_ways() -> None:
    """Of two tones beside one, on the one octave that 14 pixels leave."""
    flat = torch.zeros(1, 1, 14, 14)
    halves = torch.cat([flat, flat + 1], dim=3)
    rows = F.unfold(F.avg_pool2d(halves, 2), patches.SIDE).square().mean(1)
    assert between(flat, halves) == pytest.approx(patches.MISSING * float(rows.mean()), rel=1e-5)
    assert between(halves, flat) == pytest.approx(float(rows.mean()), rel=1e-5)


def test_lines_that_end_are_farther_than_other_lines() -> None:
    photograph, others = cracks(0, 3 * SIDE), cracks(1, 3 * SIDE)
    own = between(others, photograph)
    assert between(broken(others), photograph) > 1.08 * own
    assert between(torch.zeros_like(others), photograph) > 1.08 * own


def test_its_gradient_draws_lines_from_noise() -> None:
    photograph = cracks(0, 2 * SIDE)
    torch.manual_seed(0)
    image = noise(1, 1, SIDE, SIDE, seed=2).requires_grad_()
    begin = between(image.detach(), photograph)
    optimizer = torch.optim.Adam([image], 0.1)
    for _ in range(60):
        optimizer.zero_grad()
        patch_distance(image, photograph).backward()
        optimizer.step()
    assert between(image.detach(), photograph) < 0.8 * begin


def test_images_that_are_too_small_are_refused() -> None:
    with pytest.raises(ValueError, match=r"found \(13, 20\) and \(64, 64\) .* at least 14 x 14"):
        patch_distance(noise(1, 1, 13, 20), noise(1, 1, SIDE, SIDE))
