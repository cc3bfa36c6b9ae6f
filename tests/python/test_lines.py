"""Lengths of thin lines, which decide whether a training begins with large steps."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import torch
from small_trainings import make_trainer, of_solid, save_photo, save_specks

from solidtex_export.analysis.lines import line_length
from solidtex_export.images.exemplar import Exemplar
from solidtex_export.training.preset import Early, Start
from solidtex_export.training.preset_file import load_method

SIDE = 100


def grey(plane: np.ndarray) -> Exemplar:
    image = torch.from_numpy(np.repeat(plane[None], 3, axis=0)).float()
    return Exemplar("grey", "", image)


def bars(length: int, width: int) -> np.ndarray:
    """Bright horizontal bars, a row of them every 20 pixels."""
    plane = np.zeros((SIDE, SIDE))
    for row in range(8, SIDE, 20):
        for column in range(5, SIDE - length, length + 15):
            plane[row : row + width, column : column + length] = 1
    return plane


def long_line(dark: bool = False) -> Exemplar:
    plane = bars(80, 2)
    return grey(1 - plane if dark else plane)


@pytest.mark.parametrize("dark", [False, True])
def test_a_line_has_its_length_in_widths(dark: bool) -> None:
    assert line_length([long_line(dark)]) == pytest.approx(80 / 2, rel=0.1)


def test_turning_a_picture_changes_nothing() -> None:
    plane = bars(50, 2)
    assert line_length([grey(plane.T.copy())]) == pytest.approx(line_length([grey(plane)]), rel=0.1)


def test_dots_and_wide_bars_are_no_lines() -> None:
    grain = np.random.default_rng(0).normal(0, 0.1, (SIDE, SIDE))
    dots, thin, wide = (line_length([grey(bars(*b) + grain)]) for b in ((2, 2), (80, 2), (80, 9)))
    assert dots < 4 and wide < thin / 3


def test_a_constant_picture_has_none() -> None:
    assert line_length([grey(np.full((SIDE, SIDE), 0.5))]) == 0


def test_the_photograph_with_the_longest_counts() -> None:
    dots, lines = grey(bars(2, 2)), long_line()
    assert line_length([dots, lines]) > 5 * line_length([dots, dots])


@pytest.mark.parametrize("seed", [0, 1, 2])
@pytest.mark.parametrize("name", ["marble", "wood", "brick", "paint", "porous", "spheres"])
def test_veins_and_layers_are_long_and_crumbs_are_short(name: str, seed: int) -> None:
    limit = load_method("lattice").early.line_length
    assert (line_length([of_solid(name, seed)]) >= limit) == (name in ("marble", "wood"))


def test_only_lines_in_all_directions_begin_smooth(tmp_path: Path) -> None:
    """Unless the method says otherwise: not fibres, nor specks."""
    stripes, specks = save_photo(tmp_path / "stripes.png"), save_specks(tmp_path / "specks.png")
    method = load_method("lattice").start
    asking, one_way = ("--set", "start.line_length=0"), ("--directions", "xy")
    all_ways = ("--symmetry", "all")
    assert make_trainer([stripes], tmp_path / "a", "lattice", *all_ways).config.start == method
    assert make_trainer([stripes], tmp_path / "b", "lattice", *one_way).config.start == Start()
    assert make_trainer([specks], tmp_path / "c", "lattice").config.start == Start()
    asked = make_trainer([specks], tmp_path / "d", "lattice", *one_way, *asking).config.start
    assert (asked.smoothing, asked.fine_noise) == (method.smoothing, method.fine_noise)


@pytest.mark.parametrize("seed", [0, 1, 2])
@pytest.mark.parametrize("name", ["brick", "sandstone", "paint", "porous", "spheres", "marble"])
def test_outlines_are_longer_than_crumbs_and_grain(name: str, seed: int) -> None:
    (limit,) = {t.line_length for t in load_method("lattice").losses if t.kind == "patches"}
    assert (line_length([of_solid(name, seed)]) < limit) == (name in ("brick", "sandstone"))


def test_only_long_lines_have_an_early_part(tmp_path: Path) -> None:
    stripes, specks = save_photo(tmp_path / "stripes.png"), save_specks(tmp_path / "specks.png")
    method = load_method("lattice").early
    with_lines = make_trainer([stripes], tmp_path / "a", "lattice").config
    without = make_trainer([specks], tmp_path / "b", "lattice").config
    always = ("--set", "early.line_length=0")
    asked = make_trainer([specks], tmp_path / "c", "lattice", *always).config
    assert with_lines.early == method and without.early == Early()
    assert asked.early.steps == method.steps
    record = json.loads((tmp_path / "a" / "config.json").read_text())
    assert record["line_length"] == with_lines.line_length >= method.line_length


def test_only_lines_are_compared_patch_by_patch(tmp_path: Path) -> None:
    stripes, specks = save_photo(tmp_path / "stripes.png"), save_specks(tmp_path / "specks.png")
    with_lines, without = (
        make_trainer([photo], tmp_path / photo.stem, "lattice") for photo in (stripes, specks)
    )
    always = ("--set", "losses.5.line_length=0")
    asked = make_trainer([specks], tmp_path / "asked", "lattice", *always)
    assert "patches" in with_lines.objective.names and "patches" in asked.objective.names
    assert "patches" not in without.objective.names
    only_with_lines = set(with_lines.objective.names) - set(without.objective.names)
    assert only_with_lines == {"patches", "projected"}
    only_without = set(without.objective.names) - set(with_lines.objective.names)
    assert only_without == {"spectrum", "style", "adversarial"}
    assert set(asked.objective.names) - set(without.objective.names) == {"patches"}


def test_maps_are_not_compared_patch_by_patch(tmp_path: Path) -> None:
    stripes = save_photo(tmp_path / "stripes.png")
    maps, always = ("--map", f"wear={stripes}"), ("--set", "losses.5.with_maps=true")
    colour, mapped, asked = (
        make_trainer([stripes], tmp_path / name, "lattice", *options).objective.names
        for name, options in (("a", ()), ("b", maps), ("c", (*maps, *always)))
    )
    assert set(colour) == set(asked) == {*mapped, "patches"}
    assert "patches" not in mapped


def test_long_lines_have_a_critic_of_features_in_place_of_that_of_pixels(tmp_path: Path) -> None:
    stripes, specks = save_photo(tmp_path / "stripes.png"), save_specks(tmp_path / "specks.png")
    long = ("--set", "losses.6.line_length=0", "--set", "losses.3.line_length_below=0")
    critics = [
        set(make_trainer([photo], tmp_path / name, "lattice", *options).opponents[0])
        for name, photo, options in (("a", stripes, ()), ("b", specks, ()), ("c", specks, long))
    ]
    assert critics == [{"projected_critic"}, {"critic"}, {"critic", "projected_critic"}]
