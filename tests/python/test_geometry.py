"""Figures of analytic volumes: surface, Euler characteristic, mean breadth, S2, chords, pores."""

import math

import numpy as np
import pytest
from analytic_volumes import RADIUS, ball, cylinder, slabs

from solidtex_export.measuring import geometry, representative


def test_the_surface_of_balls_cylinders_and_slabs() -> None:
    assert geometry.specific_surface(ball()) * 64**3 == pytest.approx(
        4 * math.pi * RADIUS**2, rel=0.03
    )
    assert geometry.specific_surface(cylinder(RADIUS)) == pytest.approx(
        2 * math.pi * RADIUS / 64**2, rel=0.03
    )
    faces = 7  # between 8 bands
    assert geometry.specific_surface(slabs()) == pytest.approx(faces / 31, rel=0.1)
    assert geometry.specific_surface(np.ones((9, 9, 9), bool)) == 0


def test_the_boundary_of_a_disk() -> None:
    disk = cylinder(RADIUS)[:, :, 0]
    assert geometry.specific_surface(disk) * 64**2 == pytest.approx(2 * math.pi * RADIUS, rel=0.02)


def test_the_euler_characteristic_and_the_mean_breadth() -> None:
    assert geometry.euler_characteristic(ball()) == 1
    assert geometry.mean_breadth(ball()) == pytest.approx(2 * RADIUS, abs=1)
    shell = ball() & ~ball(12.2)
    assert geometry.euler_characteristic(shell) == 2  # one component, one cavity
    assert geometry.mean_breadth(shell) == pytest.approx(2 * RADIUS - 2 * 12.2, abs=1)
    ring = np.zeros((9, 9, 9), bool)
    ring[2:7, 2:7, 4] = True
    ring[4, 4, 4] = False
    assert geometry.euler_characteristic(ring) == 0  # one component, one tunnel


def test_s2_of_slabs_and_of_noise() -> None:
    across, within = geometry.two_point(slabs(), 2), geometry.two_point(slabs(), 0)
    assert within == [0.5] * 17
    assert across[0] == 0.5 and across[4] == 0 and across[8] == 0.5
    noise = np.random.default_rng(2).random((48, 48, 48)) < 0.3
    found = geometry.two_point(noise, 1)
    assert found[0] == noise.mean()
    assert found[1:] == pytest.approx([0.09] * 24, abs=0.005)


def test_chords_are_runs_that_no_border_cuts() -> None:
    assert set(geometry.chords(slabs(), 2)) == {4}
    assert len(geometry.chords(slabs(), 2)) == 3 * 32**2  # the band at the border does not count
    assert len(geometry.chords(slabs(), 0)) == 0
    mean = geometry.chords(ball(), 0).mean()
    assert mean == pytest.approx(4 / 3 * RADIUS, rel=0.02)  # Cauchy


def grains(edge: int, cubes: int, seed: int) -> np.ndarray:
    """Cubes of an edge, each of the phase by a chance of 0.3, cut at random."""
    rng = np.random.default_rng(seed)
    whole = (rng.random((cubes + 1,) * 3) < 0.3).repeat(edge, 0).repeat(edge, 1).repeat(edge, 2)
    at = [slice(s, s + cubes * edge) for s in rng.integers(0, edge, 3)]
    return whole[tuple(at)]


def test_the_integral_range_is_that_of_independent_cubes() -> None:
    volumes = [grains(4, 12, seed) for seed in range(60)]
    ranges = [geometry.integral_range(v) for v in volumes]
    assert np.mean(ranges) == pytest.approx(4**3, rel=0.1)
    expected = np.sqrt(np.mean([geometry.measure_phase(v, 2.0, "um")["fraction_deviation"] ** 2
                                for v in volumes]))  # fmt: skip
    assert np.std([v.mean() for v in volumes]) == pytest.approx(expected, rel=0.2)
    assert geometry.measure_phase(volumes[0], 2.0, "um")["integral_range_um3"] == ranges[0] * 8
    flat = np.random.default_rng(1).random((300, 200)) < 0.3
    assert geometry.integral_range(flat) == pytest.approx(1, abs=0.8)  # 6 waves
    assert geometry.integral_range(np.zeros((9, 9, 9), bool)) == 0


def test_pore_sizes_of_slabs_and_of_two_balls() -> None:
    two = np.zeros((80, 40, 40), bool)
    at = np.indices(two.shape)
    for center, radius in ((20, 15), (60, 8)):
        middle = np.array([center, 20, 20]).reshape(3, 1, 1, 1)
        two |= ((at - middle) ** 2).sum(0) < radius**2
    radii, covered = map(np.array, geometry.pore_sizes(two))
    assert (np.diff(covered) <= 0).all()
    assert radii[-1] == pytest.approx(15, abs=0.5)
    share = 15**3 / (15**3 + 8**3)
    assert covered[radii > 8.5] == pytest.approx(share, abs=0.05)


def test_disks_in_slices_have_the_radii_of_the_slices() -> None:
    tube = np.moveaxis(cylinder(12), 2, 0)
    radii, covered = geometry.pore_sizes(tube[0])
    assert radii[-1] == pytest.approx(12, abs=0.8)
    assert geometry.mean_radius(radii, covered) == pytest.approx(radii[-1])
    assert geometry.disk_sizes(tube, radii) == pytest.approx(covered)
    mixed = np.stack([tube[0], np.zeros_like(tube[0]), np.ones_like(tube[0])])
    share = tube[0].mean() / (1 + tube[0].mean())  # of the tube, in all of the phase
    found = np.array(geometry.disk_sizes(mixed, [*radii, 40.0]))
    assert found[:-1] == pytest.approx(1 - share * (1 - np.array(covered)), abs=1e-4)
    assert found[-1] == pytest.approx(1 - share, abs=1e-4)  # no disk of 40 fits into the tube
    assert geometry.mean_radius([1.0, 2.0, 4.0], [0.9, 0.5, 0.25]) == pytest.approx(1.9)


def test_squares_of_a_section_have_the_surface_of_the_solid() -> None:
    section = np.random.default_rng(0).random((64, 96)) < 0.3
    rows = representative.analyze(section, 2.0, "um", {})
    assert [(row["edge_voxels"], row["squares"]) for row in rows] == [(16, 24), (32, 6), (64, 1)]
    whole = 4 / math.pi * geometry.specific_surface(section[:, :64]) / 2
    assert rows[-1]["specific_surface_per_um"]["mean"] == pytest.approx(whole)
    assert rows[-1]["euler_density_per_um2"]["mean"] == pytest.approx(
        geometry.euler_characteristic(section[:, :64]) / 128**2
    )


def test_cubes_of_a_uniform_solid_are_representative() -> None:
    rows = representative.analyze(slabs(64), 2.0, "um", {})
    assert [row["edge_voxels"] for row in rows] == [16, 32, 64]
    assert [row["cubes"] for row in rows] == [27, 8, 1]
    for row in rows:
        assert row["fraction"]["mean"] == 0.5
        assert row["edge_um"] == 2 * row["edge_voxels"]
    assert rows[0]["fraction"]["deviation"] == 0 and rows[-1]["fraction"]["deviation"] is None
