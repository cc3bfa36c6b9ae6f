"""Analytic solids and 3D statistics: single bodies, closed forms, determinism, exemplars."""

from __future__ import annotations

from dataclasses import astuple
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from scipy.special import ndtr

from solidtex_export.commands.solids import main
from solidtex_export.evaluation.correspondence import coherence, correspondence
from solidtex_export.research.solids.exact import BooleanSpheres, Excursion
from solidtex_export.research.solids.materials import SOLIDS, PorousRock, Spheres
from solidtex_export.research.solids.solid import Solid, box, exemplar, phase
from solidtex_export.research.solids.statistics import (
    chords,
    minkowski,
    solid_error,
    two_point,
)

SIDE = 96


@pytest.fixture(scope="module")
def spheres() -> list[np.ndarray]:
    return [phase_of(Spheres(seed)) for seed in range(3)]


@pytest.fixture(scope="module")
def porous() -> list[np.ndarray]:
    return [phase_of(PorousRock(seed)) for seed in range(3)]


def phase_of(solid: Solid, size: tuple[int, int, int] = (SIDE,) * 3) -> np.ndarray:
    return phase(box(solid, (0, 0, 0), size), solid)


def body(inside: np.ndarray) -> tuple[float, ...]:
    """Functionals of a whole body in a window of 63 counted voxels a side."""
    found = minkowski(inside)
    return (
        found.volume * 64**3,
        found.surface * 64**3,
        found.breadth * 63**2 * 64,
        found.euler * 63**3,
    )


@pytest.mark.parametrize("radius", [8.0, 15.3])
def test_a_ball(radius: float) -> None:
    inside = np.square(np.indices((64,) * 3) - 31.3).sum(0) <= radius**2
    volume, surface, breadth, euler = body(inside)
    assert volume == pytest.approx(4 / 3 * np.pi * radius**3, rel=0.01)
    assert surface == pytest.approx(4 * np.pi * radius**2, rel=0.04)
    assert breadth == pytest.approx(2 * radius, abs=0.6)
    assert euler == pytest.approx(1)


def test_topology_of_shells_and_rings() -> None:
    x, y, z = np.indices((64,) * 3) - 31.3
    distance = np.sqrt(x**2 + y**2 + z**2)
    shell = (distance <= 20) & (distance >= 12)
    assert body(shell)[3] == pytest.approx(2)
    ring = np.hypot(np.hypot(x, y) - 16, z) <= 5
    assert body(ring)[3] == pytest.approx(0, abs=1e-9)
    assert body(ring & (np.abs(x) > 2))[3] == pytest.approx(2)  # sawn in two


def test_porous_rock_is_the_excursion_set(porous: list[np.ndarray]) -> None:
    exact = Excursion(PorousRock())
    found = np.mean([astuple(minkowski(p)) for p in porous], axis=0)
    true = astuple(exact.minkowski())
    assert found[0] == pytest.approx(true[0], abs=0.04)
    assert found[1:] == pytest.approx(true[1:], rel=0.2)
    s2 = np.mean([two_point(p, 30) for p in porous], axis=0)
    assert s2 == pytest.approx(exact.two_point(range(31)), abs=0.04)
    # Far apart independent, in one place the same.
    ends = exact.two_point([0, 1000])
    assert ends == pytest.approx([0.65, 0.65**2])


def test_spheres_are_the_boolean_model(spheres: list[np.ndarray]) -> None:
    exact = BooleanSpheres(Spheres())
    true = exact.minkowski()
    found = [minkowski(p) for p in spheres]
    assert np.mean([f.volume for f in found]) == pytest.approx(true.volume, abs=0.04)
    assert np.mean([f.surface for f in found]) == pytest.approx(true.surface, rel=0.08)
    assert np.mean([f.breadth for f in found]) == pytest.approx(true.breadth, rel=0.25)
    s2 = np.mean([two_point(p, 30) for p in spheres], axis=0)
    assert s2 == pytest.approx(exact.two_point(range(31)), abs=0.05)


def test_chords_between_spheres_are_exponential() -> None:
    # Lines farther apart than spheres are wide, and long: few chords are cut off by the border.
    solid = Spheres(3)
    lines = [phase(box(solid, (40 * i, 0, 0), (1, 1, 4000)), solid) for i in range(8)]
    found = np.concatenate([chords(~line, axes=(2,)) for line in lines])
    exact = BooleanSpheres(solid).mean_pore_chord()
    assert found.mean() == pytest.approx(exact, rel=0.1)
    assert found.std() == pytest.approx(exact, rel=0.15)


def test_chords_of_slabs() -> None:
    slabs = np.zeros((4, 4, 40), dtype=bool)
    slabs[:, :, 5:12] = slabs[:, :, 20:23] = slabs[:, :, 35:] = True
    assert sorted(set(chords(slabs).tolist())) == [3, 7]  # the last one touches the border
    assert len(chords(slabs)) == 2 * 16
    assert sorted(set(chords(~slabs).tolist())) == [8, 12]


def test_two_point_function_of_noise() -> None:
    noise = np.random.default_rng(0).random((64, 64, 64)) < 0.3
    s2 = two_point(noise, 12)
    assert s2[0] == pytest.approx(noise.mean())
    assert s2[1:] == pytest.approx(0.09, abs=0.004)


def test_errors_separate_a_different_solid_from_another_piece_of_the_same(
    spheres: list[np.ndarray], porous: list[np.ndarray]
) -> None:
    same = solid_error(porous[1], porous[0])
    other = solid_error(spheres[0], porous[0])
    moved = solid_error(
        np.random.default_rng(0).permutation(porous[0].ravel()).reshape(porous[0].shape), porous[0]
    )
    for name in ("two_point", "chords_bright", "chords_dark", "surface", "euler"):
        ours = abs(getattr(same, name))
        assert ours < 0.2, name
        assert abs(getattr(moved, name)) > 2 * ours, name
    assert other.two_point > 3 * same.two_point and abs(other.volume) > 3 * abs(same.volume)
    assert set(astuple(solid_error(porous[0], porous[0]))) == {0.0}
    assert solid_error(np.ones_like(porous[0]), porous[0]).chords_dark == float("inf")


@pytest.mark.parametrize("name", SOLIDS)
def test_a_solid_is_a_function_of_seed_and_place(name: str) -> None:
    solid, again, other = (SOLIDS[name](seed) for seed in (0, 0, 1))
    whole = box(solid, (-9, 30, 5), (12, 6, 8))
    part = box(again, (-3, 32, 6), (4, 3, 5))
    assert np.allclose(whole[6:10, 2:5, 1:6], part, atol=1e-5)
    line = ((0, 0, 0), (1, 1, 200))
    assert not np.allclose(box(solid, *line), box(other, *line), atol=0.05)
    assert whole.min() >= 0 and whole.max() <= 1
    assert whole.shape[-1] == len(solid.channels)
    assert 0.05 < phase_of(solid, (48, 48, 48)).mean() < 0.97


@pytest.mark.parametrize("name", SOLIDS)
def test_exemplars_do_not_repeat(name: str) -> None:
    solid = SOLIDS[name](0)
    picture = exemplar(solid, 64, 200)[..., :3]
    noise = np.random.default_rng(0).normal(0, 0.002, picture.shape)  # flat areas have no place
    places = correspondence((picture + noise)[:40, :40], picture[:, 100:])
    assert coherence(places) < 0.5


def test_the_exemplar_is_the_slice_normal_to_x() -> None:
    solid = SOLIDS["wood"](0)
    picture = exemplar(solid, 40, 30)
    assert picture.shape == (40, 30, 3)
    assert np.allclose(picture[39, 7], box(solid, (0, 7, 0), (1, 1, 1))[0, 0, 0])
    assert np.allclose(picture[0, 7], box(solid, (0, 7, 39), (1, 1, 1))[0, 0, 0])
    down, across = (np.abs(np.diff(picture, axis=axis)).mean() for axis in (0, 1))
    assert down < across / 3  # the grain is vertical


def test_gaussian_fields_have_their_covariance() -> None:
    from solidtex_export.research.solids.random_parts import GaussianField

    points = np.random.default_rng(0).uniform(0, 3000, (20000, 3))
    moved = points + np.array([3.0, 0, 0])
    fields = [GaussianField((5.0, 9.0, 5.0), seed) for seed in range(4)]
    values = np.array([field(points) for field in fields])
    assert abs(values.mean()) < 0.02 and values.std() == pytest.approx(1, abs=0.05)
    assert (values < -1).mean() == pytest.approx(ndtr(-1), abs=0.01)
    product = np.mean([(field(points) * field(moved)).mean() for field in fields])
    assert product == pytest.approx(np.exp(-((3 / 5) ** 2) / 2), abs=0.05)


def test_the_maps_of_paint_share_their_edges() -> None:
    """Rust is dark, rough and low, paint light, smooth and high, everywhere."""
    values = exemplar(SOLIDS["paint"](0), 96, 96)
    rust = ~phase(values, SOLIDS["paint"](0))
    roughness, height = values[..., 3], values[..., 4]
    assert 0.15 < rust.mean() < 0.85
    assert ((roughness > 0.6) == rust).mean() > 0.95
    assert height[rust].mean() < height[~rust].mean() - 0.2


def test_images_are_written_once(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["grains", "--size", "40,24", "-o", str(tmp_path / "new")]
    assert main(arguments) == 0
    names = {"grains.png", "grains-roughness.png", "grains-height.png"}
    assert {p.name for p in (tmp_path / "new").iterdir()} == names
    with Image.open(tmp_path / "new" / "grains-height.png") as height:
        assert height.size == (40, 24) and height.mode == "L"
    assert main(arguments) == 1
    assert "found an existing file" in capsys.readouterr().err
    assert main([*arguments, "--force"]) == 0
