"""Volumes of solidtex-bake, read back by the libraries their users have."""

from __future__ import annotations

import json
import math
import os
import subprocess
from pathlib import Path

import mitsuba
import nrrd
import numpy as np
import OpenImageIO as oiio
import pytest
import tifffile
from bake_box import (
    BAKE,
    CENTER,
    EDGES,
    MODEL,
    ORIGIN,
    SIZE,
    VOXEL,
    assert_same,
    bake,
    encoding,
    eval_box,
    run_bake,
    srgb_to_linear,
)
from PIL import Image


@pytest.mark.parametrize("depth", ["8", "16", "float"])
@pytest.mark.parametrize("name", ["a.nrrd", "a.nhdr"])
def test_nrrd(tmp_path: Path, name: str, depth: str) -> None:
    data, header = nrrd.read(str(bake(tmp_path / name, "--depth", depth, *VOXEL)))
    assert_same(data.T, depth)
    assert header["kinds"] == ["RGB-color", "domain", "domain", "domain"]
    assert np.array_equal(header["space directions"][1:], np.diag(EDGES))
    assert np.array_equal(header["space origin"], CENTER)
    assert header["space units"] == ["um", "um", "um"]
    assert header["solidtex_encoding_albedo"] == encoding(depth)
    assert header["solidtex_model"] == MODEL
    files = {"a.nhdr", "a.raw"} if name == "a.nhdr" else {name}
    assert set(os.listdir(tmp_path)) == files


def test_nrrd_in_simpleitk(tmp_path: Path) -> None:
    sitk = pytest.importorskip("SimpleITK")
    image = sitk.ReadImage(str(bake(tmp_path / "a.nhdr", "--depth", "16", *VOXEL)))
    assert image.GetSize() == SIZE and image.GetNumberOfComponentsPerPixel() == 3
    assert image.GetSpacing() == tuple(EDGES) and image.GetOrigin() == tuple(CENTER)
    assert_same(sitk.GetArrayFromImage(image), "16")


@pytest.mark.parametrize("depth", ["8", "16", "half", "float"])
def test_raw(tmp_path: Path, depth: str) -> None:
    types = {"8": np.uint8, "16": np.uint16, "half": np.float16, "float": np.float32}
    values = np.fromfile(bake(tmp_path / "a.raw", "--depth", depth), types[depth])
    assert_same(values.reshape(*SIZE[::-1], 3), depth)


@pytest.mark.parametrize("depth", ["8", "16", "half", "float"])
def test_npy(tmp_path: Path, depth: str) -> None:
    path = bake(tmp_path / "a.npy", "--depth", depth, "--color-space", "linear")
    found = np.load(path)
    wanted = srgb_to_linear(eval_box())
    if depth in ("8", "16"):
        maximum = 2 ** int(depth) - 1
        assert np.abs(found - wanted.clip(0, 1) * maximum).max() <= 0.51
    else:
        assert np.abs(found - wanted).max() <= (1e-3 if depth == "half" else 1e-6)


@pytest.mark.parametrize("depth", ["8", "16", "float"])
def test_vti(tmp_path: Path, depth: str) -> None:
    pyvista = pytest.importorskip("pyvista")
    grid = pyvista.read(bake(tmp_path / "a.vti", "--depth", depth, *VOXEL))
    assert grid.dimensions == SIZE
    assert grid.spacing == tuple(EDGES) and grid.origin == tuple(CENTER)
    assert_same(np.asarray(grid["albedo"]).reshape(*SIZE[::-1], 3), depth)
    assert grid.field_data["unit"][0] == "um"
    assert grid.field_data["solidtex_model"][0] == MODEL


def test_mitsuba_volume(tmp_path: Path) -> None:
    path = bake(tmp_path / "a.vol", *VOXEL)
    mitsuba.set_variant("scalar_rgb")
    grid = mitsuba.VolumeGrid(str(path))
    assert_same(np.array(grid), "float")
    volume = mitsuba.load_dict({"type": "gridvolume", "filename": str(path), "use_grid_bbox": True})
    low = np.array(ORIGIN) * EDGES
    assert np.allclose(volume.bbox().min, low)
    assert np.allclose(volume.bbox().max, low + np.array(SIZE) * EDGES)


@pytest.mark.parametrize("depth", ["8", "16", "half", "float"])
@pytest.mark.parametrize("name", ["a.tif", "a.tiff"])
def test_tiff(tmp_path: Path, name: str, depth: str) -> None:
    path = bake(tmp_path / name, "--depth", depth, *VOXEL)
    with tifffile.TiffFile(path) as file:
        assert len(file.pages) == SIZE[2] and file.pages[3].photometric == 2
        assert_same(np.stack([page.asarray() for page in file.pages]), depth)
        assert np.allclose(file.pages[0].get_resolution("micrometer"), (1, 1 / 2))
        facts = [
            "solidtex_model=granite-grey",
            "solidtex_encoding_albedo=" + encoding(depth),
        ]
        assert all(fact in file.pages[0].description for fact in facts)
        if depth == "half":
            lines = dict(line.split("=") for line in file.pages[0].description.splitlines())
            assert numbers(lines["solidtex_voxel_size"]) == list(EDGES) and lines["unit"] == "um"
            assert numbers(lines["solidtex_position"]) == list(CENTER)
            return
        assert_same(file.asarray(), depth)
        assert file.is_ome and file.series[0].axes == "ZYXS"
        pixels = tifffile.xml2dict(file.ome_metadata)["OME"]["Image"]["Pixels"]
        assert [pixels[f"PhysicalSize{axis}"] for axis in "XYZ"] == list(EDGES)
        plane = pixels["Plane"]
        assert np.allclose([plane[f"Position{axis}"] for axis in "XYZ"], CENTER)
        assert plane["PositionZUnit"] == "µm" and plane["TheZ"] == 0


@pytest.mark.parametrize("depth", ["8", "16", "float"])
def test_imagej_hyperstack(tmp_path: Path, depth: str) -> None:
    path = bake(tmp_path / "a.tif", "--format", "imagej", "--depth", depth, *VOXEL)
    with tifffile.TiffFile(path) as file:
        assert file.is_imagej and file.series[0].axes == "ZCYX"
        assert_same(file.asarray().transpose(0, 2, 3, 1), depth)
        metadata = file.imagej_metadata
        assert metadata["hyperstack"] and metadata["mode"] == "composite"
        assert metadata["unit"] == "um" and metadata["spacing"] == EDGES[2]
        assert metadata["xorigin"] == -ORIGIN[0]
        assert metadata["solidtex_encoding_albedo"] == encoding(depth)
        x = file.pages[0].tags["XResolution"].value
        assert x[0] / x[1] == 1 / EDGES[0]


@pytest.mark.parametrize(
    "edge", ["1.5e-6m", "2.25e-6m", "3.3e-6km", "7nm", "5000km", "7nm,7nm,7nm"]
)
def test_imagej_reads_the_edge_of_a_voxel(tmp_path: Path, edge: str) -> None:
    path = bake(tmp_path / "a.tif", "--format", "imagej", "--voxel-size", edge)
    with tifffile.TiffFile(path) as file:
        x, y = (file.pages[0].tags[f"{axis}Resolution"].value for axis in "XY")
        spacing = file.imagej_metadata["spacing"]
    assert x == y and math.isclose(x[1] / x[0], spacing, rel_tol=1e-3)
    assert spacing == float(edge.split(",")[0].rstrip("knm"))


@pytest.mark.parametrize(("edge", "in_um"), [("2.25um", 2.25), ("0.5km", 5e8), ("7nm", 7e-3)])
def test_the_resolution_of_an_ome_tiff(tmp_path: Path, edge: str, in_um: float) -> None:
    path = bake(tmp_path / "a.tif", "--voxel-size", edge)
    with tifffile.TiffFile(path) as file:
        x = file.pages[0].tags["XResolution"].value
    assert math.isclose(x[1] / x[0] * 1e4, in_um)


@pytest.mark.skipif("SOLIDTEX_LONG_TESTS" not in os.environ, reason="takes minutes")
def test_a_tiff_of_more_than_four_gigabytes_is_a_bigtiff(tmp_path: Path) -> None:
    """The directories of a bake that is interrupted when it has written them."""
    command = [
        BAKE,
        "granite-grey",
        "--size",
        "1024,1024,900",
        "--depth",
        "16",
        "-o",
        tmp_path / "a.tif",
    ]
    copy = tmp_path / "copy.tif"
    with subprocess.Popen(command, stderr=subprocess.PIPE) as process:
        while process.poll() is None and not copy.exists():
            for path in tmp_path.glob(".*.tif"):  # the temporary name
                with path.open("rb") as file:
                    start = file.read(1 << 20)
                if len(start) == 1 << 20:
                    copy.write_bytes(start)
        process.terminate()
    with tifffile.TiffFile(copy) as file:
        assert file.is_bigtiff and len(file.pages) == 900
        last = file.pages[899]
        assert last.dataoffsets[0] - file.pages[0].dataoffsets[0] == 899 * 1024 * 1024 * 6


@pytest.mark.parametrize("depth", ["8", "16"])
def test_png_slices(tmp_path: Path, depth: str) -> None:
    folder = bake(tmp_path / "a", "--slices", "png", "--depth", depth)
    format = "uint8" if depth == "8" else "uint16"
    images = [oiio.ImageBuf(str(folder / f"{z:04}.png")) for z in range(SIZE[2])]
    assert images[0].spec().format == format
    assert_same(np.stack([image.get_pixels(format) for image in images]), depth)


@pytest.mark.parametrize("depth", ["8", "16"])
def test_png_tells_the_encoding_of_its_colors(tmp_path: Path, depth: str) -> None:
    for space in ("srgb", "linear"):
        options = ["--slices", "png", "--depth", depth, "--color-space", space]
        folder = bake(tmp_path / space, *options)
        image = Image.open(folder / "0000.png")
        assert image.info.get("srgb") == (0 if space == "srgb" else None)
        assert image.info.get("gamma") == (None if space == "srgb" else 1)


def test_png_of_data_has_no_color_space(tmp_path: Path) -> None:
    for name, options in {"slices": ["--slices", "png"], "a.png": []}.items():
        output = bake(tmp_path / name, *options, "--channels", "roughness", model="paint-rusted")
        image = Image.open(output / "0000.png" if options else output)
        assert not {"srgb", "gamma"} & set(image.info), name


def test_exr_slices_of_half(tmp_path: Path) -> None:
    folder = bake(tmp_path / "a", "--slices", "exr", "--depth", "half")
    images = [oiio.ImageBuf(str(folder / f"{z:04}.exr")) for z in range(SIZE[2])]
    assert images[0].spec().format == "half"
    assert_same(np.stack([image.get_pixels("half") for image in images]), "half")


@pytest.mark.parametrize("space", ["srgb", "linear"])
def test_exr_tells_the_encoding_of_its_colors(tmp_path: Path, space: str) -> None:
    folder = bake(tmp_path / "a", "--slices", "exr", "--color-space", space)
    spec = oiio.ImageBuf(str(folder / "0000.exr")).spec()
    names = {"srgb": "srgb_rec709_scene", "linear": "lin_rec709_scene"}
    assert spec.getattribute("colorInteropID") == names[space]
    assert oiio.equivalent_colorspace(spec.getattribute("oiio:ColorSpace"), names[space])
    rec_709 = (0.64, 0.33, 0.3, 0.6, 0.15, 0.06, 0.3127, 0.329)
    assert np.allclose(spec.getattribute("chromaticities"), rec_709)


def test_exr_of_data_has_no_colors(tmp_path: Path) -> None:
    options = ["--slices", "exr", "--channels", "roughness"]
    folder = bake(tmp_path / "a", *options, model="paint-rusted")
    spec = oiio.ImageBuf(str(folder / "0000.exr")).spec()
    assert spec.getattribute("colorInteropID") == "data"
    assert spec.getattribute("chromaticities") is None


def numbers(text: str) -> list[float]:
    return [float(number) for number in text.split()]


@pytest.mark.parametrize("kind", ["png", "exr"])
def test_slices_have_scale_and_place(tmp_path: Path, kind: str) -> None:
    folder = bake(tmp_path / "a", "--slices", kind, *VOXEL)
    for z in (0, 3):
        spec = oiio.ImageBuf(str(folder / f"{z:04}.{kind}")).spec()
        if kind == "exr":
            fields = {found.name: found.value for found in spec.extra_attribs}
            in_meter = fields["XResolution"] / 0.0254  # of an inch
            assert fields["ResolutionUnit"] == "in" and np.isclose(in_meter, 1e6)
        else:
            image = Image.open(folder / f"{z:04}.{kind}")
            fields = dict(line.split("=") for line in image.info["Description"].splitlines())
            assert spec.getattribute("ImageDescription") == image.info["Description"]
            assert np.allclose(np.array(image.info["dpi"]) / 0.0254, [1e6, 5e5])
        assert spec.getattribute("PixelAspectRatio") == 0.5
        assert numbers(fields["solidtex_voxel_size"]) == list(EDGES) and fields["unit"] == "um"
        center = CENTER + np.array([0, 0, z]) * EDGES
        assert np.allclose(numbers(fields["solidtex_position"]), center)
        assert fields["solidtex_model"] == MODEL


def test_voxels_without_a_unit_have_no_resolution(tmp_path: Path) -> None:
    folder = bake(tmp_path / "a", "--slices", "png", "--voxel-size", "2000km")
    assert "dpi" not in Image.open(folder / "0000.png").info  # less than a pixel in a meter
    folder = bake(tmp_path / "b", "--slices", "exr")
    assert oiio.ImageBuf(str(folder / "0000.exr")).spec().getattribute("XResolution") is None


@pytest.mark.parametrize("options", [["--slices", "png"], ["--slices", "exr"], []])
def test_threads_change_no_byte_of_an_image(tmp_path: Path, options: list[str]) -> None:
    name = "a" if options else "a.png"
    found = []
    for threads in (1, 4):
        (tmp_path / str(threads)).mkdir()
        path = bake(tmp_path / str(threads) / name, *options, "--threads", threads)
        files = sorted(path.iterdir()) if options else [path]
        found.append([file.read_bytes() for file in files])
    assert found[0] == found[1] and len(found[0]) in (1, SIZE[2])


@pytest.mark.parametrize("depth", ["8", "16"])
def test_flipbook(tmp_path: Path, depth: str) -> None:
    path = bake(tmp_path / "a.png", "--depth", depth, *VOXEL)
    sheet = json.loads((tmp_path / "a.json").read_text())
    image = oiio.ImageBuf(str(path)).get_pixels("uint8" if depth == "8" else "uint16")
    width, height = sheet["frame_width"], sheet["frame_height"]
    assert image.shape[:2] == (sheet["rows"] * height, sheet["columns"] * width)
    frames = []
    for frame in range(sheet["frames"]):
        row, column = divmod(frame, sheet["columns"])
        frames.append(image[row * height : (row + 1) * height, column * width :][:, :width])
    assert_same(np.stack(frames), depth)
    assert sheet["image"] == "a.png" and sheet["color_space"] == "srgb"
    assert sheet["voxel_size"] == list(EDGES) and sheet["unit"] == "um"


def test_a_flipbook_larger_than_a_texture_is_refused(tmp_path: Path) -> None:
    result = run_bake("--size", 1024, "-o", tmp_path / "a.png")
    assert result.returncode == 1 and "a.png: needs a sheet of 32768 x 32768" in result.stderr
    assert os.listdir(tmp_path) == []


def test_nanovdb(tmp_path: Path) -> None:
    warp = pytest.importorskip("warp")
    path = bake(tmp_path / "a.nvdb", *VOXEL)
    with path.open("rb") as file:
        volume = warp.Volume.load_from_nvdb(file, device="cpu")
    voxels = volume.get_voxels().numpy()
    # Warp lists whole leaves.
    inside = ((voxels >= ORIGIN) & (voxels < np.add(ORIGIN, SIZE))).all(axis=1)
    assert inside.sum() == np.prod(SIZE)
    info = volume.get_grid_info()
    assert info.name == "albedo" and info.type_str == "Vec3f"
    assert np.allclose(info.translation, EDGES / 2)
    values = warp.zeros(len(voxels), dtype=warp.vec3, device="cpu")

    @warp.kernel
    def look_up(
        grid: warp.uint64, at: warp.array(dtype=warp.vec3i), to: warp.array(dtype=warp.vec3)
    ):
        i = warp.tid()
        to[i] = warp.volume_lookup(grid, at[i][0], at[i][1], at[i][2], dtype=warp.vec3)

    warp.launch(
        look_up,
        len(voxels),
        [volume.id, warp.array(voxels, dtype=warp.vec3i, device="cpu"), values],
        device="cpu",
    )
    found = np.zeros((*SIZE, 3), np.float32)
    found[tuple((voxels[inside] - ORIGIN).T)] = values.numpy()[inside]
    assert (values.numpy()[~inside] == 0).all()
    assert np.array_equal(found, eval_box())
