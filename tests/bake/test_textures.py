"""3D textures of solidtex-bake with their levels, read back by other programs."""

from __future__ import annotations

import base64
import json
import shutil
import struct
import subprocess
from pathlib import Path

import etcpak
import numpy as np
import OpenImageIO as oiio
import pytest
from bake_box import (
    BUILD,
    CENTER,
    EDGES,
    SIZE,
    VOXEL,
    bake,
    eval_box,
    run_bake,
    srgb_to_linear,
)
from PIL import Image


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


def test_ktx2_has_scale_and_place(tmp_path: Path) -> None:
    """Each pair has a length, a key and a value, in the order of the keys."""
    file = bake(tmp_path / "a.ktx2", *VOXEL).read_bytes()
    at, length = struct.unpack_from("<2I", file, 56)
    end, pairs = at + length, []
    while at < end:
        (size,) = struct.unpack_from("<I", file, at)
        pairs.append(tuple(file[at + 4 : at + 4 + size].decode().rstrip("\0").split("\0")))
        at += (4 + size + 3) // 4 * 4
    assert at == end and pairs == sorted(pairs)
    fields = dict(pairs)
    assert fields["solidtex_encoding_albedo"] == "srgb" and fields["unit"] == "um"
    assert [float(edge) for edge in fields["solidtex_voxel_size"].split()] == list(EDGES)
    assert [float(center) for center in fields["solidtex_position"].split()] == list(CENTER)


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
    path = bake(tmp_path / "a.ktx2", "--depth", depth, *VOXEL)
    command = ["node", "--input-type=module", "-e", READ_KTX2, str(path)]
    result = subprocess.run(command, cwd=BUILD, capture_output=True, text=True, check=True)
    texture = json.loads(result.stdout)
    assert (texture["pixelWidth"], texture["pixelHeight"], texture["pixelDepth"]) == SIZE
    assert_levels([base64.b64decode(level) for level in texture["levels"]], depth)
    assert texture["keyValue"]["KTXorientation"] == "rdi"
    assert texture["keyValue"]["KTXwriter"].startswith("solidtex ")
    assert texture["keyValue"]["solidtex_voxel_size"] == "1 2 4.5"
    assert texture["keyValue"]["unit"] == "um"
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
    path = bake(tmp_path / "a.ktx2", "--depth", depth, "--color-space", color_space, *VOXEL)
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
