"""The encoder of an Alanov training as a texture space that finds textures and makes no models."""

from __future__ import annotations

import copy
import json
import os
import subprocess
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest
import torch
from PIL import Image
from small_spaces import run, save_photos
from test_alanov import begin, save_preset, save_volumes

import solidtex
from solidtex_export.commands import export_space
from solidtex_export.spaces.alanov.result import read_alanov
from solidtex_export.training.result import ResultError

REPOSITORY = Path(__file__).resolve().parents[2]
PROGRAMS = Path(os.environ.get("SOLIDTEX_BUILD", REPOSITORY / "build")) / "bin"
SIDE = 16  # of a crop


@pytest.fixture
def space(tmp_path: Path) -> Path:
    photos = [str(save_photos(tmp_path / "photos") / "list.csv")]
    preset = save_preset(tmp_path / "preset.toml", 2, 0.5)
    run(begin(photos, preset, tmp_path / "result", 3), 3)
    path = tmp_path / "walls.solidtex-space"
    assert export_space.main([str(tmp_path / "result"), "-o", str(path)]) == 0
    return path


def test_the_file_has_the_encoder_that_was_trained(tmp_path: Path, space: Path) -> None:
    opened, result = solidtex.Space(space), read_alanov(tmp_path / "result")
    assert (opened.family, opened.patch_size, opened.code_size) == ("none", SIDE, 3)
    assert np.allclose(opened.photograph(1).code, result.codes[1])
    pixels = np.random.default_rng(0).random((SIDE, SIDE, 3), np.float32)
    values = torch.from_numpy(2 * pixels - 1).permute(2, 0, 1)[None]
    expected = result.encoder(values)[0][0].detach().numpy()
    found = opened.encode(pixels).code
    assert np.std(found) > 1e-3
    assert np.allclose(found, expected, atol=1e-5)


def test_it_finds_textures_and_makes_no_models(tmp_path: Path, space: Path) -> None:
    photo, heat = tmp_path / "photo.png", tmp_path / "heat.exr"
    pixels = np.full((24, 40, 3), 40, np.uint8)
    pixels[:, 20:] = np.random.default_rng(0).integers(0, 256, (24, 20, 3))
    Image.fromarray(pixels).save(photo)
    options = ["--patch", "0,0,16,16", "--step", "4", "--alpha", "30", "-o", heat]
    subprocess.run([PROGRAMS / "solidtex-detect", space, photo, *options], check=True)
    found = oiio.ImageBuf(str(heat)).get_pixels(oiio.FLOAT)[:, :, 0]
    assert found[4:20, :16].min() > found[4:20, 30:].max()
    model = tmp_path / "model.solidtex"
    encode = [PROGRAMS / "solidtex-encode", photo, "--space", space, "-o", model]
    done = subprocess.run(encode, capture_output=True, text=True, check=False)
    assert done.returncode == 1 and "an encoder alone, without models" in done.stderr
    assert not model.exists()
    info = subprocess.check_output([PROGRAMS / "solidtex-info", space], text=True)
    assert "family" in info and "makes no models" in info
    report = json.loads(subprocess.check_output([PROGRAMS / "solidtex-info", space, "--json"]))
    assert report["family"] == "none" and "parameters" not in report


@pytest.mark.parametrize(
    ("name", "options", "is_space"),
    [("-", ["--material", "p1"], False), ("-.solidtex-space", [], True)],
)
def test_standard_output(
    tmp_path: Path,
    space: Path,
    capfdbinary: pytest.CaptureFixture[bytes],
    name: str,
    options: list[str],
    is_space: bool,
) -> None:
    capfdbinary.readouterr()
    assert export_space.main([str(tmp_path / "result"), "-o", name, *options]) == 0
    found = tmp_path / "found"
    found.write_bytes(capfdbinary.readouterr().out)
    assert (b"solidtex-space" in found.read_bytes()[:4096]) == is_space


def test_codes_of_crops_are_kept(tmp_path: Path, space: Path) -> None:
    result = read_alanov(tmp_path / "result")
    count = len(result.crop_codes) // len(result.codes)
    assert count > 1
    means = result.crop_codes.reshape(len(result.codes), count, -1).mean(1)
    assert torch.allclose(means, result.codes, atol=1e-5)
    result.measure()
    measured = copy.deepcopy(result.generator.state_dict())
    result.crop_codes = result.codes
    result.measure()
    changed = result.generator.state_dict()
    assert any(not torch.equal(value, changed[name]) for name, value in measured.items())


def test_refusals(tmp_path: Path, space: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = [str(tmp_path / "result"), "-o", str(space), "--force", "--material", "p1"]
    assert export_space.main(arguments) == 1
    expected = "expected neither; write a model to -o NAME.solidtex"
    assert expected in capsys.readouterr().err
    result = read_alanov(tmp_path / "result")
    result.resolution = 1 << 15
    with pytest.raises(ResultError, match="photographs of 32768, expected at least 16 and at most"):
        result.encoder_space("walls", "")
    volumes = list(map(str, save_volumes(tmp_path / "volumes")))
    run(begin(volumes, save_preset(tmp_path / "p.toml", 3), tmp_path / "rocks", 1), 1)
    assert export_space.main([str(tmp_path / "rocks"), "-o", str(space), "--force"]) == 1
    assert "expected one on photographs" in capsys.readouterr().err
