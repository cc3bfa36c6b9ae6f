"""Exemplars of more channels than three: maps stay registered, names travel into the model."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import torch
from PIL import Image

from solidtex_export.analysis.grain import channel_axes, whiten
from solidtex_export.commands import export as cli_export
from solidtex_export.commands import train as cli_train
from solidtex_export.export.file_format.model_file import read
from solidtex_export.images.channels import groups
from solidtex_export.images.exemplar import (
    Exemplar,
    load_exemplar,
    random_crops,
    random_symmetry,
)
from solidtex_export.images.file_kinds import ExemplarError
from solidtex_export.images.photographs import write_exr
from solidtex_export.images.srgb import srgb_decode, srgb_encode

torch.set_num_threads(1)
SIZE = 44
SHAPE = (60, 52)  # rows, columns
COLOR = ("albedo.r", "albedo.g", "albedo.b")


@pytest.fixture
def files(tmp_path: Path) -> Path:
    """A folder with albedo.png and two maps: roughness is its red, height its blue, 16 bits."""
    random = np.random.default_rng(3)
    colors = random.integers(60, 200, (*SHAPE, 3)).astype(np.uint8)
    Image.fromarray(colors).save(tmp_path / "albedo.png")
    Image.fromarray(colors[:, :, 0]).save(tmp_path / "roughness.png")
    Image.fromarray(colors[:, :, 2].astype(np.uint16) * 257).save(tmp_path / "height.png")
    return tmp_path


def arguments(files: Path, *more: str) -> list[str]:
    maps = [f"--map={name}={files / name}.png" for name in ("roughness", "height")]
    common = ["--size", str(SIZE), "--device", "cpu", "--threads", "1", "-o", str(files / "r")]
    return [str(files / "albedo.png"), *maps, *common, *more]


def load(files: Path, resolution: int = 100, **more: object) -> Exemplar:
    maps = {name: files / f"{name}.png" for name in ("roughness", "height")}
    return load_exemplar(files / "albedo.png", resolution, SIZE, maps=maps, **more)


@pytest.mark.parametrize("crop", [None, (3, 7, 49, 50)])
@pytest.mark.parametrize("resolution", [100, 45])
def test_maps_are_cropped_and_reduced_like_the_photograph(
    crop: tuple[int, ...] | None, resolution: int, files: Path
) -> None:
    exemplar = load(files, resolution, crop=crop)
    assert exemplar.channels == (*COLOR, "roughness", "height")
    image = exemplar.image
    columns, rows = crop[2:] if crop else SHAPE[::-1]
    assert min(image.shape[1:]) == min(resolution, columns, rows)
    assert (image[3] - image[0]).abs().max() < 1e-6
    assert (image[4] - image[2]).abs().max() < 1e-6


def test_crops_and_symmetries_take_all_channels_along(files: Path) -> None:
    image = load(files).image
    torch.manual_seed(0)
    for _ in range(20):
        crops = random_symmetry(random_crops(image, 2, 44, 44), "all")
        assert torch.equal(crops[:, 3], crops[:, 0])
        assert (crops[:, 4] - crops[:, 2]).abs().max() < 1e-6


def exemplar_of(image: torch.Tensor, *maps: str) -> Exemplar:
    return Exemplar("test", "", image, (*COLOR, *maps))


def test_axes_of_maps_do_not_depend_on_their_units() -> None:
    torch.manual_seed(1)
    image = torch.rand(5, 40, 40)
    image[3] += image[0]  # correlated with the color
    mean, basis = channel_axes([exemplar_of(image, "roughness", "height")])
    scales = torch.tensor([1, 1, 1, 0.004, 900.0])
    scaled = image * scales[:, None, None]
    scaled_mean, scaled_basis = channel_axes([exemplar_of(scaled, "roughness", "height")])
    y, scaled_y = whiten(image, mean, basis), whiten(scaled, scaled_mean, scaled_basis)
    signs = (y * scaled_y).sum((1, 2)).sign()[:, None, None]  # of axes, which are arbitrary
    assert (y - signs * scaled_y).abs().max() < 1e-3
    covariance = torch.cov(y.flatten(1))
    assert (covariance - torch.eye(5)).abs().max() < 1e-3  # no axis is small enough to be held back


def test_an_inconsistency_between_maps_is_far_from_the_mean() -> None:
    """Where roughness follows the color, a place where it does not is many deviations away."""
    torch.manual_seed(1)
    image = torch.rand(1, 40, 40).repeat(4, 1, 1) + 0.01 * torch.rand(4, 40, 40)
    mean, basis = channel_axes([exemplar_of(image, "roughness")])
    broken = image.clone()
    broken[3, 5, 6] = 1 - image[3, 5, 6]
    before, after = (whiten(i, mean, basis)[:, 5, 6].norm() for i in (image, broken))
    step = (image[3, 5, 6] - broken[3, 5, 6]).abs() / image[3].std()
    assert after - before > 2 * step


def test_constant_maps_have_finite_axes_and_stay_constant() -> None:
    image = torch.cat([torch.rand(3, 30, 30), torch.full((1, 30, 30), 0.7)])
    mean, basis = channel_axes([exemplar_of(image, "metalness")])
    y = whiten(image, mean, basis)
    assert y.isfinite().all() and y.abs().max() < 10
    channels = mean[:, None] + basis @ torch.randn(4, 1000)
    assert (channels[3] - 0.7).abs().max() < 0.003


@pytest.mark.parametrize("method", ["lattice", "sampler"])
def test_a_model_of_five_channels(method: str, files: Path) -> None:
    assert cli_train.main(arguments(files, "--method", method, "--steps", "3")) == 0
    result = files / "r"
    config = json.loads((result / "config.json").read_text())
    assert config["channels"] == [*COLOR, "roughness", "height"]
    record = config["exemplars"][0]["maps"]["height"]
    assert record["file"] == "height.png" and len(record["sha256"]) == 64
    with Image.open(result / "preview.png") as sheet:  # color, roughness, height
        assert sheet.size == (5 * SIZE + 4 * 4, 3 * SIZE + 2 * 4)
    again = load_exemplar(result / "exemplar-0.exr", 100, SIZE)
    original = load(files)
    assert set(again.channels) == set(original.channels)
    order = [again.channels.index(name) for name in original.channels]
    assert (again.image[order] - original.image).abs().max() < 1e-5
    assert cli_train.main(arguments(files, "--method", method, "--steps", "3")) == 0  # resumes


@pytest.mark.parametrize("method", ["lattice", "sampler"])
def test_export_names_the_channels_in_order(method: str, files: Path) -> None:
    assert cli_train.main(arguments(files, "--method", method, "--steps", "1")) == 0
    model = files / "model.solidtex"
    assert cli_export.main([str(files / "r"), "-o", str(model)]) == 0  # compares with the engine
    document = read(model).document
    assert document["channels"] == [*COLOR, "roughness", "height"]
    assert document["color_space"] == "srgb"
    maps = document["training"]["exemplars"][0]["maps"]
    assert maps["roughness"]["file"] == "roughness.png"


def test_one_exr_gives_all_channels(files: Path) -> None:
    values = np.random.default_rng(1).random((*SHAPE, 5)).astype(np.float32)
    write_exr(files / "all.exr", ["R", "G", "B", "height", "wear"], values)
    exemplar = load_exemplar(files / "all.exr", 100, SIZE)
    assert exemplar.channels == (*COLOR, "height", "wear") and exemplar.color_space == "srgb"
    planes = exemplar.image.numpy().transpose(1, 2, 0)
    assert np.abs(srgb_decode(planes[:, :, :3]) - values[:, :, :3]).max() < 1e-6
    assert np.array_equal(planes[:, :, 3:], values[:, :, 3:])
    linear = load_exemplar(files / "all.exr", 100, SIZE, color_space="linear")
    assert np.array_equal(linear.image.numpy().transpose(1, 2, 0), values)
    assert linear.color_space == "linear"


def test_a_gray_exr_with_a_map(files: Path) -> None:
    values = np.random.default_rng(1).random((*SHAPE, 2)).astype(np.float32)
    write_exr(files / "gray.exr", ["Y", "wear"], values)
    exemplar = load_exemplar(files / "gray.exr", 100, SIZE, color_space="linear")
    assert set(exemplar.channels) == {*COLOR, "wear"} and exemplar.color_space == "linear"
    for channel in COLOR:
        plane = exemplar.image[exemplar.channels.index(channel)].numpy()
        assert np.array_equal(plane, values[:, :, 0])


def test_colors_of_8_bits_become_linear_on_request(files: Path) -> None:
    encoded, linear = load(files), load(files, color_space="linear")
    assert np.abs(srgb_encode(linear.image[:3].numpy()) - encoded.image[:3].numpy()).max() < 1e-6
    assert torch.equal(linear.image[3:], encoded.image[3:])  # maps are data in any case


def test_an_exemplar_without_color(files: Path) -> None:
    values = np.random.default_rng(1).random((*SHAPE, 1)).astype(np.float32)
    write_exr(files / "height.exr", ["height"], values)
    exemplar = load_exemplar(files / "height.exr", 100, SIZE)
    assert exemplar.channels == ("height",) and exemplar.color_space == "data"
    photo = [str(files / "height.exr"), "--size", str(SIZE), "--steps", "1", "--device", "cpu"]
    assert cli_train.main([*photo, "-o", str(files / "r")]) == 0
    assert cli_export.main([str(files / "r"), "-o", str(files / "h.solidtex")]) == 0
    document = read(files / "h.solidtex").document
    assert document["channels"] == ["height"] and document["color_space"] == "data"


def test_maps_of_color_stored_gray_and_in_color(files: Path) -> None:
    Image.open(files / "roughness.png").convert("RGB").save(files / "gray.jpg", quality=95)
    maps = {"gloss": files / "gray.jpg", "glow": files / "albedo.png"}
    exemplar = load_exemplar(files / "albedo.png", 100, SIZE, maps=maps)
    assert exemplar.channels == (*COLOR, "gloss", "glow.r", "glow.g", "glow.b")
    assert torch.equal(exemplar.image[4:], exemplar.image[:3])
    assert [g.name for g in groups(exemplar.channels)] == ["albedo", "gloss", "glow"]


def test_gray_photographs_are_colors_of_equal_parts(files: Path) -> None:
    exemplar = load_exemplar(files / "roughness.png", 100, SIZE)
    assert exemplar.channels == COLOR
    assert torch.equal(exemplar.image[0], exemplar.image[2])
    mean, basis = channel_axes([exemplar])
    assert whiten(exemplar.image, mean, basis).abs().max() < 10


def test_two_photographs_with_maps_of_their_own(
    files: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    photos = [str(files / "albedo.png")] * 2
    common = ["--size", str(SIZE), "--steps", "1", "--device", "cpu", "-o", str(files / "r")]
    maps = [f"--map=wear={files / name}.png" for name in ("roughness", "height")]
    assert cli_train.main([*photos, *maps, *common]) == 0
    records = json.loads((files / "r" / "config.json").read_text())["exemplars"]
    assert [r["maps"]["wear"]["file"] for r in records] == ["roughness.png", "height.png"]
    with pytest.raises(SystemExit):
        cli_train.main([*photos, maps[0], *common])
    assert "--map: found 1 files for wear, expected 2, one for each" in capsys.readouterr().err
    values = np.random.default_rng(2).random((*SHAPE, 4)).astype(np.float32)
    write_exr(files / "b.exr", ["R", "G", "B", "wear"], values)
    other = [str(files / "albedo.png"), str(files / "b.exr"), *common[:-1], str(files / "r2")]
    assert cli_train.main(other) == 1
    error = capsys.readouterr().err
    assert "b.exr: found the channels albedo.r, albedo.g, albedo.b, wear, expected" in error


@pytest.mark.parametrize(
    ("option", "message"),
    [
        ("roughness", "found roughness, expected NAME=FILE"),
        ("a b=x.png", "found the name 'a b', expected letters, digits, _, . and -"),
        ("albedo.r=x.png", "found albedo.r, expected another name"),
    ],
)
def test_map_options_that_cannot_work(
    option: str, message: str, files: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as exit:
        cli_train.main(arguments(files, "--map", option))
    assert exit.value.code == 2 and message in capsys.readouterr().err


def test_maps_that_do_not_fit_are_refused(files: Path) -> None:
    Image.new("L", (52, 61)).save(files / "tall.png")
    write_exr(files / "two.exr", ["wear", "x"], np.zeros((*SHAPE, 2), np.float32))
    write_exr(files / "part.exr", ["R", "G"], np.zeros((*SHAPE, 2), np.float32))
    values = np.random.default_rng(2).random((*SHAPE, 4)).astype(np.float32)
    write_exr(files / "wear.exr", ["R", "G", "B", "wear"], values)
    write_exr(files / "twice.exr", ["R", "G", "B", "Y"], np.zeros((*SHAPE, 4), np.float32))
    write_exr(files / "chroma.exr", ["BY", "RY", "Y"], np.zeros((*SHAPE, 3), np.float32))
    cases = [
        ("twice.exr", {}, "found the channels R, G, B, Y, of which two are albedo.r, expected one"),
        ("chroma.exr", {}, "luminance and chroma"),
        ("albedo.png", {"wear": "tall.png"}, "tall.png: found 52 x 61 pixels, expected 52 x 60"),
        ("albedo.png", {"wear": "two.exr"}, "two.exr: found the channels wear, x, expected one"),
        ("albedo.png", {"normal": "roughness.png"}, "found the channel normal, expected none"),
        ("part.exr", {}, "part.exr: found the channels R, G, expected also albedo.b"),
        ("wear.exr", {"wear": "height.png"}, "height.png: found a second channel wear"),
    ]
    for photo, names, message in cases:
        maps = {name: files / file for name, file in names.items()}
        with pytest.raises(ExemplarError, match=message):
            load_exemplar(files / photo, 100, SIZE, maps=maps)
