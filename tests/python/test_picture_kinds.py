"""Images as people have them: each gives the right values, or a refusal that says what to do.

Every image shows the same tones, stored in another way.
"""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest
import tifffile
from picture_files import SIDE, TONES, UNIT, color, gray, load, refusal, write, write_tiff
from PIL import Image, ImageCms

from solidtex_export.images.exemplar import load_exemplar
from solidtex_export.images.file_kinds import ExemplarError
from solidtex_export.images.srgb import srgb_encode

# --- layers, parts and windows of EXR files


@pytest.mark.parametrize("names", ["Beauty.{R,G,B}", "a.b.{r,g,b}", "beauty.{red,green,blue}"])
def test_the_only_layer_with_color_is_the_albedo(names: str, tmp_path: Path) -> None:
    layer, _, letters = names.rpartition(".")
    channels = [f"{layer}.{letter}" for letter in letters[1:-1].split(",")]
    planes = np.concatenate([color(), color(UNIT[::-1], 2)], axis=2)
    path = write(tmp_path / "a.EXR", planes, [*channels, "depth.Z", "normal.X"])
    exemplar = load(path)
    assert exemplar.channels == ("albedo.r", "albedo.g", "albedo.b")
    assert np.abs(gray(exemplar) - UNIT).max() < 2e-3
    assert f"takes {', '.join(channels)} as the albedo, ignores " in exemplar.notes[0]
    assert "depth.Z" in exemplar.notes[0]


def test_several_layers_need_a_choice(tmp_path: Path) -> None:
    planes = np.concatenate([color(), color(UNIT[::-1])], axis=2)
    names = [f"{layer}.{c}" for layer in ("diffuse", "gloss") for c in "RGB"]
    path = write(tmp_path / "a.exr", planes, names)
    message = refusal(path)
    assert (
        "several layers with color: diffuse, gloss, expected one; choose it by --layer" in message
    )
    assert np.abs(gray(load(path, layer="gloss")) - UNIT[::-1]).max() < 2e-3
    assert "expected a layer with color: diffuse, gloss" in refusal(path, layer="emission")


def test_the_part_with_color_is_read(tmp_path: Path) -> None:
    def parts(*planes: tuple[str, list[str], np.ndarray]) -> Path:
        path = tmp_path / "a.exr"
        specs = []
        for name, names, _ in planes:
            specs.append(oiio.ImageSpec(SIDE, SIDE, len(names), oiio.HALF))
            specs[-1].channelnames = tuple(names)
            specs[-1].attribute("oiio:subimagename", name)
        file = oiio.ImageOutput.create(str(path))
        assert file.open(str(path), specs)
        for i, (_, _, values) in enumerate(planes):
            assert i == 0 or file.open(str(path), specs[i], "AppendSubimage")
            assert file.write_image(np.ascontiguousarray(values, np.float32))
        file.close()
        return path

    depth = ("depth", ["Z"], color(count=1))
    beauty = ("beauty", ["R", "G", "B"], color())
    exemplar = load(parts(depth, beauty))
    assert np.abs(gray(exemplar) - UNIT).max() < 2e-3
    assert "reads the part beauty (R, G, B), 1 of 2" in exemplar.notes[0]
    path = parts(beauty, ("gloss", ["R", "G", "B"], color(UNIT[::-1])))
    assert "found the parts beauty (R, G, B); gloss (R, G, B), expected one" in refusal(path)
    assert np.abs(gray(load(path, layer="gloss")) - UNIT[::-1]).max() < 2e-3
    assert "found the parts" in refusal(parts(depth, ("ao", ["Z"], color(count=1))))


def test_depth_is_no_property_of_a_solid(tmp_path: Path) -> None:
    path = write(tmp_path / "a.exr", color(count=1), ["Z"])
    assert "found only the channel Z (distance from the camera)" in refusal(path)
    exemplar = load(write(tmp_path / "b.exr", color(count=4), ["R", "G", "B", "Z"]))
    assert exemplar.channels == ("albedo.r", "albedo.g", "albedo.b")
    assert "ignores Z: distance from the camera" in exemplar.notes[0]


def test_an_exr_of_properties_alone_has_no_albedo(tmp_path: Path) -> None:
    exemplar = load(write(tmp_path / "a.exr", color(count=1), ["height"]))
    assert exemplar.channels == ("height",)
    assert "the model will have no albedo" in exemplar.notes[0]


def test_luminance_alone_is_gray_and_with_chroma_is_refused(tmp_path: Path) -> None:
    exemplar = load(write(tmp_path / "a.exr", color(count=1), ["Y"]))
    assert np.abs(gray(exemplar) - UNIT).max() < 2e-3
    path = write(tmp_path / "b.exr", color(), ["BY", "RY", "Y"])
    assert "luminance and chroma" in refusal(path)


def test_data_windows(tmp_path: Path) -> None:
    larger = {"x": -4, "y": -3, "full_width": 12, "full_height": 16}
    path = write(tmp_path / "a.exr", color(), ["R", "G", "B"], **larger)
    exemplar = load(path)
    assert np.abs(gray(exemplar) - UNIT[3:19, 4:16]).max() < 2e-3
    assert "reads the 12 x 16 that both have" in exemplar.notes[0]
    smaller = {"x": 5, "y": 6, "full_width": 64, "full_height": 64}
    path = write(tmp_path / "b.exr", color(), ["R", "G", "B"], **smaller)
    exemplar = load(path)
    assert np.abs(gray(exemplar) - UNIT).max() < 2e-3
    assert "the display window 64 x 64" in exemplar.notes[0]
    photo = write_tiff(tmp_path / "c.tif", TONES)
    with pytest.raises(ExemplarError, match=r"b.exr: found a data window that begins at 5, 6"):
        load_exemplar(photo, 1000, 8, maps={"wear": path})


# --- TIFF as scanners and microscopes write it


def test_tiles_planes_and_pages(tmp_path: Path) -> None:
    deep = TONES.astype(np.uint16) * 257
    path = write_tiff(tmp_path / "tiled.tif", deep, tile=(16, 16))
    assert np.abs(gray(load(path)) - UNIT).max() < 1e-6
    planes = np.stack([TONES] * 3)
    path = write_tiff(tmp_path / "p.tif", planes, photometric="rgb", planarconfig="separate")
    assert np.abs(gray(load(path)) - UNIT).max() < 1e-6
    path = write_tiff(tmp_path / "pages.tif", np.stack([TONES, TONES]))
    assert "found several images (frames, pages or parts)" in refusal(path)


def test_lab_is_refused(tmp_path: Path) -> None:
    path = write_tiff(tmp_path / "a.tif", np.stack([TONES] * 3, axis=2), photometric="cielab")
    assert "found CIE L*a*b* values, expected RGB; convert it to sRGB first" in refusal(path)


# --- raw files and others whose content is not the photograph


def raw_file(path: Path) -> Path:
    """A thumbnail, and sensor data that the reader does not see, as in DNG, NEF and ARW."""
    thumbnail = np.stack([TONES] * 3, axis=2)
    tifffile.imwrite(path, thumbnail, photometric="rgb", subfiletype=1)
    return path


@pytest.mark.parametrize("suffix", ["dng", "NEF", "arw", "CR2", "tif"])
def test_thumbnails_of_raw_files_are_refused(suffix: str, tmp_path: Path) -> None:
    message = refusal(raw_file(tmp_path / f"a.{suffix}"))
    assert "thumbnail" in message and "darktable-cli" in message


@pytest.mark.parametrize(
    ("start", "found"),
    [
        (b"FUJIFILMCCD-RAW 0201", "a camera's raw file"),
        (b"II*\0\x10\0\0\0CR\2\0", "a camera's raw file"),
        (struct.pack(">I", 24) + b"ftypheic", "a HEIC image"),
        (struct.pack(">I", 24) + b"ftypavif", "an AVIF image"),
    ],
)
def test_files_known_by_their_first_bytes(start: bytes, found: str, tmp_path: Path) -> None:
    path = tmp_path / "photo.jpg"
    path.write_bytes(start + bytes(200))
    assert f"found {found}" in refusal(path)


# --- color profiles


def profile(red: tuple[float, float], gamma: float) -> bytes:
    """An ICC profile made of sRGB's, with another gamma, and other primaries for a wide gamut."""
    data = bytearray(ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes())
    tags = struct.unpack_from(">I", data, 128)[0]
    for i in range(tags):
        name, offset, _ = struct.unpack_from(">4sII", data, 132 + 12 * i)
        if name == b"rXYZ":
            struct.pack_into(">ii", data, offset + 8, *(round(v * 65536) for v in red))
        if name in (b"rTRC", b"gTRC", b"bTRC"):
            kind = data[offset : offset + 4]
            assert kind == b"para"
            struct.pack_into(">HHi", data, offset + 8, 0, 0, round(gamma * 65536))
    return bytes(data)


def test_a_wide_gamut_is_converted_to_srgb(tmp_path: Path) -> None:
    colors = np.stack([TONES, TONES[::-1], TONES[:, ::-1]], axis=2)
    wide = profile((0.60974, 0.31111), 2.2)  # the red of Adobe RGB
    path = tmp_path / "a.png"
    Image.fromarray(colors).save(path, icc_profile=wide)
    exemplar = load(path)
    assert "converted from its ICC profile" in exemplar.notes[0]
    found = exemplar.image.permute(1, 2, 0).numpy()
    assert np.abs(found - colors / 255).max() > 0.05
    grey_path = tmp_path / "gamma.png"
    Image.fromarray(np.stack([TONES] * 3, axis=2)).save(
        grey_path, icc_profile=profile((0.43607, 0.22249), 1.0)
    )
    assert np.abs(load(grey_path).image[1].numpy() - srgb_encode(UNIT)).max() < 2 / 255
    deep = tmp_path / "deep.tif"
    tifffile.imwrite(deep, colors.astype(np.uint16) * 257, photometric="rgb", iccprofile=wide)
    assert "and more than 8 bits, expected sRGB; convert it first" in refusal(deep)


def test_profiles_of_srgb_change_nothing(tmp_path: Path) -> None:
    srgb = ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes()
    colors = np.stack([TONES, TONES[::-1], TONES[:, ::-1]], axis=2)
    for suffix in ("png", "tif"):
        Image.fromarray(colors).save(tmp_path / f"a.{suffix}", icc_profile=srgb)
        exemplar = load(tmp_path / f"a.{suffix}")
        assert exemplar.notes == ()
        assert np.abs(exemplar.image.permute(1, 2, 0).numpy() - colors / 255).max() < 1e-6


def test_a_linear_png_is_encoded(tmp_path: Path) -> None:
    spec = oiio.ImageSpec(SIDE, SIDE, 3, oiio.UINT16)
    spec.attribute("oiio:ColorSpace", "lin_rec709_scene")
    path = tmp_path / "a.png"
    file = oiio.ImageOutput.create(str(path))
    pixels = np.rint(color() * 65535).astype(np.uint16)
    assert file.open(str(path), spec) and file.write_image(pixels) and file.close()
    exemplar = load(path)
    assert "converted from lin_rec709_scene to sRGB" in exemplar.notes[0]
    assert np.abs(gray(exemplar) - UNIT).max() < 1e-3


def test_gray_with_alpha_of_16_bits(tmp_path: Path) -> None:
    spec = oiio.ImageSpec(SIDE, SIDE, 2, oiio.UINT16)
    spec.channelnames = ("Y", "A")
    spec.alpha_channel = 1
    for alpha in (65535, 65534):
        pixels = np.stack(
            [TONES.astype(np.uint16) * 257, np.full_like(TONES, 0) + np.uint16(alpha)],
            2,
        )
        path = tmp_path / f"{alpha}.png"
        file = oiio.ImageOutput.create(str(path))
        assert file.open(str(path), spec) and file.write_image(pixels) and file.close()
    assert np.abs(gray(load(tmp_path / "65535.png")) - UNIT).max() < 1e-6
    assert "not opaque (100 % of them)" in refusal(tmp_path / "65534.png")
