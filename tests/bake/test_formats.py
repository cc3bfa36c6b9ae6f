"""Volumes of solidtex-bake, read back by the libraries their users have."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import mitsuba
import nrrd
import numpy as np
import OpenImageIO as oiio
import pytest
import tifffile

import solidtex

BAKE = Path(os.environ["SOLIDTEX_BUILD"]) / "bin" / "solidtex-bake"
MODEL = "granite-grey"
SIZE, ORIGIN = (20, 13, 17), (-9, 40, 5)
BOX = ["--size", "20,13,17", "--origin", "-9,40,5"]
VOXEL = ["--voxel-size", "1,2,4.5um"]
EDGES = np.array([1, 2, 4.5])
CENTER = (np.array(ORIGIN) + 0.5) * EDGES


def run_bake(*arguments: object, model: object = MODEL) -> subprocess.CompletedProcess[str]:
    command = [str(BAKE), str(model), *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True)


def bake(path: Path, *arguments: object, model: object = MODEL) -> Path:
    result = run_bake(*BOX, "-o", path, *arguments, model=model)
    assert result.returncode == 0, result.stderr
    return path


def srgb_to_linear(encoded: np.ndarray) -> np.ndarray:
    encoded = encoded.astype(np.float64)
    return np.where(encoded > 0.04045, ((encoded + 0.055) / 1.055) ** 2.4, encoded / 12.92)


def eval_box() -> np.ndarray:
    """[x][y][z][channel], sRGB-encoded as the model is."""
    return solidtex.Texture(MODEL, 0).eval_box(ORIGIN, SIZE)


def expected(depth: str) -> np.ndarray:
    """What a file holds: [z][y][x][channel]."""
    encoded = eval_box().transpose(2, 1, 0, 3)
    if depth in ("8", "16"):
        maximum = 2 ** int(depth) - 1
        return np.floor(np.clip(encoded, 0, 1) * maximum + 0.5)
    return srgb_to_linear(encoded)


def assert_same(found: np.ndarray, depth: str) -> None:
    wanted = expected(depth)
    types = {"8": np.uint8, "16": np.uint16, "half": np.float16, "float": np.float32}
    assert found.dtype == types[depth]
    assert found.shape == wanted.shape
    tolerance = {"8": 0, "16": 1, "half": 1e-3, "float": 1e-6}[depth]
    assert np.abs(found.astype(np.float64) - wanted).max() <= tolerance
    assert wanted.std() > 0.01


@pytest.mark.parametrize("depth", ["8", "16", "float"])
@pytest.mark.parametrize("name", ["a.nrrd", "a.nhdr"])
def test_nrrd(tmp_path: Path, name: str, depth: str) -> None:
    data, header = nrrd.read(str(bake(tmp_path / name, "--depth", depth, *VOXEL)))
    assert_same(data.T, depth)
    assert header["kinds"] == ["RGB-color", "domain", "domain", "domain"]
    assert np.array_equal(header["space directions"][1:], np.diag(EDGES))
    assert np.array_equal(header["space origin"], CENTER)
    assert header["space units"] == ["um", "um", "um"]
    encoding = "linear" if depth == "float" else "srgb"
    assert header["solidtex_encoding_albedo"] == encoding
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
        if depth == "half":
            return
        assert_same(file.asarray(), depth)
        assert file.is_ome and file.series[0].axes == "ZYXS"
        pixels = tifffile.xml2dict(file.ome_metadata)["OME"]["Image"]["Pixels"]
        assert [pixels[f"PhysicalSize{axis}"] for axis in "XYZ"] == list(EDGES)


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
        x = file.pages[0].tags["XResolution"].value
        assert x[0] / x[1] == 1 / EDGES[0]


@pytest.mark.skipif("SOLIDTEX_LONG_TESTS" not in os.environ, reason="takes minutes")
def test_a_tiff_of_more_than_four_gigabytes_is_a_bigtiff(tmp_path: Path) -> None:
    """The directories of a bake that is interrupted when it has written them."""
    command = [
        BAKE,
        "brick",
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


def test_exr_slices_of_half(tmp_path: Path) -> None:
    folder = bake(tmp_path / "a", "--slices", "exr", "--depth", "half")
    images = [oiio.ImageBuf(str(folder / f"{z:04}.exr")) for z in range(SIZE[2])]
    assert images[0].spec().format == "half"
    assert_same(np.stack([image.get_pixels("half") for image in images]), "half")


def test_a_name_by_default(tmp_path: Path) -> None:
    command = [BAKE, MODEL, "--size", "4", "--format", "nrrd"]
    subprocess.run(command, check=True, cwd=tmp_path, capture_output=True)
    assert os.listdir(tmp_path) == [f"{MODEL}.nrrd"]


@pytest.mark.parametrize("name", ["A.NRRD", "A.NHDR", "A.RAW", "A.VTI", "A.VOL", "A.TIF", "A.TIFF"])
def test_extensions_in_capitals(tmp_path: Path, name: str) -> None:
    bake(tmp_path / name)
    assert (tmp_path / name).exists()


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (["--voxel-size", "2"], 2, '--voxel-size: "2" found, expected a length'),
        (["--voxel-size", "0um"], 2, '--voxel-size: "0um" found'),
        (["--voxel-size", "1,2um"], 2, '--voxel-size: "1,2um" found'),
        (["--voxel-size", "nanmm"], 2, '--voxel-size: "nanmm" found'),
        (["--voxel-size", "1parsec"], 2, '--voxel-size: "1parsec" found'),
        (["--depth", "32"], 2, "--depth"),
        (["--depth", "half"], 1, "--depth half: nrrd holds float, 8, 16"),
        (["--channels", "gloss"], 1, "--channels gloss: "),
        (
            ["--format", "vti"],
            1,
            "a.nrrd: expected a name that ends in .vti with --format vti",
        ),
        (["--format", "gif"], 2, "--format"),
    ],
)
def test_refusals(tmp_path: Path, arguments: list[str], code: int, message: str) -> None:
    result = run_bake("--size", 4, "-o", tmp_path / "a.nrrd", *arguments)
    assert result.returncode == code
    assert message in result.stderr
    assert os.listdir(tmp_path) == []


def test_voxels_beside_a_header_are_not_replaced(tmp_path: Path) -> None:
    (tmp_path / "a.raw").write_text("mine")
    result = run_bake("--size", 4, "-o", tmp_path / "a.nhdr")
    assert result.returncode == 1 and "a.raw: exists already" in result.stderr
    assert (tmp_path / "a.raw").read_text() == "mine" and len(os.listdir(tmp_path)) == 1


def test_formats_of_the_help_are_those_of_the_program() -> None:
    text = run_bake("--help").stdout
    for extension in ("npy", "vdb", "nrrd", "nhdr", "raw", "vti", "vol", "tif"):
        assert f".{extension}" in text
