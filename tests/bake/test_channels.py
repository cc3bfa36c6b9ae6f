"""solidtex-bake and solidtex-info on a model whose channels are more than a color's three."""

from __future__ import annotations

import json
import os
import subprocess
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest
from meshes import cube_obj

from solidtex_export.export import random_models
from solidtex_export.export.file_format.model_file import ModelFile, write
from solidtex_export.export.file_format.model_file import read as read_model

PROGRAMS = Path(os.environ["SOLIDTEX_BUILD"]) / "bin"
CHANNELS = ["height", "albedo.b", "roughness", "albedo.r", "albedo.g"]
SIZE = (7, 5, 3)


@pytest.fixture
def model(tmp_path: Path) -> Path:
    """Uniform noise, each channel with a copy of its own: color and maps in a strange order."""
    document = {
        "version": 1,
        "name": "mixed",
        "family": "field",
        "channels": CHANNELS,
        "color_space": "linear",
        "noise": {"scheme": "solidtex-1"},
        "field": {
            "nodes": [
                {
                    "name": "noise",
                    "op": "noise",
                    "level": 0,
                    "channels": len(CHANNELS),
                    "distribution": "uniform",
                }
            ],
            "output": "noise",
        },
    }
    path = tmp_path / "mixed.solidtex"
    write(path, ModelFile(document, {}))
    return path


def run(program: str, *arguments: object) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [PROGRAMS / program, *map(str, arguments)], capture_output=True, text=True, check=False
    )


def bake(model: Path, *arguments: object) -> subprocess.CompletedProcess[str]:
    return run("solidtex-bake", model, "--size", ",".join(map(str, SIZE)), *arguments)


@pytest.fixture
def voxels(model: Path, tmp_path: Path) -> np.ndarray:
    """[x, y, z, channel], as the model has them."""
    assert bake(model, "-o", tmp_path / "all.npy").returncode == 0
    values = np.load(tmp_path / "all.npy")
    assert values.shape == (*SIZE, len(CHANNELS))
    return values


def read(path: Path) -> tuple[list[str], np.ndarray]:
    """Names, and values [x, y, channel]."""
    image = oiio.ImageBuf(str(path))
    return list(image.spec().channelnames), image.get_pixels(oiio.FLOAT).transpose(1, 0, 2)


def test_png_slices_of_each_group(model: Path, voxels: np.ndarray, tmp_path: Path) -> None:
    assert bake(model, "-o", tmp_path / "slices", "--slices", "png").returncode == 0
    names = {f"{g}-{z:04}.png" for g in ("albedo", "height", "roughness") for z in range(SIZE[2])}
    assert set(os.listdir(tmp_path / "slices")) == names
    _, albedo = read(tmp_path / "slices" / "albedo-0001.png")
    linear = voxels[:, :, 1, [3, 4, 1]].astype(np.float64)
    encoded = np.where(linear > 0.0031308, 1.055 * linear ** (1 / 2.4) - 0.055, 12.92 * linear)
    assert np.abs(albedo - encoded).max() < 0.6 / 255
    _, roughness = read(tmp_path / "slices" / "roughness-0001.png")
    assert np.abs(roughness[..., 0] - voxels[:, :, 1, 2]).max() < 0.6 / 255  # plain data


def test_exr_slices_name_all_channels(model: Path, voxels: np.ndarray, tmp_path: Path) -> None:
    assert bake(model, "-o", tmp_path / "slices", "--slices", "exr").returncode == 0
    names, values = read(tmp_path / "slices" / "0002.exr")
    assert set(names) == {"R", "G", "B", "height", "roughness"}
    for name, channel in zip(["R", "G", "B", "height", "roughness"], [3, 4, 1, 0, 2], strict=True):
        assert np.array_equal(values[:, :, names.index(name)], voxels[:, :, 2, channel])


def test_previews_show_the_color_or_the_requested_channel(model: Path, tmp_path: Path) -> None:
    pictures = {}
    for show in ("", "albedo", "height", "roughness"):
        file = tmp_path / f"{show or 'default'}.png"
        assert bake(model, "--preview", file, *(["--show", show] if show else [])).returncode == 0
        pictures[show] = read(file)[1]
    assert np.array_equal(pictures[""], pictures["albedo"])
    assert np.ptp(pictures["height"], axis=2).max() == 0 < np.ptp(pictures["albedo"], axis=2).max()
    assert not np.array_equal(pictures["height"], pictures["roughness"])


def test_an_unknown_channel_is_refused_with_the_known_ones(model: Path, tmp_path: Path) -> None:
    result = bake(model, "--preview", tmp_path / "a.png", "--show", "gloss")
    assert result.returncode == 1
    expected = f"--show gloss: {model} has height, albedo, roughness"
    assert expected in result.stderr
    assert not (tmp_path / "a.png").exists()
    for name, is_advised in (("color", False), ("metallic", True)):
        result = bake(model, "--preview", tmp_path / "a.png", "--show", name)
        assert ("solidtex-train --map" in result.stderr) is is_advised


@pytest.mark.parametrize("name", ["a.npy", "a.zarr", "a.nrrd"])
def test_values_that_are_not_finite_are_not_written(name: str, tmp_path: Path) -> None:
    model, file = random_models.lattice_model(levels=2), tmp_path / "m.solidtex"
    tensors = dict(model.tensors)
    for tensor in ("cb2_2.conv3.bias", "last_conv.weight"):
        tensors[tensor] = np.full_like(tensors[tensor], 3e38)
    write(file, ModelFile(model.document, tensors))
    result = run("solidtex-bake", file, "--size", "4", "-o", tmp_path / name)
    assert result.returncode == 1
    assert f"{file}: channel albedo.r: found the value " in result.stderr
    assert "expected a finite one" in result.stderr
    left = [entry for entry in os.listdir(tmp_path) if entry != "a.zarr"]  # can be continued
    assert left == ["m.solidtex"]


def test_a_channel_that_would_leave_the_folder_is_no_map(model: Path, tmp_path: Path) -> None:
    document = json.loads(json.dumps(read_model(model).document).replace("roughness", "../out"))
    write(tmp_path / "m.solidtex", ModelFile(document, {}))
    cube = cube_obj(tmp_path / "cube.obj")
    arguments = ["--mesh", cube, "--maps", "../out", "-o", tmp_path / "maps"]
    result = run("solidtex-bake", tmp_path / "m.solidtex", *arguments)
    assert result.returncode == 1 and 'found the channel "../out"' in result.stderr
    assert not (tmp_path / "maps").exists()


def test_info_escapes_what_would_control_the_terminal(model: Path, tmp_path: Path) -> None:
    training = {"a\x1b[2J": "b\x9b2J", "umlaut": "\u00e4"}
    file = tmp_path / "m.solidtex"
    write(file, ModelFile(read_model(model).document | {"training": training}, {}))
    printed = run("solidtex-info", file, "--verbose").stdout
    assert "a\\u001b[2J: b\\u009b2J" in printed and "umlaut: \u00e4" in printed


def test_info_lists_the_channels(model: Path) -> None:
    report = json.loads(run("solidtex-info", model, "--json").stdout)
    assert report["channels"] == CHANNELS and len(report["voxel"]["values"]) == len(CHANNELS)
    assert " ".join(CHANNELS) in run("solidtex-info", model).stdout
