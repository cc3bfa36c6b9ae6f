"""Odd images: each is understood at its full depth, or refused in a sentence."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest
from PIL import Image, ImageOps

from solidtex_export.images import file_kinds
from solidtex_export.images.file_kinds import ExemplarError
from solidtex_export.images.photographs import read_picture, write_exr

SHAPE = (12, 10)  # rows, columns
random = np.random.default_rng(4)
COLORS = random.integers(0, 256, (*SHAPE, 3)).astype(np.uint8)
GRAY = COLORS[:, :, 0]
DEEP = random.integers(0, 65536, (*SHAPE, 3)).astype(np.uint16)


def write_deep(path: Path, values: np.ndarray) -> None:
    """16 bits a channel, which Pillow cannot write in color."""
    spec = oiio.ImageSpec(values.shape[1], values.shape[0], values.shape[2], oiio.UINT16)
    file = oiio.ImageOutput.create(str(path))
    assert file.open(str(path), spec) and file.write_image(values) and file.close()


def read_colors(path: Path) -> np.ndarray:
    picture = read_picture(path)
    assert picture.names == ("R", "G", "B") and picture.values.dtype == np.float32
    assert not picture.is_float and picture.size == (SHAPE[1], SHAPE[0])
    return picture.values


@pytest.mark.parametrize("suffix", ["png", "tif", "bmp", "webp"])
def test_colors_of_8_bits(suffix: str, tmp_path: Path) -> None:
    path = tmp_path / f"a.{suffix}"
    Image.fromarray(COLORS).save(path, **({"lossless": True} if suffix == "webp" else {}))
    assert np.abs(read_colors(path) - COLORS / np.float32(255)).max() < 1e-6


@pytest.mark.parametrize("suffix", ["png", "tif"])
def test_colors_of_16_bits_keep_them(suffix: str, tmp_path: Path) -> None:
    path = tmp_path / f"a.{suffix}"
    write_deep(path, DEEP)
    assert np.abs(read_colors(path) - DEEP / np.float32(65535)).max() < 1e-7


def test_gray_of_8_16_and_32_bits(tmp_path: Path) -> None:
    floats = random.normal(size=SHAPE).astype(np.float32)
    for values, scale in ((GRAY, 255), (DEEP[:, :, 0], 65535), (floats, 1)):
        Image.fromarray(values).save(tmp_path / "a.tif")
        picture = read_picture(tmp_path / "a.tif")
        assert picture.names == ("Y",) and picture.is_float == (scale == 1)
        assert np.abs(picture.values[:, :, 0] - values / np.float32(scale)).max() < 1e-6


def test_palettes_and_bits_are_expanded(tmp_path: Path) -> None:
    palette = Image.fromarray(COLORS).convert("P", palette=Image.Palette.ADAPTIVE)
    palette.save(tmp_path / "palette.png")
    expected = np.asarray(palette.convert("RGB")) / np.float32(255)
    assert np.abs(read_colors(tmp_path / "palette.png") - expected).max() < 1e-6
    Image.fromarray(GRAY > 127).save(tmp_path / "bits.png")
    assert np.array_equal(read_picture(tmp_path / "bits.png").values[:, :, 0], GRAY > 127)


def test_opaque_alpha_is_dropped(tmp_path: Path) -> None:
    Image.fromarray(COLORS).convert("RGBA").save(tmp_path / "a.png")
    assert np.abs(read_colors(tmp_path / "a.png") - COLORS / np.float32(255)).max() < 1e-6
    Image.fromarray(GRAY).convert("LA").save(tmp_path / "gray.png")
    assert read_picture(tmp_path / "gray.png").names == ("Y",)


@pytest.mark.parametrize("orientation", range(1, 9))
def test_images_are_upright(orientation: int, tmp_path: Path) -> None:
    exif = Image.Exif()
    exif[0x112] = orientation
    Image.fromarray(COLORS).save(tmp_path / "a.jpg", exif=exif, quality=100, subsampling=0)
    with Image.open(tmp_path / "a.jpg") as opened:
        expected = np.asarray(ImageOps.exif_transpose(opened)) / np.float32(255)
    assert np.abs(read_picture(tmp_path / "a.jpg").values - expected).max() < 2.5 / 255


def test_exr_keeps_names_and_values(tmp_path: Path) -> None:
    values = random.normal(size=(*SHAPE, 5)).astype(np.float32)
    write_exr(tmp_path / "a.exr", ["R", "G", "B", "height", "rust.amount"], values)
    picture = read_picture(tmp_path / "a.exr")
    assert picture.names == ("R", "G", "B", "height", "rust.amount") and picture.is_float
    assert np.array_equal(picture.values, values)


def empty(path: Path) -> None:
    path.write_bytes(b"")


def text(path: Path) -> None:
    path.write_text("not an image")


def lfs_pointer(path: Path) -> None:
    path.write_text("version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 3\n")


def web_page(path: Path) -> None:
    path.write_text("\n<!DOCTYPE html><html></html>")


def folder(path: Path) -> None:
    path.mkdir()


def half_a_jpeg(path: Path) -> None:
    Image.fromarray(np.tile(COLORS, (9, 9, 1))).save(path, "jpeg")
    path.write_bytes(path.read_bytes()[:2000])


def half_a_png(path: Path) -> None:
    Image.fromarray(COLORS).save(path, "png")
    path.write_bytes(path.read_bytes()[:200])


def flipped_byte(path: Path) -> None:
    Image.fromarray(COLORS).save(path, "png")
    data = bytearray(path.read_bytes())
    data[150] ^= 255
    path.write_bytes(data)


def half_an_exr(path: Path) -> None:
    write_exr(path.with_suffix(".exr"), ["Y"], np.ones((64, 64, 1), np.float32) / 3)
    path.write_bytes(path.with_suffix(".exr").read_bytes()[:-20])


def see_through(path: Path) -> None:
    picture = Image.fromarray(COLORS).convert("RGBA")
    picture.putpixel((3, 4), (1, 2, 3, 254))
    picture.save(path, "png")


def inks(path: Path) -> None:
    Image.fromarray(COLORS).convert("CMYK").save(path, "jpeg")


def inks_tiff(path: Path) -> None:
    Image.fromarray(COLORS).convert("CMYK").save(path, "tiff")


def film(path: Path, kind: str = "gif") -> None:
    frames = [Image.fromarray(np.roll(COLORS, i, axis=0)) for i in range(3)]
    frames[0].save(path, kind, save_all=True, append_images=frames[1:])


def film_webp(path: Path) -> None:
    film(path, "webp")


def pages(path: Path) -> None:
    film(path, "tiff")


def nan(path: Path) -> None:
    values = np.ones((*SHAPE, 3), np.float32)
    values[4, 7, 1] = np.nan
    write_exr(path.with_suffix(".exr"), ["R", "G", "B"], values)
    path.with_suffix(".exr").rename(path)


def bomb(path: Path) -> None:
    """A kilobyte that claims to be 30 000 x 30 000 colors."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        body = kind + data
        return struct.pack(">I", len(data)) + body + struct.pack(">I", zlib.crc32(body))

    side = 30000
    header = struct.pack(">IIBBBBB", side, side, 8, 2, 0, 0, 0)
    pixels = zlib.compress(bytes((1 + 3 * side) * 100), 9)
    end = chunk(b"IDAT", pixels) + chunk(b"IEND", b"")
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + end)


@pytest.mark.parametrize(
    ("make", "found"),
    [
        (empty, "found an empty file, expected an image"),
        (text, "found no readable image (it begins like none of png, jpeg"),
        (folder, "found a folder, expected an image"),
        (
            lfs_pointer,
            "found a Git LFS pointer, expected an image (PNG, JPEG, TIFF, EXR ...): run",
        ),
        (web_page, "found an HTML page, expected an image"),
        (half_a_jpeg, "found a damaged or unfinished image"),
        (half_a_png, "found a damaged or unfinished image"),
        (flipped_byte, "found a damaged or unfinished image"),
        (half_an_exr, "found a damaged or unfinished image"),
        (
            see_through,
            "found pixels that are not opaque (0.833 % of them), expected an opaque",
        ),
        (inks, "found CMYK inks, whose colors depend on a printer, expected RGB"),
        (inks_tiff, "found CMYK inks"),
        (
            film,
            "found several images (frames, pages or parts), expected a file with one",
        ),
        (film_webp, "found several images"),
        (pages, "found several images"),
        (nan, "found nan at column 7, row 4 of channel G, expected finite values"),
        (bomb, "found no readable image"),
    ],
    ids=lambda value: getattr(value, "__name__", ""),
)
def test_refusals_name_file_found_and_expected(
    make: Callable[[Path], None], found: str, tmp_path: Path
) -> None:
    path = tmp_path / "odd image"
    make(path)
    with pytest.raises(ExemplarError) as error:
        read_picture(path)
    message = str(error.value)
    assert message.startswith(f"{path}: {found}") and ", expected " in message
    assert "\n" not in message


def test_names_that_are_no_text_are_refused(tmp_path: Path) -> None:
    # An attribute without a type, whose name OpenEXR quotes.
    path = tmp_path / "a.exr"
    path.write_bytes(b"\x76\x2f\x31\x01\x02\0\0\0\xfe\0\0" + bytes(60))
    with pytest.raises(ExemplarError, match=r"a[.]exr: found names that are no text"):
        read_picture(path)


def test_huge_images_are_refused_before_they_take_memory(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    Image.fromarray(COLORS).save(tmp_path / "a.png")
    monkeypatch.setattr(file_kinds, "MAX_VALUES", COLORS.size - 1)
    with pytest.raises(ExemplarError, match="found 10 x 12 pixels of 3 channels, expected at most"):
        read_picture(tmp_path / "a.png")
    monkeypatch.setattr(file_kinds, "MAX_VALUES", COLORS.size)
    read_picture(tmp_path / "a.png")
