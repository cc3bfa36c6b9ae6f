"""Samplers that start with grain along z, or with layers: long octaves, and silent short ones."""

from __future__ import annotations

import pytest
import torch

from solidtex_export.generators.init import init_grain
from solidtex_export.generators.sampler import HashedLattice, OctaveSampler
from solidtex_export.training.resolve import initial_grain

CPU = torch.device("cpu")


@pytest.mark.parametrize(
    ("measured", "start"),
    [(10.0, 20.0), (64.0, 128.0), (100.0, 128.0), (1.0, 2.0), (0.1, 0.1), (0.001, 1 / 128)],
)
def test_fibers_start_twice_as_long_as_measured_and_layers_as_measured(
    measured: float, start: float
) -> None:
    assert initial_grain(measured) == start


def test_without_short_octaves_all_are_stretched() -> None:
    sampler = OctaveSampler(octaves=8, hidden_layers=3, width=16, noise_at="input")
    before = sampler.scales.clone()
    init_grain(sampler, 30.0, 0)
    assert torch.allclose(sampler.scales[..., :2], before[..., :2])
    assert torch.allclose(sampler.scales[..., 2], before[..., 2] / 30)


def test_short_octaves_go_from_round_to_almost_as_long_as_the_grain() -> None:
    sampler = OctaveSampler(octaves=8, coarsest=32.0, hidden_layers=3, width=16, noise_at="input")
    init_grain(sampler, 16.0, 2)
    across, along = 1 / sampler.scales[:, 0, 0], 1 / sampler.scales[:, 0, 2]
    expected = torch.tensor([32, 16, 8, 4, 2, 1, 1, 2**0.5])
    assert torch.allclose(across, expected)
    assert torch.allclose(along / across, torch.tensor([16.0] * 6 + [1, 4]))


def test_octaves_of_layers_are_long_along_x_and_y() -> None:
    fibers, layers = (
        OctaveSampler(octaves=8, coarsest=32.0, hidden_layers=3, width=16, noise_at="input")
        for _ in range(2)
    )
    init_grain(fibers, 16.0, 2)
    init_grain(layers, 1 / 16, 2)
    assert torch.allclose(layers.scales[..., :2], fibers.scales[..., 2:].expand(-1, -1, 2))
    assert torch.allclose(layers.scales[..., 2:], fibers.scales[..., :1])


@pytest.mark.parametrize("noise_at", ["input", "hidden"])
def test_short_octaves_start_with_weight_zero(noise_at: str) -> None:
    sampler = OctaveSampler(octaves=8, hidden_layers=3, width=16, noise_at=noise_at)
    init_grain(sampler, 16.0, 2)
    lattice = HashedLattice(8, CPU)
    points = torch.rand(50, 3) * 40
    loud = lambda cells: lattice(cells) * torch.tensor([1.0] * 6 + [5.0] * 2).view(-1, 1)  # noqa: E731
    silent = sampler(points, lattice)
    assert torch.equal(sampler(points, loud), silent)
    silent.square().sum().backward()
    layer = sampler.hidden[6 // sampler.bin_size]
    assert layer.noise is not None and layer.noise.grad is not None
    assert layer.noise.grad[:, -2:].abs().amax(0).gt(0).all()
