"""In which orientations a photograph is shown where the user does not say."""

from __future__ import annotations

from pathlib import Path

import pytest
import torch
from PIL import Image
from small_trainings import SMALL, config_of, of_solid
from torch import Tensor

from solidtex_export.analysis.symmetry import Symmetry
from solidtex_export.analysis.symmetry import symmetry_of as symmetry_of_images
from solidtex_export.images.exemplar import Exemplar
from solidtex_export.losses.descriptor.weights import PROCEDURAL, load_weights
from solidtex_export.losses.learned import LearnedDescriptor

SIDE = 96
torch.set_num_threads(1)
distances = LearnedDescriptor(load_weights(PROCEDURAL)).distances


def symmetry_of(exemplars: list[Exemplar], turns: bool) -> Symmetry:
    return symmetry_of_images(exemplars, distances, turns)


def lit_bumps() -> Tensor:
    """Round bumps [channel, row, column], bright where they face the upper left corner."""
    generator = torch.Generator().manual_seed(2)
    height = torch.zeros(SIDE, SIDE)
    at = torch.arange(SIDE, dtype=torch.float32)
    for row, column in torch.rand(160, 2, generator=generator) * SIDE:
        square = (at - row).square()[:, None] + (at - column).square()[None, :]
        height = torch.maximum(height, (30 - square).clamp_min(0).sqrt())
    slope = height.diff(dim=0, prepend=height[:1]) + height.diff(dim=1, prepend=height[:, :1])
    gray = (0.5 + 0.1 * slope).clamp(0, 1)
    return torch.stack([gray, 0.9 * gray, 0.7 * gray])


def exemplar(image: Tensor) -> Exemplar:
    return Exemplar("image", "", image)


def test_a_photograph_lit_from_one_side_keeps_its_orientation() -> None:
    for turns in (True, False):
        found = symmetry_of([exemplar(lit_bumps())], turns)
        assert found.name == "none" and "flipped" in found.reason


def test_light_counts_beside_grain() -> None:
    noise = torch.randn(1, SIDE, SIDE, generator=torch.Generator().manual_seed(1))
    faint = 0.5 + 0.5 * (lit_bumps() - 0.5) + 0.08 * noise
    assert symmetry_of([exemplar(faint.clamp(0, 1))], True).name == "none"
    assert symmetry_of([of_solid("sandstone", side=SIDE)], True).name == "all"


@pytest.mark.parametrize("name", ["marble", "brick", "porous", "paint", "spheres"])
def test_an_isotropic_photograph_is_turned(name: str) -> None:
    assert symmetry_of([of_solid(name, side=SIDE)], True).name == "all"


def test_layers_are_flipped_only() -> None:
    found = symmetry_of([of_solid("wood", side=SIDE)], True)
    assert found.name == "flips" and "turned" in found.reason
    assert symmetry_of([of_solid("wood", side=SIDE)], False).name == "flips"


def test_one_lit_photograph_of_several_decides() -> None:
    plain = of_solid("porous", side=SIDE).image
    pair = [exemplar(plain), exemplar(lit_bumps())]
    assert symmetry_of(pair, False).name == "none"


def test_the_same_in_every_call_and_the_generator_left_alone() -> None:
    picture = exemplar(lit_bumps())
    before = torch.get_rng_state()
    first, second = (symmetry_of([picture], True) for _ in range(2))
    assert first == second
    assert torch.equal(before, torch.get_rng_state())


def symmetry_in(result: Path, photo: Path, method: str, *options: str) -> object:
    """What a small training of that method takes."""
    small = [part for setting in SMALL[method] for part in ("--set", setting)]
    return config_of(photo, result, "--preset", method, *small, *options)["symmetry"]


def test_the_command_measures_only_without_symmetry(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    photo = tmp_path / "bumps.png"
    pixels = (255 * lit_bumps()).byte().permute(1, 2, 0).numpy()
    Image.fromarray(pixels).save(photo)
    assert symmetry_in(tmp_path / "measured", photo, "lattice") == "none"
    assert "so --symmetry none" in capsys.readouterr().err
    assert symmetry_in(tmp_path / "said", photo, "lattice", "--symmetry", "flips") == "flips"
    assert "--symmetry" not in capsys.readouterr().err
    # Random planes through a solid show it turned, and a paper's method has a symmetry of its own.
    assert symmetry_in(tmp_path / "planes", photo, "sampler") == "all"
    assert symmetry_in(tmp_path / "grain", photo, "sampler", "--directions", "xy") == "flips"
    assert symmetry_in(tmp_path / "paper", photo, "gutierrez") == "none"
    assert "--symmetry" not in capsys.readouterr().err
