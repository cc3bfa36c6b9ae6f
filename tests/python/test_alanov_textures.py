"""benchmarks/alanov_textures.py: figures and scores of a small training."""

from __future__ import annotations

import csv
from pathlib import Path

import alanov_textures
import pytest
import torch
from PIL import Image
from small_spaces import run, save_photos
from test_alanov import begin, save_preset, small, table

from solidtex_export.generators.regions import Box
from solidtex_export.settings import validated
from solidtex_export.spaces.alanov.networks import Generator
from solidtex_export.spaces.alanov.settings import AlanovRecipe

torch.set_num_threads(1)

SIZE = small(2).crops.size


def make_generator(periodic: int) -> Generator:
    values = table(2) | {"code": 2}
    values["noise"] = values["noise"] | {"periodic": periodic}
    return Generator(validated(AlanovRecipe, values, "small")).eval()


def test_figures_and_scores_of_a_training(tmp_path: Path) -> None:
    photos = save_photos(tmp_path / "photos") / "list.csv"
    run(begin([str(photos)], save_preset(tmp_path / "small.toml", 2), tmp_path / "result", 2), 2)
    arguments = [str(tmp_path / "result"), str(photos), "-o", str(tmp_path / "figures")]
    alanov_textures.main([*arguments, "--samples=8", "--classifier-steps=40"])
    with (tmp_path / "figures" / "scores.csv").open(newline="") as file:
        rows = {row["images"]: row for row in csv.DictReader(file)}
    assert list(rows) == ["photographs", "unconditional", "conditional"]
    assert all(1 <= float(row["score"]) <= 3 for row in rows.values())
    assert all(row["count"] == "24" for row in rows.values())
    assert rows["unconditional"]["recognized"] == ""
    columns = 1 + alanov_textures.REPRODUCTIONS + alanov_textures.SAMPLES
    with Image.open(tmp_path / "figures" / "samples.jpg") as image:
        assert image.width == (SIZE + 4) * columns - 4
        assert image.height == (SIZE + 4) * 3 - 4
    assert (tmp_path / "figures" / "interpolation.jpg").exists()
    arguments[1] = str(tmp_path / "photos" / "p1.png")  # one of the three
    with pytest.raises(SystemExit):
        alanov_textures.main(arguments)


def test_one_photograph_has_rows_of_its_crops(tmp_path: Path) -> None:
    save_photos(tmp_path / "photos")
    photo = str(tmp_path / "photos" / "p1.png")
    run(begin([photo], save_preset(tmp_path / "small.toml", 2), tmp_path / "result", 1), 1)
    alanov_textures.main([str(tmp_path / "result"), photo, "-o", str(tmp_path / "figures")])
    with Image.open(tmp_path / "figures" / "samples.jpg") as image:
        assert image.height == (SIZE + 4) * alanov_textures.CROPS - 4
    assert (tmp_path / "figures" / "interpolation.jpg").exists()
    assert not (tmp_path / "figures" / "scores.csv").exists()


def test_scores_are_those_of_equation_9() -> None:
    assert alanov_textures.inception_score(torch.full((6, 4), 0.25)) == pytest.approx(1)
    certain = 0.999997 * torch.eye(4).repeat(5, 1) + 1e-6
    assert alanov_textures.inception_score(certain) == pytest.approx(4, rel=1e-3)
    value, deviation, missing = alanov_textures.score(certain[:3].repeat(20, 1))
    assert (value, missing) == (pytest.approx(3, rel=1e-3), 1)
    assert deviation < 0.5


def test_the_manifold_has_a_sample_for_each_code() -> None:
    count = round(2 * alanov_textures.RANGE / alanov_textures.STEP) + 1
    image = alanov_textures.manifold(make_generator(4), 8)
    assert image.shape == (3, 8 * count, 8 * count)
    assert 0 <= image.min() < image.max() <= 1


def test_an_interpolation_between_equal_codes_is_a_sample() -> None:
    generator, code = make_generator(0), torch.randn(2)
    torch.manual_seed(1)
    found = alanov_textures.interpolation(generator, code, code, 12, 40)
    torch.manual_seed(1)
    torch.testing.assert_close(found, generator(code[None], Box((0, 0), (12, 40)))[0])


def test_an_interpolation_ends_at_the_codes() -> None:
    generator = make_generator(4)
    first, last = torch.full((2,), -2.0), torch.full((2,), 2.0)
    images = []
    for codes in ((first, last), (first, first), (last, last)):
        torch.manual_seed(2)
        images.append(alanov_textures.interpolation(generator, *codes, 12, 200))
    whole, left, right = images
    assert (whole - left)[:, :, :8].abs().mean() < 0.3 * (whole - left)[:, :, -8:].abs().mean()
    assert not torch.equal(left, right)
