"""Line elongation, which is a reason for a lattice."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from small_trainings import of_solid

from solidtex_export.analysis.choice import LONG_LINES
from solidtex_export.analysis.lines import line_elongation
from solidtex_export.images.exemplar import Exemplar

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
    assert (line_elongation([of_solid(name, seed)]) >= LONG_LINES) == (name in ("marble", "wood"))
