"""Which family a photograph gets where the user names none."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import torch
from PIL import Image
from small_trainings import CRITIC, LATTICE, SMALL, config_of, of_solid
from torch import Tensor

from solidtex_export.analysis.choice import LATTICES, Choice, choose_preset, lattice_preset
from solidtex_export.analysis.measurements import Measurements
from solidtex_export.analysis.structure import MeasuredImage
from solidtex_export.analysis.surrogate import surrogate
from solidtex_export.analysis.symmetry import Symmetry
from solidtex_export.images.exemplar import Exemplar
from solidtex_export.losses.descriptor.weights import SHIPPED, load_weights
from solidtex_export.losses.learned import LearnedDescriptor

SIDE = 96
distance = LearnedDescriptor(load_weights(SHIPPED)).loss


def suited(picture: Exemplar, directions: str) -> Choice:
    return choose_preset(Measurements([picture], directions, lambda: distance))


def grains() -> Tensor:
    """Noise on three octaves [channel, row, column], every channel a share of it."""
    random = np.random.default_rng(3)
    octaves = [
        random.normal(size=(SIDE // n, SIDE // n)).repeat(n, 0).repeat(n, 1) for n in (1, 2, 4)
    ]
    gray = torch.from_numpy(sum(octaves)).float()
    return torch.stack([gray, 0.8 * gray, 0.5 * gray]) * 0.1 + 0.5


def test_a_surrogate_has_color_distribution_and_spectrum_without_outlines() -> None:
    image = of_solid("porous").image
    other = surrogate(image, torch.Generator().manual_seed(0))
    assert other.shape == image.shape
    assert torch.allclose(other.mean((1, 2)), image.mean((1, 2)), atol=0.1)
    assert set(other.unique().tolist()) <= set(image.unique().tolist())
    rows = [torch.fft.rfft2(i[0] - i[0].mean()).abs() for i in (image, other)]
    coarse = [float(r[:8, :8].square().sum() / r.square().sum()) for r in rows]
    assert coarse[1] == pytest.approx(coarse[0], rel=0.5)
    edges = [float((i[0].diff(dim=1) != 0).float().mean()) for i in (image, other)]
    assert edges[1] > 1.5 * edges[0]


def test_surrogates_of_odd_sizes_keep_colors_together() -> None:
    image = grains()[:, :33, :47]
    other = surrogate(image, torch.Generator())
    assert other.shape == image.shape
    assert float(torch.corrcoef(other.flatten(1))[0, 1]) > 0.9


def test_the_structure_score_is_the_same_in_every_call_and_leaves_the_generator_alone() -> None:
    picture = Exemplar("grains", "", grains())
    before = torch.get_rng_state()
    first, second = (MeasuredImage(picture, distance).structure_score for _ in range(2))
    assert first == second
    assert torch.equal(before, torch.get_rng_state())


@pytest.mark.parametrize("name", ["brick", "spheres", "paint"])
def test_outlines_get_a_lattice(name: str) -> None:
    found = suited(of_solid(name, side=SIDE), "xyz")
    assert found.value == "lattice" and "structure score" in found.reason


def test_a_photograph_that_looks_different_turned_gets_a_lattice() -> None:
    found = suited(stretched(8), "xyz")
    assert found.value == "lattice" and "turned" in found.reason


def test_veins_get_a_lattice() -> None:
    found = suited(of_solid("marble", side=SIDE), "xyz")
    assert found.value == "lattice" and "line elongation" in found.reason


@pytest.mark.parametrize(
    "lines, outlined, method",
    [(4, 1, "sampler"), (7, 1, "lattice"), (7, 0.3, "sampler"), (10, 0.3, "lattice")],
)
def test_short_lines_need_some_outlines(
    lines: float, outlined: float, method: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    measured = Measurements([Exemplar("grains", "", grains())], "xyz", lambda: distance)
    monkeypatch.setattr(measured, "line_elongation", lines)
    monkeypatch.setattr(measured, "structure_score", outlined)
    monkeypatch.setattr(measured, "symmetry", Symmetry("all", ""))
    assert choose_preset(measured).value == method


def stretched(times: int) -> Exemplar:
    """Grains stretched along the columns of pixels by a factor."""
    image = grains()[:, : SIDE // times].repeat_interleave(times, 1)
    return Exemplar("stretched", "", image)


def test_horizontal_layers_and_short_grain_get_a_lattice() -> None:
    for exemplar in (of_solid("sandstone", side=SIDE), stretched(1), stretched(3)):
        found = suited(exemplar, "xy")
        assert found.value == "lattice" and "grain" in found.reason


def test_grains_and_long_grain_get_a_sampler() -> None:
    assert suited(stretched(1), "xyz").value == "sampler"
    assert suited(stretched(8), "xy").value == "sampler"
    assert suited(of_solid("wood", side=SIDE), "xy").value == "sampler"


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
    said = capsys.readouterr().out
    assert "structure score" in said and "so --preset sampler" in said
    (reason,) = chosen["reasons"]
    assert reason in said
    settings = [part for s in [*LATTICE, *CRITIC] for part in ("--set", s)]
    assert config_of(photo, tmp_path / "set", *settings)["preset"] == "lattice-grains"
    named = [part for s in SMALL["lattice"] for part in ("--set", s)]
    assert (
        config_of(photo, tmp_path / "x", "--directions", "z", *named)["preset"] == "lattice-grains"
    )
    assert "structure score" not in capsys.readouterr().out


@pytest.mark.parametrize(
    ("elongation", "symmetry", "maps", "preset"),
    [
        (3.2, "all", False, "lattice-grains"),
        (3.3, "all", False, "lattice-outlines"),
        (8.9, "all", True, "lattice-grains"),
        (9.0, "all", False, "lattice-lines"),
        (9.0, "all", True, "lattice-lines-maps"),
        (14.9, "flips", False, "lattice-outlines"),
        (14.9, "none", True, "lattice-grains"),
        (15.0, "all", False, "lattice-veins"),
        (15.0, "all", True, "lattice-veins-maps"),
        (15.0, "flips", False, "lattice-fibers"),
        (15.0, "none", True, "lattice-fibers-maps"),
    ],
)
def test_longer_lines_have_other_presets(
    elongation: float, symmetry: str, maps: bool, preset: str
) -> None:
    assert lattice_preset(elongation, symmetry, maps) == preset
    assert preset in LATTICES
