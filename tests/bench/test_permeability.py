"""Benchmarks of permeability: another method on the same voxels; boundaries of cut cubes."""

import numpy as np
import permeability
import permeability_boundaries
import pytest
import stokes_differences
from scipy import ndimage

from solidtex import transport


@pytest.mark.parametrize("axis", [0, 2])
def test_the_flow_through_a_tube_is_known(axis: int) -> None:
    section, exact = permeability.tube(8)
    pores = np.moveaxis(np.repeat(section[None], 4, 0), 0, axis)
    found, spread = stokes_differences.permeability(pores, axis)
    assert found == pytest.approx(exact, rel=0.03)
    assert spread < 1e-3


def test_a_random_medium_is_as_permeable_by_both_methods() -> None:
    noise = ndimage.gaussian_filter(np.random.default_rng(1).normal(size=(24, 20, 22)), 2)
    pores = noise > np.quantile(noise, 0.55)
    found, _ = stokes_differences.permeability(pores, 1)
    expected = transport.permeability(pores, 1, tolerance=1e-3).value
    assert found == pytest.approx(expected, rel=0.06)


def test_boundaries_move_no_straight_channels_and_close_crooked_ones() -> None:
    is_inside = np.arange(24) % 6 < 3
    channels = np.tile(is_inside[:, None] & is_inside, (24, 1, 1))
    assert permeability_boundaries.compared(channels, 1)[1:] == pytest.approx((1, 1), rel=0.01)
    blobs = permeability_boundaries.blobs(64, 0.25, 0)
    _, opened, repeated = permeability_boundaries.compared(blobs, 1)
    assert repeated < 0.9 * opened
