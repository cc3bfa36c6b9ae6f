"""Which family a photograph gets where the user names none."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import torch
from PIL import Image
from small_trainings import CRITIC, LATTICE, SMALL, config_of, of_solid
from torch import Tensor

from solidtex_export.analysis.choice import Choice, choose_preset
from solidtex_export.analysis.grain import grain_ratio
from solidtex_export.analysis.measurements import Measurements
from solidtex_export.analysis.symmetry import symmetry_of
from solidtex_export.images.exemplar import Exemplar
from solidtex_export.losses.descriptor.weights import PROCEDURAL, load_weights
from solidtex_export.losses.learned import LearnedDescriptor

SIDE = 96
distances = LearnedDescriptor(load_weights(PROCEDURAL)).distances


def suited(picture: Exemplar, directions: str) -> Choice:
    return choose_preset(Measurements([picture], directions, lambda: distances))


def grains() -> Tensor:
    """Noise on three octaves [channel, row, column], every channel a share of it."""
    random = np.random.default_rng(3)
    octaves = [
        random.normal(size=(SIDE // n, SIDE // n)).repeat(n, 0).repeat(n, 1) for n in (1, 2, 4)
    ]
    gray = torch.from_numpy(sum(octaves)).float()
    return torch.stack([gray, 0.8 * gray, 0.5 * gray]) * 0.1 + 0.5


@pytest.mark.parametrize("name", ["brick", "spheres", "paint"])
def test_structures_of_many_pixels_get_a_lattice(name: str) -> None:
    found = suited(of_solid(name, side=SIDE), "xyz")
    assert found.value == "lattice" and "pixels wide" in found.reason


def test_fine_grain_that_looks_right_in_all_orientations_gets_a_sampler() -> None:
    found = suited(stretched(1), "xyz")
    assert found.value == "sampler" and "turned" in found.reason


def test_fine_grain_that_looks_different_turned_gets_a_lattice() -> None:
    found = suited(stretched(3), "xyz")
    assert found.value == "lattice" and "turned" in found.reason


def test_thin_lines_get_a_lattice() -> None:
    image = torch.rand(1, SIDE, SIDE, generator=torch.Generator().manual_seed(0)).repeat(3, 1, 1)
    image[:, ::24], image[:, :, ::24] = 1.5, 1.5
    found = suited(Exemplar("net", "", image), "xyz")
    assert found.value == "lattice" and "line elongation" in found.reason


def stretched(times: int) -> Exemplar:
    """Grains stretched along the columns of pixels by a factor."""
    image = grains()[:, : SIDE // times].repeat_interleave(times, 1)
    return Exemplar("stretched", "", image)


def turned(exemplar: Exemplar) -> Exemplar:
    return Exemplar("turned", "", exemplar.image.transpose(1, 2))


def test_short_grain_and_short_layers_get_a_lattice() -> None:
    for exemplar in (stretched(1), stretched(3), turned(stretched(3))):
        assert suited(exemplar, "xy").value == "lattice"


def test_long_grain_and_long_layers_get_a_sampler() -> None:
    for exemplar in (stretched(8), of_solid("wood", side=SIDE)):
        found = suited(exemplar, "xy")
        assert found.value == "sampler" and "grain" in found.reason
    for exemplar in (turned(stretched(8)), of_solid("sandstone", side=SIDE)):
        found = suited(exemplar, "xy")
        assert found.value == "sampler" and "layers" in found.reason


def shaded(exemplar: Exemplar) -> Exemplar:
    """Darker from row to row, by three times the deviation of what is there."""
    shade = torch.linspace(-1.7, 1.7, SIDE)[:, None] * 3 * exemplar.image.std()
    return Exemplar("shaded", "", exemplar.image - shade)


def test_shade_does_not_hide_long_grain() -> None:
    wood, found = shaded(stretched(8)), suited(shaded(stretched(8)), "xy")
    assert found.value == "sampler" and "grain" in found.reason
    assert grain_ratio(wood) == pytest.approx(grain_ratio(stretched(8)), rel=0.4)
    assert suited(shaded(stretched(1)), "xy").value == "lattice"


def test_a_photograph_without_shade_has_its_plain_grain_ratio() -> None:
    for exemplar in (stretched(1), stretched(8), of_solid("wood", side=SIDE)):
        assert grain_ratio(turned(exemplar)) == pytest.approx(1 / grain_ratio(exemplar))


class Measured(Measurements):
    """Measurements of these values; a photograph is not looked at."""

    def __init__(self, directions: str, **values: object) -> None:
        super().__init__([], directions, lambda: distances)
        vars(self).update(values)


@pytest.mark.parametrize(
    ("grain", "preset"),
    [(3.69, "lattice"), (3.7, "sampler"), (1 / 4.99, "lattice"), (1 / 5.01, "sampler")],
)
def test_limits_of_long_grain_and_layers(grain: float, preset: str) -> None:
    assert choose_preset(Measured("xy", grain=grain)).value == preset


@pytest.mark.parametrize(
    ("width", "lines", "flipped", "preset"),
    [
        (1.5, 8.9, 3.9, "sampler"),
        (1.51, 8.9, 3.9, "lattice"),
        (1.5, 9.0, 3.9, "lattice"),
        (1.5, 8.9, 4.0, "lattice"),
    ],
)
def test_limits_of_fine_grain_lines_and_symmetry(
    width: float, lines: float, flipped: float, preset: str
) -> None:
    def flips(copies: Tensor) -> Tensor:
        return torch.full((len(copies) - 1,), flipped / 1000)

    picture = Exemplar("noise", "", torch.rand(3, SIDE, SIDE))
    symmetry = symmetry_of([picture], flips, turns=True)
    measured = Measured("xyz", grain_width=width, line_elongation=lines, symmetry=symmetry)
    assert choose_preset(measured).value == preset


@pytest.mark.parametrize("directions", ["xyz", "xy"])
def test_a_photograph_of_one_tone_has_nothing_to_measure(directions: str) -> None:
    plain = Exemplar("plain", "", torch.full((3, SIDE, SIDE), 0.4))
    expected = {"xyz": "sampler", "xy": "lattice"}[directions]
    assert suited(plain, directions).value == expected


def test_the_command_chooses_only_without_a_preset(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    photo = tmp_path / "grains.png"
    pixels = (255 * grains().clamp(0, 1)).byte().permute(1, 2, 0).numpy()
    Image.fromarray(pixels).save(photo)
    chosen = config_of(photo, tmp_path / "chosen")
    assert (chosen["preset"], chosen["family"]) == ("sampler", "sampler")
    said = capsys.readouterr().err
    assert "so --preset sampler" in said
    (reason,) = chosen["reasons"]
    assert reason in said
    settings = [part for s in [*LATTICE, *CRITIC] for part in ("--set", s)]
    assert config_of(photo, tmp_path / "set", *settings)["preset"] == "lattice"
    named = [part for s in SMALL["lattice"] for part in ("--set", s)]
    assert config_of(photo, tmp_path / "x", "--directions", "z", *named)["preset"] == "lattice"
    assert "so --preset sampler" not in capsys.readouterr().err
