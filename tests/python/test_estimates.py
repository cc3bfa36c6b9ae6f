"""Maps estimated from one photograph: --estimate of solidtex-train."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import torch
from measure_estimates import cuts, rendered
from PIL import Image
from scipy import ndimage

from solidtex_export.commands import train as cli_train
from solidtex_export.images.estimates import METHOD, estimate_height, estimate_roughness
from solidtex_export.images.photographs import read_picture

torch.set_num_threads(1)
SIZE = 44


def correlation(first: np.ndarray, second: np.ndarray) -> float:
    return float(np.corrcoef(first.ravel(), second.ravel())[0, 1])


@pytest.mark.parametrize("solid", ["grains", "paint"])
def test_estimates_follow_true_maps(solid: str) -> None:
    color, maps = cuts(solid, seed=5)  # no seed of the experiment's table
    photo = rendered(color, maps["height"], maps["roughness"], light=(0, 0, 1))
    assert correlation(estimate_height(photo), maps["height"]) > 0.5
    assert correlation(estimate_roughness(photo), maps["roughness"]) > 0.25


def test_uneven_light_is_no_relief() -> None:
    rows, columns = np.mgrid[:256, :256] / 256
    noise = ndimage.gaussian_filter(np.random.default_rng(1).random((256, 256)), 3)
    dents = 0.3 * (noise - noise.min()) / np.ptp(noise)
    even = np.repeat((0.6 - dents)[:, :, None], 3, axis=2).astype(np.float32)
    uneven = (even * (0.7 + 0.5 * columns + 0.2 * rows)[:, :, None]).astype(np.float32)
    assert correlation(estimate_height(even), estimate_height(uneven)) > 0.9
    assert abs(correlation(estimate_height(uneven), columns)) < 0.2


def test_a_constant_photograph_gets_constant_maps() -> None:
    gray = np.full((64, 48, 3), 0.4, np.float32)
    assert np.ptp(estimate_height(gray)) == 0 and estimate_height(gray)[0, 0] == 0.5
    assert np.ptp(estimate_roughness(gray)) == 0


@pytest.fixture
def photo(tmp_path: Path) -> Path:
    pixels = np.random.default_rng(2).integers(40, 220, (60, 52, 3)).astype(np.uint8)
    path = tmp_path / "stone.png"
    Image.fromarray(pixels).save(path)
    return path


def arguments(photo: Path, *more: str) -> list[str]:
    result = str(photo.parent / "r")
    common = ["--size", str(SIZE), "--device", "cpu", "--threads", "1", "--steps", "1"]
    return [str(photo), "--preset", "sampler", *common, "-o", result, *more]


def test_training_takes_estimates_as_maps_and_says_what_they_are(photo: Path) -> None:
    command = arguments(photo, "--estimate", "height,roughness")
    assert cli_train.main(command) == 0
    config = json.loads((photo.parent / "r" / "config.json").read_text())
    assert config["channels"][3:] == ["height", "roughness"]
    record = config["exemplars"][0]["maps"]["height"]
    assert record["estimate"] == METHOD
    file = photo.parent / "r-estimates" / record["file"]
    picture = read_picture(file)
    assert picture.sha256 == record["sha256"] and picture.size == (52, 60)
    assert cli_train.main(command) == 0  # the same training
    # A map that was touched up is another training.
    Image.fromarray(np.zeros((60, 52), np.uint16)).save(file)
    assert cli_train.main(command) == 1


@pytest.mark.parametrize(
    ("more", "message"),
    [
        (["--estimate", "normal"], "found normal, expected height or roughness"),
        (["--estimate", "height,height"], "found height,height"),
        (["--estimate", "height", "--map", "height=h.png"], "found height, expected none"),
    ],
)
def test_usage(
    more: list[str], message: str, photo: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as error:
        cli_train.main(arguments(photo, *more))
    assert error.value.code == 2
    assert message in capsys.readouterr().err
