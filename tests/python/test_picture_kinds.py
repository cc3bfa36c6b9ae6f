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
from PIL import Image, ImageCms

from solidtex_export.commands import train as cli_train
from solidtex_export.images.channels import Reading
from solidtex_export.images.exemplar import Exemplar, load_exemplar
from solidtex_export.images.file_kinds import ExemplarError
from solidtex_export.images.srgb import srgb_decode, srgb_encode
from solidtex_export.images.value_range import Range, parse_range

SIDE = 24
TONES = np.random.default_rng(7).integers(20, 236, (SIDE, SIDE)).astype(np.uint8)
UNIT = TONES / np.float32(255)
LABELS = np.random.default_rng(8).integers(0, 3, (SIDE, SIDE)).astype(np.uint8)


def load(path: Path, asked: Range | None = None, layer: str | None = None, **more) -> Exemplar:
    ranges = {} if asked is None else {"": asked}
    return load_exemplar(path, 1000, 8, reading=Reading(ranges, layer), **more)


def gray(exemplar: Exemplar) -> np.ndarray:
    assert exemplar.channels[:3] == ("albedo.r", "albedo.g", "albedo.b")
    assert (exemplar.image[0] == exemplar.image[2]).all()
    return exemplar.image[0].numpy()


def refusal(path: Path, *args, **more) -> str:
    with pytest.raises(ExemplarError) as error:
        load(path, *args, **more)
    message = str(error.value)
    assert message.startswith(str(path)) and ": found " in message and ", expected " in message
    assert "\n" not in message
    return message


def write_tiff(path: Path, values: np.ndarray, **options: object) -> Path:
    tifffile.imwrite(path, values, **{"photometric": "minisblack", **options})
    return path


def write(path: Path, values: np.ndarray, names: list[str], **attributes: object) -> Path:
    """A float EXR; attributes of the specification go by their names."""
    spec = oiio.ImageSpec(values.shape[1], values.shape[0], len(names), oiio.HALF)
    spec.channelnames = tuple(names)
    for name, value in attributes.items():
        setattr(spec, name, value)
    file = oiio.ImageOutput.create(str(path))
    assert file.open(str(path), spec) and file.write_image(values.astype(np.float32))
    assert file.close()
    return path


def color(values: np.ndarray = UNIT, count: int = 3) -> np.ndarray:
    return np.repeat(srgb_decode(values)[:, :, None], count, axis=2)


# --- whole numbers that use a part of their range


@pytest.mark.parametrize(
    ("dtype", "bits", "is_refused"),
    [
        (np.uint16, 14, False),
        (np.uint16, 12, False),
        (np.uint16, 10, False),
        (np.uint16, 8, True),
        (np.int16, 12, False),
        (np.uint32, 16, True),
        (np.int32, 12, True),
        (np.uint8, 4, False),
    ],
)
def test_fewer_bits_than_the_type(dtype: type, bits: int, is_refused: bool, tmp_path: Path) -> None:
    white = 2**bits - 1
    values = np.rint(UNIT.astype(np.float64) * white).astype(dtype)
    values[0, 0], values[0, 1] = 0, white
    path = write_tiff(tmp_path / "a.TIF", values)
    if is_refused:
        message = refusal(path)
        assert f"found values 0 ... {white} of 0 ... {np.iinfo(dtype).max}, all black" in message
    else:
        exemplar = load(path)
        (message,) = exemplar.notes
        assert message.startswith(f"{path}: warning: found values 0 ... {white} of 0 ...")
        scale = np.float32(1 / np.iinfo(dtype).max)
        assert (gray(exemplar) == values.astype(np.float32) * scale).all()
    assert f"--range auto (0,{white})" in message
    for asked in ("auto", (0.0, float(white))):
        exemplar = load(path, asked)
        assert np.abs(gray(exemplar) - values / white).max() < 1e-6
        assert exemplar.notes == (
            f"{path}: scales 0 ... {white} to 0 ... 1 (found values 0 ... {white})",
        )
    assert load(path, "full").notes == ()


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
    assert "learned as they are: bright" in load(path).notes[1]
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
