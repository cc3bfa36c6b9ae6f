"""Volumes of solidtex-bake, read back by the libraries their users have."""

from __future__ import annotations

import base64
import json
import os
import re
import resource
import shutil
import struct
import subprocess
import sys
from pathlib import Path

import etcpak
import mitsuba
import nrrd
import numpy as np
import OpenImageIO as oiio
import pytest
import tifffile
from PIL import Image

import solidtex

BUILD = Path(os.environ["SOLIDTEX_BUILD"])
BAKE = BUILD / "bin" / "solidtex-bake"
MODEL = "granite-grey"
SIZE, ORIGIN = (20, 13, 17), (-9, 40, 5)
BOX = ["--size", "20,13,17", "--origin", "-9,40,5"]
VOXEL = ["--voxel-size", "1,2,4.5um"]
EDGES = np.array([1, 2, 4.5])
CENTER = (np.array(ORIGIN) + 0.5) * EDGES
FILES = ["a.npy", "a.vdb", "a.nvdb", "a.nrrd", "a.raw", "a.vti", "a.vol", "a.tif", "a.dds"]
FILES += ["a.ktx2", "a.png"]


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


def encoding(depth: str) -> str:
    """Of colors by default."""
    return "srgb" if depth in ("8", "16") else "linear"


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


@pytest.mark.parametrize("depth", ["8", "16"])
def test_png_tells_the_encoding_of_its_colors(tmp_path: Path, depth: str) -> None:
    for space in ("srgb", "linear"):
        options = ["--slices", "png", "--depth", depth, "--color-space", space]
        folder = bake(tmp_path / space, *options)
        image = Image.open(folder / "0000.png")
        assert image.info.get("srgb") == (0 if space == "srgb" else None)
        assert image.info.get("gamma") == (None if space == "srgb" else 1)


def test_exr_slices_of_half(tmp_path: Path) -> None:
    folder = bake(tmp_path / "a", "--slices", "exr", "--depth", "half")
    images = [oiio.ImageBuf(str(folder / f"{z:04}.exr")) for z in range(SIZE[2])]
    assert images[0].spec().format == "half"
    assert_same(np.stack([image.get_pixels("half") for image in images]), "half")


def box_means(volume: np.ndarray, size: tuple[int, int, int]) -> np.ndarray:
    """Means over the part of [z][y][x][channel] that each texel of a smaller volume covers."""
    for axis, coarse in enumerate(size):
        fine = volume.shape[axis]
        edges = np.arange(coarse + 1) * fine / coarse
        covered = np.clip(
            np.minimum(edges[1:, None], np.arange(1, fine + 1))
            - np.maximum(edges[:-1, None], np.arange(fine)),
            0,
            None,
        )
        weights = covered / covered.sum(axis=1, keepdims=True)
        volume = np.moveaxis(np.tensordot(weights, volume, axes=(1, axis)), 0, axis)
    return volume


def texture_levels(depth: str) -> list[np.ndarray]:
    """Levels of a 3D texture as a reader should find them, [z][y][x][channel] with alpha."""
    linear = srgb_to_linear(eval_box().transpose(2, 1, 0, 3))
    size = SIZE[::-1]
    levels = []
    while True:
        linear = box_means(linear, size)
        shown = linear
        if depth in ("8", "bc7"):
            low, high = linear * 12.92, 1.055 * np.maximum(linear, 0) ** (1 / 2.4) - 0.055
            shown = np.where(linear > 0.0031308, high, low)
        if depth in ("8", "bc7", "16"):
            shown = np.clip(shown, 0, 1) * (65535 if depth == "16" else 255)
        alpha = {"8": 255, "bc7": 255, "16": 65535}.get(depth, 1)
        levels.append(np.concatenate([shown, np.full((*size, 1), alpha)], axis=3))
        if size == (1, 1, 1):
            return levels
        size = tuple(max(edge // 2, 1) for edge in size)


TEXTURE_TYPES = {"8": np.uint8, "16": np.uint16, "half": np.float16, "float": np.float32}
TEXTURE_TOLERANCE = {"8": 0.51, "16": 1, "half": 1e-3, "float": 1e-5}


def decode_bc7(blocks: bytes, size: tuple[int, ...]) -> np.ndarray:
    """Slices of a texture, each decoded by Pillow."""
    depth, height, width = size
    rows, columns = (height + 3) // 4, (width + 3) // 4
    slices = np.frombuffer(blocks, np.uint8).reshape(depth, -1)
    assert slices.shape[1] == rows * columns * 16
    decoded = []
    for part in slices:
        blocks_size = (4 * columns, 4 * rows)
        image = np.asarray(Image.frombytes("RGBA", blocks_size, part.tobytes(), "bcn", 7, "BC7"))
        decoded.append(image[:height, :width])
    return np.stack(decoded)


def assert_levels(found: list[bytes], depth: str) -> None:
    wanted = texture_levels(depth)
    assert len(found) == len(wanted) == 5  # 20, 10, 5, 2, 1
    for level, (data, texels) in enumerate(zip(found, wanted, strict=True)):
        if depth == "bc7":
            pixels = decode_bc7(data, texels.shape[:3]).astype(float)
            assert (pixels[..., 3] >= 254).all()
            error = np.sqrt(np.mean((pixels - texels)[..., :3] ** 2))
            assert error < 4, f"level {level}: {error}"
        else:
            pixels = np.frombuffer(data, TEXTURE_TYPES[depth]).reshape(texels.shape)
            assert np.abs(pixels.astype(float) - texels).max() <= TEXTURE_TOLERANCE[depth]


@pytest.mark.parametrize("depth", ["8", "16", "half", "float", "bc7"])
def test_dds(tmp_path: Path, depth: str) -> None:
    path = bake(tmp_path / "a.dds", "--depth", depth)
    file = path.read_bytes()
    bytes_per_texel = {"8": 4, "16": 8, "half": 8, "float": 16}
    levels, at = [], 148
    for texels in texture_levels(depth):
        z, y, x = texels.shape[:3]
        blocks = ((x + 3) // 4) * ((y + 3) // 4) * z
        length = 16 * blocks if depth == "bc7" else x * y * z * bytes_per_texel[depth]
        levels.append(file[at : at + length])
        at += length
    assert at == len(file)
    assert_levels(levels, depth)
    if depth in ("8", "bc7"):  # Pillow shows the first slice
        image = np.asarray(Image.open(path).convert("RGBA"))
        tolerance = 0.51 if depth == "8" else 40
        assert np.abs(image - texture_levels(depth)[0][0]).max() <= tolerance


@pytest.mark.parametrize("depth", ["8", "bc7"])
def test_dds_in_openimageio(tmp_path: Path, depth: str) -> None:
    """OpenImageIO reads no other depth of a volume, the first slice, and one level of BC7."""
    path = bake(tmp_path / "a.dds", "--depth", depth)
    for level, texels in enumerate(texture_levels(depth)[: 1 if depth == "bc7" else None]):
        found = oiio.ImageBuf(str(path), 0, level).get_pixels("uint8").reshape(texels.shape)
        error = np.sqrt(np.mean((found[0] - texels[0]) ** 2))
        assert error < (0.51 if depth == "8" else 8), f"level {level}: {error}"


@pytest.mark.parametrize("depth", ["8", "16", "half", "float", "bc7"])
def test_ktx2(tmp_path: Path, depth: str) -> None:
    file = bake(tmp_path / "a.ktx2", "--depth", depth).read_bytes()
    assert file[:12] == b"\xabKTX 20\xbb\r\n\x1a\n"
    codes = {"8": 43, "16": 91, "half": 97, "float": 109, "bc7": 146}
    sizes = {"8": 1, "16": 2, "half": 2, "float": 4, "bc7": 1}
    header = struct.unpack_from("<9I", file, 12)
    assert header == (codes[depth], sizes[depth], *SIZE, 0, 1, 5, 0)
    levels = []
    for level in range(5):
        offset, length, uncompressed = struct.unpack_from("<3Q", file, 80 + 24 * level)
        assert length == uncompressed and offset % 4 == 0
        levels.append(file[offset : offset + length])
    assert_levels(levels, depth)


READ_KTX2 = """
import {read} from 'ktx-parse';
import {readFileSync} from 'node:fs';
const texture = read(new Uint8Array(readFileSync(process.argv[1])));
texture.levels = texture.levels.map(level => Buffer.from(level.levelData).toString('base64'));
console.log(JSON.stringify(texture));
"""


@pytest.mark.parametrize("depth", ["8", "16", "half", "float", "bc7"])
def test_ktx2_in_the_parser_of_three_js(tmp_path: Path, depth: str) -> None:
    """ktx-parse, installed by `npm install --prefix build ktx-parse`."""
    if not shutil.which("node") or not (BUILD / "node_modules" / "ktx-parse").is_dir():
        pytest.skip("no node, or no ktx-parse")
    path = bake(tmp_path / "a.ktx2", "--depth", depth)
    command = ["node", "--input-type=module", "-e", READ_KTX2, str(path)]
    result = subprocess.run(command, cwd=BUILD, capture_output=True, text=True, check=True)
    texture = json.loads(result.stdout)
    assert (texture["pixelWidth"], texture["pixelHeight"], texture["pixelDepth"]) == SIZE
    assert_levels([base64.b64decode(level) for level in texture["levels"]], depth)
    assert texture["keyValue"]["KTXorientation"] == "rdi"
    assert texture["keyValue"]["KTXwriter"].startswith("solidtex ")
    (format,) = texture["dataFormatDescriptor"]
    assert format["colorModel"] == (134 if depth == "bc7" else 1)
    assert format["transferFunction"] == (2 if depth in ("8", "bc7") else 1)
    bits = {"8": 8, "16": 16, "half": 16, "float": 32, "bc7": 128}[depth]
    assert [sample["bitLength"] + 1 for sample in format["samples"]] == [bits] * (
        1 if depth == "bc7" else 4
    )


@pytest.mark.parametrize("color_space", ["srgb", "linear"])
@pytest.mark.parametrize("depth", ["8", "16", "half", "float", "bc7"])
def test_ktx2_in_the_validator_of_khronos(tmp_path: Path, depth: str, color_space: str) -> None:
    """ktx2check, built by setup/ktx2check.sh. It finds no byte wrong, and a byte that is."""
    program = BUILD / "ktx" / "tools" / "ktx2check" / "ktx2check"
    if not program.exists():
        pytest.skip("no ktx2check")
    path = bake(tmp_path / "a.ktx2", "--depth", depth, "--color-space", color_space)
    checked = subprocess.run([program, path], capture_output=True, text=True)
    assert checked.returncode == 0 and not checked.stdout, checked.stdout
    file = bytearray(path.read_bytes())
    file[12] = 200  # of the format of a texel
    path.write_bytes(file)
    assert subprocess.run([program, path], capture_output=True).returncode != 0


def test_bc7_is_as_good_as_another_encoder(tmp_path: Path) -> None:
    box = ["--size", "64,64,4"]
    dds = tmp_path / "a.dds"
    assert run_bake(*box, "-o", dds, "--depth", "bc7").returncode == 0
    raw = tmp_path / "a.raw"
    assert run_bake(*box, "-o", raw, "--depth", "8").returncode == 0
    rgb = np.fromfile(raw, np.uint8).reshape(4, 64, 64, 3)
    rgba = np.concatenate([rgb, np.full((4, 64, 64, 1), 255, np.uint8)], axis=3)
    ours = decode_bc7(dds.read_bytes()[148 : 148 + 64 * 64 * 4], (4, 64, 64))
    theirs = decode_bc7(
        b"".join(etcpak.compress_bc7(part.tobytes(), 64, 64) for part in rgba), (4, 64, 64)
    )

    def error(decoded: np.ndarray) -> float:
        return float(np.sqrt(np.mean((decoded.astype(float) - rgba)[..., :3] ** 2)))

    print(error(ours), error(theirs))
    assert error(ours) < 1.25 * error(theirs)


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


def test_a_name_by_default(tmp_path: Path) -> None:
    command = [BAKE, MODEL, "--size", "4", "--format", "nrrd"]
    subprocess.run(command, check=True, cwd=tmp_path, capture_output=True)
    assert os.listdir(tmp_path) == [f"{MODEL}.nrrd"]


@pytest.mark.parametrize("name", ["A.NHDR", "A.TIFF", "A.ZARR", *map(str.upper, FILES)])
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


def test_an_extension_that_is_none_is_refused_with_those_that_are(tmp_path: Path) -> None:
    result = run_bake("--size", 4, "-o", tmp_path / "a.txt")
    assert result.returncode == 1
    listed = result.stderr.split("ends in ")[1].split(", or --slices")[0].split(", ")
    assert len(listed) == len(set(listed)) == 13 and ".zarr" in listed
    assert os.listdir(tmp_path) == []


def test_voxels_beside_a_header_are_not_replaced(tmp_path: Path) -> None:
    (tmp_path / "a.raw").write_text("mine")
    result = run_bake("--size", 4, "-o", tmp_path / "a.nhdr")
    assert result.returncode == 1 and "a.raw: exists already" in result.stderr
    assert (tmp_path / "a.raw").read_text() == "mine" and len(os.listdir(tmp_path)) == 1


def test_formats_of_the_help_are_those_of_the_program() -> None:
    text = run_bake("--help").stdout
    for extension in [
        "npy",
        "vdb",
        "nvdb",
        "nrrd",
        "nhdr",
        "raw",
        "vti",
        "vol",
        "tif",
        "dds",
        "ktx2",
        "png",
    ]:
        assert f".{extension}" in text


@pytest.mark.parametrize(
    ("name", "depth", "needed"),
    [("a.dds", "8", "of memory"), ("a.ktx2", "bc7", "of memory"), ("a.nvdb", "float", "of memory")],
)
def test_what_memory_cannot_hold_is_refused(
    tmp_path: Path, name: str, depth: str, needed: str
) -> None:
    result = run_bake("--size", 20000, "-o", tmp_path / name, "--depth", depth)
    assert result.returncode == 1
    assert f"{name}: needs " in result.stderr and needed in result.stderr
    assert "TiB" in result.stderr and "are available; .zarr, .npy, .nrrd" in result.stderr
    assert os.listdir(tmp_path) == []


@pytest.mark.parametrize("name", ["a.nrrd", "a.nhdr", "a.raw", "a.vti", "a.vol", "a.tif"])
def test_what_the_disk_cannot_hold_is_refused(tmp_path: Path, name: str) -> None:
    result = run_bake("--size", 100000, "-o", tmp_path / name)
    assert result.returncode == 1
    assert f"{name}: needs " in result.stderr and "on the disk" in result.stderr
    # Mitsuba's volumes have floats only.
    assert ("--depth 8 and" in result.stderr) == (name != "a.vol")
    assert os.listdir(tmp_path) == []


@pytest.mark.parametrize("name", ["a.nhdr", "a.tif", "a.ktx2", "a.png"])
def test_a_write_that_fails_leaves_nothing(tmp_path: Path, name: str) -> None:
    def limit_files() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (2000, 2000))

    command = [BAKE, MODEL, "--size", "12", "-o", tmp_path / name]
    result = subprocess.run(command, capture_output=True, text=True, preexec_fn=limit_files)
    assert result.returncode == 1 and ".tmp" not in result.stderr
    assert "needs" in result.stderr or "cannot write: File too large" in result.stderr
    assert os.listdir(tmp_path) == []


@pytest.mark.parametrize("name", FILES)
def test_a_disk_that_is_full_at_the_last_byte(tmp_path: Path, name: str) -> None:
    whole = tmp_path / "whole"
    whole.mkdir()
    bytes_needed = bake(whole / name).stat().st_size

    def limited(limit: int) -> subprocess.CompletedProcess[str]:
        def limit_files() -> None:
            resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))

        command = [BAKE, MODEL, *BOX, "-o", tmp_path / name]
        return subprocess.run(command, capture_output=True, text=True, preexec_fn=limit_files)

    failed = limited(bytes_needed - 1)
    assert failed.returncode == 1
    assert (
        f"{name}: cannot write: File too large" in failed.stderr or "are allowed" in failed.stderr
    )
    assert os.listdir(tmp_path) == ["whole"]
    assert limited(bytes_needed).returncode == 0
    if name != "a.vdb":  # has an identifier of its own
        assert (tmp_path / name).read_bytes() == (whole / name).read_bytes()


@pytest.mark.parametrize("name", [*FILES, "a.zarr"])
def test_a_volume_whose_end_is_out_of_range_is_refused(tmp_path: Path, name: str) -> None:
    result = run_bake("--size", "4,4,16", "--origin", "0,0,1073807350", "-o", tmp_path / name)
    assert result.returncode == 1 and "Baking" not in result.stderr
    assert "box along z has origin 1073807365 and size 1, expected voxels" in result.stderr
    assert os.listdir(tmp_path) == []


def test_a_block_beyond_memory_is_refused(tmp_path: Path) -> None:
    def limit_memory() -> None:
        resource.setrlimit(resource.RLIMIT_AS, (500 << 20, 500 << 20))

    command = [BAKE, MODEL, "--size", "512", "--block", "512", "-o", tmp_path / "a.npy"]
    result = subprocess.run(command, capture_output=True, text=True, preexec_fn=limit_memory)
    assert result.returncode == 1
    needed = r"a\.npy: needs 3\.0 GiB of memory, \d+\.\d MiB are available; "
    assert re.search(needed + "a smaller --block needs less", result.stderr)
    assert os.listdir(tmp_path) == []


# In a process of its own: what Linux counts for a child begins with the memory of its parent.
PEAK_MEMORY = """
import resource, subprocess, sys
subprocess.run(sys.argv[1:], check=True, capture_output=True)
print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)
"""


@pytest.mark.parametrize("name", ["a.nrrd", "a.tif", "a.raw"])
def test_memory_stays_that_of_a_piece(tmp_path: Path, name: str) -> None:
    """A volume of 768 MiB; the program and a piece take 160 MiB."""
    command = [BAKE, "brick", "--size", "2048,256,128", "-o", tmp_path / name, "--depth"]
    command.append("16" if name == "a.tif" else "float")
    measured = [sys.executable, "-c", PEAK_MEMORY, *map(str, command)]
    done = subprocess.run(measured, capture_output=True, text=True, check=True)
    assert int(done.stdout) < 300 * 1024
