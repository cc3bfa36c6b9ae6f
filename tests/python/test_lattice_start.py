"""Initial weights of the lattice generator."""

import copy

import pytest
import torch

from solidtex_export.generators.init import quiet_fine_noise, smooth_coarse_features
from solidtex_export.generators.lattice import Box, LatticeGenerator


@pytest.fixture
def generator() -> LatticeGenerator:
    torch.manual_seed(3)
    return LatticeGenerator(levels=4)


def test_smoothing_keeps_the_size_of_weights_and_leaves_those_of_noise(
    generator: LatticeGenerator,
) -> None:
    before = copy.deepcopy(generator.state_dict())
    smooth_coarse_features(generator, 1.0)
    for name, weight in generator.state_dict().items():
        if not name.endswith("_2.conv1.weight"):
            assert torch.equal(weight, before[name]), name
            continue
        coarse = weight.shape[1] - 4
        assert torch.equal(weight[:, coarse:], before[name][:, coarse:])
        smooth, old = weight[:, :coarse], before[name][:, :coarse]
        assert float(smooth.std() / old.std()) == pytest.approx(1, abs=0.25)
        center = smooth[:, :, 1, 1, 1]
        assert torch.allclose(smooth[:, :, 0, 1, 1], center / 2)
        assert torch.allclose(smooth[:, :, 0, 0, 2], center / 8)


def test_without_smoothing_nothing_is_drawn(generator: LatticeGenerator) -> None:
    before = copy.deepcopy(generator.state_dict())
    state = torch.get_rng_state()
    smooth_coarse_features(generator, 0.0)
    assert torch.equal(torch.get_rng_state(), state)
    assert all(torch.equal(w, before[name]) for name, w in generator.state_dict().items())


def test_an_untrained_solid_is_smoother(generator: LatticeGenerator) -> None:
    """What it is for: neighboring voxels are alike before anything has been learned."""
    as_built = likeness(generator)
    quiet_fine_noise(generator, 0.2)
    quiet = likeness(generator)
    smooth_coarse_features(generator, 0.5)
    assert as_built < quiet - 0.1 < likeness(generator) - 0.2


@torch.no_grad()
def likeness(generator: LatticeGenerator) -> float:
    """Correlation of neighboring voxels, each slice normalized by its own statistics."""
    torch.manual_seed(4)
    box = Box((0, 0, 0), (1, 64, 64))
    y = generator(generator.draw_noise(box), box)
    y = y - y.mean((2, 3, 4), keepdim=True)
    return float((y[..., 1:] * y[..., :-1]).mean() / y.square().mean())
