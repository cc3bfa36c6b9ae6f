"""Numbers of an image to values of 0 to 1: ranges, labels, floats, and what is refused.

Every image shows the same tones, stored in another way.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from picture_files import LABELS, TONES, UNIT, color, gray, load, refusal, write, write_tiff
from PIL import Image

from solidtex_export.commands import train as cli_train
from solidtex_export.images.channels import Reading
from solidtex_export.images.exemplar import load_exemplar
from solidtex_export.images.file_kinds import ExemplarError
from solidtex_export.images.srgb import srgb_decode, srgb_encode
from solidtex_export.images.value_range import Range, parse_range

# --- whole numbers that use a part of their range


@pytest.mark.parametrize(
    ("dtype", "bits", "what"),
    [
        (np.uint16, 15, "learned as they are: dark"),
        (np.uint16, 14, "nearly black"),
        (np.uint16, 12, "nearly black"),
        (np.uint16, 10, "nearly black"),
        (np.uint16, 8, "all black"),
        (np.int16, 14, "learned as they are: dark"),
        (np.int16, 12, "nearly black"),
        (np.uint32, 16, "all black"),
        (np.int32, 12, "all black"),
        (np.uint8, 6, "learned as they are: dark"),
        (np.uint8, 4, "nearly black"),
    ],
)
def test_fewer_bits_than_the_type(dtype: type, bits: int, what: str, tmp_path: Path) -> None:
    white = 2**bits - 1
    values = np.rint(UNIT.astype(np.float64) * white).astype(dtype)
    values[0, 0], values[0, 1] = 0, white
    path = write_tiff(tmp_path / "a.TIF", values)
    scale = np.float32(1 / np.iinfo(dtype).max)
    if what.endswith("black"):
        message = refusal(path)
        assert f"found values 0 ... {white} of 0 ... {np.iinfo(dtype).max}" in message
        assert "--range full keeps them" in message or what == "all black"
    else:
        exemplar = load(path)
        (message,) = exemplar.notes
        assert message.startswith(f"{path}: warning: found values 0 ... {white} of 0 ...")
        assert (gray(exemplar) == values.astype(np.float32) * scale).all()
    assert what in message
    assert f"--range auto (0,{white})" in message
    for asked in ("auto", (0.0, float(white))):
        exemplar = load(path, asked)
        assert np.abs(gray(exemplar) - values / white).max() < 1e-6
        assert exemplar.notes == (
            f"{path}: scales 0 ... {white} to 0 ... 1 (found values 0 ... {white})",
        )
    exemplar = load(path, "full")
    assert exemplar.notes == ()
    assert (gray(exemplar) == values.astype(np.float32) * scale).all()


def test_a_dark_image_of_the_whole_depth_is_learned_with_a_warning(tmp_path: Path) -> None:
    path = write_tiff(tmp_path / "a.tif", TONES.astype(np.uint16) * 53)  # to 21 % of the range
    assert "learned as they are: dark; --range LOW,HIGH or" in load(path).notes[0]


def test_fewer_bits_in_a_map(tmp_path: Path) -> None:
    photo = write_tiff(tmp_path / "photo.tif", TONES)
    rough = write_tiff(tmp_path / "rough.tif", TONES.astype(np.uint16) * 16)
    maps = {"roughness": rough}
    with pytest.raises(ExemplarError, match=r"nearly black, expected tones; --range roughness=LOW"):
        load_exemplar(photo, 1000, 8, maps=maps)
    reading = Reading({"roughness": (0.0, 4080.0)})
    exemplar = load_exemplar(photo, 1000, 8, maps=maps, reading=reading)
    assert np.abs(exemplar.image[3].numpy() - UNIT).max() < 1e-6


def test_the_whole_range_gives_no_note(tmp_path: Path) -> None:
    for values in (
        TONES,
        TONES.astype(np.uint16) * 257,
        TONES.astype(np.uint32) * 16843009,
    ):
        exemplar = load(write_tiff(tmp_path / "a.tif", values))
        assert np.abs(gray(exemplar) - UNIT).max() < 1e-6 and exemplar.notes == ()


@pytest.mark.parametrize("dtype", [np.int16, np.int32])
def test_signed_values_below_0(dtype: type, tmp_path: Path) -> None:
    path = write_tiff(tmp_path / "a.tif", TONES.astype(dtype) * 8 - 1000)
    message = refusal(path)
    low, high = int(TONES.min()) * 8 - 1000, int(TONES.max()) * 8 - 1000
    assert f"found values {low} ... {high}, some below 0" in message
    assert f"--range auto ({low},{high})" in message
    assert np.abs(gray(load(path, (-1000.0, 1040.0))) - UNIT).max() < 1e-6


def test_values_outside_the_range_are_clipped_and_counted(tmp_path: Path) -> None:
    path = write_tiff(tmp_path / "a.tif", TONES)
    exemplar = load(path, (100.0, 200.0))
    assert np.abs(gray(exemplar) - np.clip((TONES - 100.0) / 100, 0, 1)).max() < 1e-6
    share = 100 * ((TONES < 100) | (TONES > 200)).mean()
    assert f"{share:.2g} % lie outside and are clipped" in exemplar.notes[0]


# --- white is zero


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.uint32, np.float32, np.float64])
def test_white_is_zero_at_any_depth(dtype: type, tmp_path: Path) -> None:
    white = 1 if np.dtype(dtype).kind == "f" else np.iinfo(dtype).max
    values = (white - np.rint(UNIT.astype(np.float64) * white)).astype(dtype)
    if white == 1:
        values = (1 - UNIT).astype(dtype)
    exemplar = load(write_tiff(tmp_path / "a.tif", values, photometric="miniswhite"))
    found = gray(exemplar) if white != 1 else srgb_decode(gray(exemplar))
    assert np.abs(found - UNIT).max() < 1e-5
    assert "white is zero in this file: inverted" in exemplar.notes[0]


def test_white_is_zero_of_12_bits(tmp_path: Path) -> None:
    values = np.rint((1 - UNIT.astype(np.float64)) * 4095).astype(np.uint16)
    path = write_tiff(tmp_path / "a.tif", values, photometric="miniswhite")
    assert "(12 bits), nearly white" in refusal(path)
    assert np.abs(gray(load(path, "auto")) - UNIT).max() < 1 / 4095


@pytest.mark.parametrize("photometric", ["minisblack", "miniswhite"])
def test_one_bit(photometric: str, tmp_path: Path) -> None:
    bits = TONES > 128
    path = write_tiff(tmp_path / "a.tif", bits, photometric=photometric)
    exemplar = load(path)
    assert (gray(exemplar) == (bits != (photometric == "miniswhite"))).all()
    assert (
        "found only the 2 labels 0, 255 of 0 ... 255, learned as these tones"
        in (exemplar.notes[-1])
    )


# --- labels


@pytest.mark.parametrize("values", [(0, 1), (0, 1, 2), (1, 2, 3), (3, 17, 40)])
@pytest.mark.parametrize("suffix", ["tif", "png"])
def test_labels_are_recognized(values: tuple[int, ...], suffix: str, tmp_path: Path) -> None:
    labels = np.array(values, np.uint8)[LABELS % len(values)]
    path = tmp_path / f"a.{suffix}"
    Image.fromarray(labels).save(path)
    listed = ", ".join(map(str, values))
    message = refusal(path)
    assert f"found {len(values)} labels {listed} of 0 ... 255, not tones" in message
    assert "--range labels learns them as evenly spaced grays" in message
    exemplar = load(path, "labels")
    assert np.allclose(gray(exemplar), (LABELS % len(values)) / (len(values) - 1))
    assert f"learns the {len(values)} labels {listed} as evenly spaced grays" in exemplar.notes[0]
    assert np.allclose(gray(load(path, "full")), labels / 255)


def test_labels_that_could_be_tones_are_learned_with_a_warning(tmp_path: Path) -> None:
    path = write_tiff(tmp_path / "a.tif", np.array([10, 90, 250], np.uint8)[LABELS])
    exemplar = load(path)
    assert "found only the 3 labels 10, 90, 250" in exemplar.notes[0]
    assert np.allclose(gray(exemplar), np.array([10, 90, 250])[LABELS] / 255)
    assert np.allclose(gray(load(path, "labels")), LABELS / 2)


def test_labels_in_color_are_learned_with_a_warning(tmp_path: Path) -> None:
    path = tmp_path / "a.png"
    image = Image.fromarray(LABELS.astype(np.uint8)).convert("P")
    image.putpalette([255, 0, 0, 0, 255, 0, 0, 0, 255] + 759 * [0])
    image.save(path)
    exemplar = load(path)
    assert "found only 3 colors, learned as these colors" in exemplar.notes[0]
    assert "save the labels as gray values and use --range labels" in exemplar.notes[0]


def test_float_labels(tmp_path: Path) -> None:
    path = write_tiff(tmp_path / "a.tif", (LABELS > 0).astype(np.float32))
    exemplar = load(path)
    assert np.abs(gray(exemplar) - (LABELS > 0)).max() < 1e-6
    assert "found only the 2 labels 0, 1" in exemplar.notes[0]
    path = write_tiff(tmp_path / "b.tif", LABELS.astype(np.float64))
    assert "found 3 labels 0, 1, 2 of 0 ... 1, not tones" in refusal(path)
    assert np.allclose(gray(load(path, "labels")), LABELS / 2)


def test_many_values_and_colors_are_no_labels(tmp_path: Path) -> None:
    path = write_tiff(tmp_path / "a.tif", TONES)
    assert "expected labels: 2 to 64 values of one channel" in refusal(path, "labels")


def test_labels_in_a_map(tmp_path: Path) -> None:
    photo = write_tiff(tmp_path / "photo.tif", TONES)
    mask = write_tiff(tmp_path / "mask.tif", (LABELS > 0).astype(np.uint8))
    with pytest.raises(
        ExemplarError, match=r"mask.tif: found 2 labels .* --range metalness=labels"
    ):
        load_exemplar(photo, 1000, 8, maps={"metalness": mask})
    reading = Reading({"metalness": "labels"})
    exemplar = load_exemplar(photo, 1000, 8, maps={"metalness": mask}, reading=reading)
    assert (exemplar.image[3].numpy() == (LABELS > 0)).all()
    with pytest.raises(ExemplarError, match="--range: found a range for gloss, expected one of"):
        load_exemplar(photo, 1000, 8, reading=Reading({"gloss": "auto"}))


# --- floats


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_floats_of_0_to_255(dtype: type, tmp_path: Path) -> None:
    path = write_tiff(tmp_path / "a.tif", TONES.astype(dtype))
    message = refusal(path)
    assert f"found float values {TONES.min()} ... {TONES.max()}" in message
    assert "--range auto (0,255)" in message
    exemplar = load(path, "auto")
    assert np.abs(gray(exemplar) - UNIT).max() < 1e-6
    assert "scales 0 ... 255 to 0 ... 1" in exemplar.notes[0]
    assert exemplar.notes[0].endswith("taken as sRGB")


@pytest.mark.parametrize("dtype", [np.float16, np.float32, np.float64])
def test_floats_of_0_to_1_are_linear(dtype: type, tmp_path: Path) -> None:
    exemplar = load(write_tiff(tmp_path / "a.tif", srgb_decode(UNIT).astype(dtype)))
    assert np.abs(gray(exemplar) - UNIT).max() < 1e-3 and exemplar.notes == ()


def test_floats_below_0(tmp_path: Path) -> None:
    values = 4 * UNIT - 2
    path = write_tiff(tmp_path / "a.tif", values)
    assert "found float values" in refusal(path)
    assert np.abs(gray(load(path, (-2.0, 2.0))) - UNIT).max() < 1e-6


def test_highlights_of_an_exr_are_kept_and_noted(tmp_path: Path) -> None:
    values = color()
    values[:3] *= 8
    exemplar = load(write(tmp_path / "a.exr", values, ["R", "G", "B"]))
    assert "some outside of 0 ... 1: kept as they are" in exemplar.notes[0]
    assert np.abs(exemplar.image[0].numpy() - srgb_encode(values[:, :, 0])).max() < 2e-3


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_values_that_are_not_finite(value: float, tmp_path: Path) -> None:
    values = UNIT.copy()
    values[4, 7] = value
    assert "at column 7, row 4" in refusal(write_tiff(tmp_path / "a.tif", values))


def test_images_without_structure_or_width(tmp_path: Path) -> None:
    flat = write_tiff(tmp_path / "flat.tif", np.full_like(TONES, 99))
    assert "found the same color everywhere" in refusal(flat)
    thin = write_tiff(tmp_path / "thin.tif", TONES[:, :1])
    assert "found 1 x 24 pixels, expected at least 8 x 8" in refusal(thin)


# --- the command line


@pytest.mark.parametrize(
    ("text", "value"),
    [("0,4095", (0.0, 4095.0)), ("-1000,1e3", (-1000.0, 1000.0)), ("auto", "auto")],
)
def test_ranges_are_parsed(text: str, value: Range) -> None:
    assert parse_range(text) == value
    record = Reading({"": value}, "beauty").record()
    assert Reading.of_record(record) == Reading({"": value}, "beauty")


@pytest.mark.parametrize("text", ["", "4095", "5,5", "9,1", "nan,1", "0,inf", "0,1,2", "most"])
def test_ranges_that_cannot_work(text: str) -> None:
    with pytest.raises(ExemplarError, match="expected LOW,HIGH"):
        parse_range(text)


def test_training_prints_what_was_read_and_saves_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    values = np.random.default_rng(1).integers(0, 4096, (60, 60)).astype(np.uint16)
    path = write_tiff(tmp_path / "a.tif", values)
    common = [str(path), "--method=lattice", "--size=44", "--steps=1", "--device=cpu"]
    assert cli_train.main([*common, "--range=auto", "-o", str(tmp_path / "r")]) == 0
    assert f"{path}: scales 0 ... 4095 to 0 ... 1" in capsys.readouterr().err
    assert '"ranges": {' in (tmp_path / "r" / "config.json").read_text()
    assert cli_train.main([*common, "-o", str(tmp_path / "r")]) == 1  # another training
