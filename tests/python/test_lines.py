"""Line elongation, which decides between the presets of the lattice family."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import torch
from small_trainings import make_trainer, of_solid, save_photo, save_specks

from solidtex_export.analysis.choice import OUTLINES, VEINS
from solidtex_export.analysis.lines import line_elongation
from solidtex_export.images.exemplar import Exemplar
from solidtex_export.training.recipe import Init, InitialPhase, Recipe

SIDE = 100


def gray(plane: np.ndarray) -> Exemplar:
    image = torch.from_numpy(np.repeat(plane[None], 3, axis=0)).float()
    return Exemplar("gray", "", image)


def bars(length: int, width: int) -> np.ndarray:
    """Bright horizontal bars, a row of them every 20 pixels."""
    plane = np.zeros((SIDE, SIDE))
    for row in range(8, SIDE, 20):
        for column in range(5, SIDE - length, length + 15):
            plane[row : row + width, column : column + length] = 1
    return plane


def long_line(dark: bool = False) -> Exemplar:
    plane = bars(80, 2)
    return gray(1 - plane if dark else plane)


@pytest.mark.parametrize("dark", [False, True])
def test_a_line_has_its_length_in_widths(dark: bool) -> None:
    assert line_elongation([long_line(dark)]) == pytest.approx(80 / 2, rel=0.1)


def test_turning_an_image_changes_nothing() -> None:
    plane = bars(50, 2)
    assert line_elongation([gray(plane.T.copy())]) == pytest.approx(
        line_elongation([gray(plane)]), rel=0.1
    )


def test_dots_and_wide_bars_are_no_lines() -> None:
    grain = np.random.default_rng(0).normal(0, 0.1, (SIDE, SIDE))
    dots, thin, wide = (
        line_elongation([gray(bars(*b) + grain)]) for b in ((2, 2), (80, 2), (80, 9))
    )
    assert dots < 4 and wide < thin / 3


def test_a_constant_image_has_no_lines() -> None:
    assert line_elongation([gray(np.full((SIDE, SIDE), 0.5))]) == 0


def test_the_photograph_with_the_longest_counts() -> None:
    dots, lines = gray(bars(2, 2)), long_line()
    assert line_elongation([dots, lines]) > 5 * line_elongation([dots, dots])


@pytest.mark.parametrize("seed", [0, 1, 2])
@pytest.mark.parametrize("name", ["marble", "wood", "brick", "paint", "porous", "spheres"])
def test_veins_and_layers_are_long_and_crumbs_are_short(name: str, seed: int) -> None:
    assert (line_elongation([of_solid(name, seed)]) >= VEINS) == (name in ("marble", "wood"))


@pytest.mark.parametrize("seed", [0, 1, 2])
@pytest.mark.parametrize("name", ["brick", "sandstone", "paint", "porous", "spheres", "marble"])
def test_outlines_are_longer_than_crumbs_and_grain(name: str, seed: int) -> None:
    is_short = line_elongation([of_solid(name, seed)]) < OUTLINES
    assert is_short == (name in ("brick", "sandstone"))


def recipe(photo: Path, result: Path, *options: str) -> Recipe:
    return make_trainer([photo], result, "lattice", *options).config.recipe


def test_only_lines_in_all_directions_begin_smooth(tmp_path: Path) -> None:
    """Not fibers, nor specks."""
    stripes, specks = save_photo(tmp_path / "stripes.png"), save_specks(tmp_path / "specks.png")
    smooth = Init(smoothing=0.5, fine_noise=0.2)
    assert recipe(stripes, tmp_path / "a", "--symmetry", "all").init == smooth
    assert recipe(stripes, tmp_path / "b", "--directions", "xy").init == Init()
    assert recipe(specks, tmp_path / "c").init == Init()


def test_only_long_lines_have_an_initial_phase(tmp_path: Path) -> None:
    stripes, specks = save_photo(tmp_path / "stripes.png"), save_specks(tmp_path / "specks.png")
    large_steps = InitialPhase(steps=250, learning_rate=0.015)
    assert recipe(stripes, tmp_path / "a").initial_phase == large_steps
    assert recipe(specks, tmp_path / "b").initial_phase == InitialPhase()
    asked = ("--set", "initial_phase.steps=250")
    assert recipe(specks, tmp_path / "c", *asked).initial_phase.steps == 250


def test_only_lines_are_compared_patch_by_patch(tmp_path: Path) -> None:
    stripes, specks = save_photo(tmp_path / "stripes.png"), save_specks(tmp_path / "specks.png")
    with_lines, without = (
        set(recipe(photo, tmp_path / photo.stem).losses) for photo in (stripes, specks)
    )
    asked = set(recipe(specks, tmp_path / "asked", "--set", "losses.patches.end=0.4").losses)
    assert with_lines - without == {"patches", "projected"}
    assert without - with_lines == {"spectrum", "style", "adversarial"}
    assert asked - without == {"patches"}


def test_maps_are_not_compared_patch_by_patch(tmp_path: Path) -> None:
    stripes = save_photo(tmp_path / "stripes.png")
    maps, asked = ("--map", f"wear={stripes}"), ("--set", "losses.patches.enabled=true")
    color, mapped, with_patches = (
        set(recipe(stripes, tmp_path / name, *options).losses)
        for name, options in (("a", ()), ("b", maps), ("c", (*maps, *asked)))
    )
    assert color == with_patches == {*mapped, "patches"}
    assert "patches" not in mapped


def test_long_lines_have_a_critic_of_features_in_place_of_that_of_pixels(tmp_path: Path) -> None:
    stripes, specks = save_photo(tmp_path / "stripes.png"), save_specks(tmp_path / "specks.png")
    both = ("--set", "losses.projected.start=0.4")
    critics = [
        set(make_trainer([photo], tmp_path / name, "lattice", *options).discriminators[0])
        for name, photo, options in (("a", stripes, ()), ("b", specks, ()), ("c", specks, both))
    ]
    assert critics == [{"projected_critic"}, {"critic"}, {"critic", "projected_critic"}]
