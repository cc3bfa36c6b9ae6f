"""Copying, repetition, directions and the cut cube: each finds what it is there to find."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter
from textures_2d import blobs, tiled

from solidtex_export.evaluation.correspondence import as_colors, coherence, correspondence
from solidtex_export.evaluation.directions import directionality, half_length
from solidtex_export.evaluation.pictures import BRIGHTNESS, draw_cut_cube, luminance
from solidtex_export.evaluation.repetition import repetition


def test_a_copied_piece_is_found_where_it_was_copied_from() -> None:
    exemplar = blobs(1)
    places = correspondence(exemplar[30:60, 50:90], exemplar)
    assert coherence(places) == 1
    assert places[0, 0].tolist() == [30, 50] and places[-1, -1].tolist() == [56, 86]


def test_tiles_of_the_exemplar_are_caught_as_copies() -> None:
    exemplar = blobs(1)
    fresh = coherence(correspondence(blobs(2)[:32, :32], exemplar))
    assert fresh < 0.3
    assert coherence(correspondence(tiled(exemplar)[:56, :56], exemplar)) > 0.85


def test_correspondence_is_the_nearest_neighborhood() -> None:
    rng = np.random.default_rng(0)
    picture, exemplar = rng.random((8, 9, 3)), rng.random((10, 11, 3))
    places = correspondence(picture, exemplar)
    for row, column in ((0, 0), (4, 5), (2, 3)):
        ours = picture[row : row + 4, column : column + 4]
        errors = [
            [np.square(ours - exemplar[r : r + 4, c : c + 4]).sum() for c in range(8)]
            for r in range(7)
        ]
        best = np.unravel_index(np.argmin(errors), (7, 8))
        assert tuple(places[row, column]) == best


def test_colors_of_the_map_tell_places_apart() -> None:
    places = np.array([[[0, 0], [0, 96], [56, 0]]])
    colors = as_colors(places, (60, 100, 3))
    assert colors.tolist() == [[[0, 0, 1], [0, 1, 0.5], [1, 0, 0.5]]]


def test_a_tiled_exemplar_repeats_and_a_texture_does_not() -> None:
    exemplar = blobs(1)
    found = repetition(luminance(tiled(exemplar)))
    assert found.repeats and found.correlation > 0.9
    assert [abs(lag) % 48 for lag in found.lag] == [0, 0]
    for seed in range(3):
        assert not repetition(luminance(blobs(seed))).repeats


def test_a_volume_that_repeats_faintly_is_caught() -> None:
    rng = np.random.default_rng(3)
    fresh = gaussian_filter(rng.standard_normal((80, 80, 80)), 1.5)
    assert not repetition(fresh).repeats
    period = gaussian_filter(rng.standard_normal((20, 20, 20)), 1.5, mode="wrap")
    weave = fresh / fresh.std() + 0.7 * np.tile(period / period.std(), (4, 4, 4))
    found = repetition(weave)
    assert found.repeats and all(abs(lag) % 20 == 0 for lag in found.lag)


def test_a_ring_too_faint_to_see_is_no_repetition() -> None:
    noise = np.random.default_rng(6).standard_normal((96, 96, 96))
    for share, repeats in ((0.06, False), (0.25, True)):
        found = repetition(noise + share * np.roll(noise, 7, axis=0))
        assert found.repeats == repeats and found.lag in ((7, 0, 0), (-7, 0, 0))
        assert found.deviations > 2 * found.allowed


def test_equal_distant_blocks_are_detected() -> None:
    rng = np.random.default_rng(4)
    noise = gaussian_filter(rng.standard_normal((96, 64, 64)), 1.5)
    first, second = noise[:64], noise[32:]
    found = repetition(first, second)
    assert found.repeats and found.lag == (-32, 0, 0)
    other = gaussian_filter(rng.standard_normal((64, 64, 64)), 1.5)
    assert not repetition(first, other).repeats


def test_a_structure_longer_than_the_image_has_no_large_lags() -> None:
    stripes = np.broadcast_to(np.linspace(0, 1, 64), (64, 64))
    assert repetition(stripes) is None


@pytest.mark.parametrize(("degrees", "long"), [(0, "across"), (90, "down")])
def test_grain_has_a_length_and_a_direction(degrees: float, long: str) -> None:
    sigma = (2, 12) if long == "across" else (12, 2)
    crops = blobs(1, 96, 96, sigma=sigma)[None]
    found = directionality(crops)
    ratio = found.length_across / found.length_down
    assert ratio > 3 if long == "across" else ratio < 1 / 3
    assert found.coherence > 0.6
    assert abs((found.angle - degrees + 90) % 180 - 90) < 10


def test_angles_are_counterclockwise() -> None:
    rows, columns = np.indices((96, 96))
    rising = np.cos(
        2 * np.pi * (rows + columns) / 16
    )  # rows run downwards: lines rise to the right
    found = directionality(rising[None, ..., None])
    assert found.angle == pytest.approx(45, abs=2) and found.coherence > 0.95


def test_bands_under_grain_show_in_the_coarse_coherence() -> None:
    rows, columns = np.indices((96, 96))
    bands = 0.3 * np.cos(2 * np.pi * (rows + columns) / 40)
    grain = np.random.default_rng(3).standard_normal((96, 96))
    found = directionality((bands + grain)[None, ..., None])
    assert found.coherence < 0.1
    assert found.coarse_coherence > 0.5 and found.coarse_angle == pytest.approx(45, abs=5)


def test_streaks_that_turn_raise_only_the_local_coherence() -> None:
    isotropic = np.stack([blobs(s, 96, 96) for s in range(8)])
    streaks = [blobs(s, 96, 96, sigma=(2, 8) if s % 2 else (8, 2)) for s in range(8)]
    found, plain = directionality(np.stack(streaks)), directionality(isotropic)
    assert found.coherence < 0.2
    assert found.local_coherence > plain.local_coherence + 0.15


def test_half_length_of_an_exponential() -> None:
    assert half_length(np.exp(-np.arange(50) / 10)) == pytest.approx(10 * np.log(2), abs=0.01)
    assert half_length(np.ones(5)) is None
    assert half_length(np.zeros(5)) == 0


def test_the_cube_shows_its_faces_and_its_inside() -> None:
    block = np.zeros((32, 32, 32, 3), dtype=np.float32)
    block[16:, 16:, 16:] = (1, 0, 0)  # the corner that is cut out
    block[-1, :16, :16] = (0, 1, 0)
    block[15] += (0, 0, 1)  # the plane that the cut lays open, normal to x
    picture = draw_cut_cube(block, 200)
    assert (picture[0] == 1).all() and (picture[:, 0] == 1).all()  # white around it
    hues = {tuple(color) for color in picture.reshape(-1, 3).astype(float).round(2).tolist()}
    assert (0, BRIGHTNESS[0], 0) in hues
    assert (0, 0, BRIGHTNESS[0]) in hues
    assert not any(red > 0.5 and not blue for red, _, blue in hues)
