"""The loss of spectra: of noise it is known, it sees a weave, and it leaves out what none sees."""

from __future__ import annotations

from pathlib import Path

import pytest
import torch
import torch.nn.functional as F
from small_trainings import assert_equal, make_trainer, save_specks, train
from textures_2d import noise
from torch import Tensor

from solidtex_export.losses.spectrum import FLOOR, SpectrumLoss, bands_of, power

SIDE = 96


def between(slices: Tensor, exemplar: Tensor, symmetry: str = "none") -> float:
    return float(SpectrumLoss(exemplar, symmetry)(slices[None]))


def waves(right: float, down: float, side: int = SIDE) -> Tensor:
    """So many waves per texel, of variance 1/2, in noise of a hundredth. [1, side, side]"""
    at = torch.arange(side, dtype=torch.float32)
    wave = torch.cos(2 * torch.pi * (right * at + down * at[:, None]) + 0.5)
    return wave[None] + 0.1 * noise(1, side, side)


@pytest.mark.parametrize("side", [17, 64, 128, 150])
def test_white_noise_has_its_variance_in_every_band(side: int) -> None:
    images = torch.randn(200, 2, side, side) * torch.tensor([1.0, 3.0]).view(-1, 1, 1)
    found = power(images, bands_of(side)) - FLOOR**2
    assert found[0].max() < 1.15
    assert found[0].min() > (0.85 if side > 17 else 0.3)  # the mean is taken off
    assert torch.allclose(found[1], 9 * found[0], rtol=0.3)


def test_bands_are_means_of_waves_that_they_do_not_share() -> None:
    for shares in bands_of(150):
        assert torch.allclose(shares.sum(1), torch.ones(len(shares)))
        assert ((shares > 0).sum(0) == 1).all()


def test_a_weave_of_little_variance_is_far() -> None:
    exemplar = F.avg_pool2d(noise(1, 4 * SIDE, 4 * SIDE)[None], 5, 1)[0]
    loss = SpectrumLoss(exemplar, "none")
    slices = F.avg_pool2d(noise(8, 1, SIDE + 4, SIDE + 4, seed=1), 5, 1)
    weave = torch.ones(SIDE, SIDE)
    weave[:, ::2] = -1
    assert loss(slices + 0.2 * exemplar.std() * weave) > 2 * loss(slices)


@pytest.mark.parametrize(
    ("first", "second", "symmetry"),
    [((0.2, 0.2), (0.2, -0.2), "flips"), ((0.2, 0.0), (0.0, 0.2), "all")],
)
def test_directions_are_told_apart_unless_symmetry_has_both(
    first: tuple[float, float], second: tuple[float, float], symmetry: str
) -> None:
    one, other = waves(*first), waves(*second)
    assert between(other, one) > 100 * between(one, one)
    both = torch.stack([one, other])
    assert SpectrumLoss(one, "none")(both) > 5 * SpectrumLoss(one, symmetry)(both)


def test_it_ignores_positions_and_empty_channels() -> None:
    exemplar = torch.cat([noise(1, SIDE, SIDE), torch.zeros(1, SIDE, SIDE)])
    moved = exemplar.roll((20, 30), (1, 2))
    speckled = exemplar.clone()
    speckled[1] = noise(1, SIDE, SIDE)[0]
    assert between(moved, exemplar) < 0.1 * between(2 * exemplar, exemplar)
    assert between(speckled, exemplar) == pytest.approx(0, abs=1e-6)


def test_its_gradient_leads_to_the_spectrum_of_the_photograph() -> None:
    exemplar = waves(0.3, 0.1, 2 * SIDE)
    loss = SpectrumLoss(exemplar, "none")
    image = noise(1, SIDE, SIDE, seed=5)[None].requires_grad_()
    optimizer = torch.optim.Adam([image], 0.05)
    first = loss(image).item()
    for _ in range(100):
        optimizer.zero_grad()
        loss(image).backward()
        optimizer.step()
    assert loss(image).item() < 0.05 * first


@pytest.mark.parametrize("side", [16, 40, 96])
def test_slices_of_any_size_are_accepted(side: int) -> None:
    loss = SpectrumLoss(noise(3, 100, 120), "all")
    image = noise(3, side, side, seed=2)[None].requires_grad_()
    value = loss(image)
    value.backward()
    assert value.isfinite() and image.grad is not None and image.grad.isfinite().all()


def test_a_training_on_grain_has_it_and_resumes_to_the_same_bits(tmp_path: Path) -> None:
    photo = save_specks(tmp_path / "photo.png")
    whole = train(make_trainer([photo], tmp_path / "whole", "lattice"))
    train(make_trainer([photo], tmp_path / "parts", "lattice"), steps=3)
    parts = train(make_trainer([photo], tmp_path / "parts", "lattice"))
    assert "spectrum" in whole.objective.names
    assert whole.finished and parts.finished
    assert_equal(whole.generator.state_dict(), parts.generator.state_dict())
