"""solidtex-detect: the heat map against codes of the Python module, and refusals."""

import os
import subprocess
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest
from PIL import Image
from space_files import write

import solidtex

BUILD = Path(os.environ["SOLIDTEX_BUILD"])
SIDE = 32  # of the encoder's patch
ALPHA = 5.0


def run(*arguments: object, code: int = 0) -> subprocess.CompletedProcess[str]:
    command = [str(BUILD / "bin" / "solidtex-detect"), *map(str, arguments)]
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    assert result.returncode == code, result.stderr
    return result


@pytest.fixture
def photo(tmp_path: Path) -> Path:
    """Noise on the left, stripes on the right."""
    pixels = np.random.default_rng(0).integers(0, 256, (50, 100, 3), np.uint8)
    pixels[:, 50:] = np.where(np.arange(50)[None, :, None] % 8 < 4, 30, 220)
    path = tmp_path / "photo.png"
    Image.fromarray(pixels).save(path)
    return path


def heat_map(path: Path) -> np.ndarray:
    return oiio.ImageBuf(str(path)).get_pixels(oiio.FLOAT)[:, :, 0]


def test_heat_is_the_similarity_of_windows(tmp_path: Path, photo: Path) -> None:
    path, heat = write(tmp_path, "linear"), tmp_path / "heat.exr"
    options = ["--step", 9, "--alpha", ALPHA, "-o", heat]
    said = run(path, photo, "--patch", f"60,5,{SIDE},{SIDE}", *options).stdout
    lefts, tops = [*range(0, 68, 9), 68], [0, 9, 18]
    assert f"{len(lefts) * len(tops)} windows" in said
    space, image = solidtex.Space(path), np.asarray(Image.open(photo))
    codes = np.array([
        [space.encode(image[t : t + SIDE, l : l + SIDE]).code for l in lefts] for t in tops
    ])  # fmt: skip
    wanted = space.encode(image[5 : 5 + SIDE, 60 : 60 + SIDE]).code
    squares = ((codes - wanted) ** 2).sum(2) * 2 / codes.shape[2]
    expected = np.exp(-ALPHA * squares)
    found = heat_map(heat)
    assert found.shape == (50, 100)
    # Between the middles of windows, from one middle to the next.
    along = np.stack([np.interp(np.arange(100) + 0.5 - SIDE / 2, lefts, row) for row in expected])
    both = np.stack(
        [np.interp(np.arange(50) + 0.5 - SIDE / 2, tops, column) for column in along.T], axis=1
    )
    assert np.abs(found - both).max() < 1e-4
    assert found.max() - found.min() > 0.05


def test_a_larger_patch_has_the_mean_code_of_its_windows(tmp_path: Path, photo: Path) -> None:
    path = write(tmp_path, "linear")
    maps = []
    for width in (SIDE, SIDE + 12):
        heat = tmp_path / f"{width}.tif"
        run(path, photo, "--patch", f"50,0,{width},{SIDE}", "--alpha", ALPHA, "-o", heat)
        maps.append(heat_map(heat))
    assert not np.array_equal(*maps)
    png = tmp_path / "heat.png"
    run(path, photo, "--patch", f"50,0,{SIDE},{SIDE}", "--alpha", ALPHA, "-o", png)
    assert np.abs(heat_map(png) - maps[0]).max() < 0.51 / 255


def test_refusals(tmp_path: Path, photo: Path) -> None:
    path, heat = write(tmp_path, "linear"), tmp_path / "heat.png"
    for code, patch, words in (
        (1, "0,0,31,32", "expected a width and a height of at least 32, the encoder's patch"),
        (1, "70,0,32,32", "expected a part of the photograph of 100 x 50 pixels"),
        (1, "0,40,32,32", "expected a part of the photograph of 100 x 50 pixels"),
        (2, "0,0,32", "--patch: found 0,0,32, expected X,Y,W,H"),
        (2, "-1,0,32,32", "--patch: found -1, expected a whole number from 0 to"),
        (2, "a,0,32,32", "--patch: found a, expected a whole number from 0 to"),
    ):
        assert words in run(path, photo, "--patch", patch, "-o", heat, code=code).stderr
    good = ["--patch", "0,0,32,32"]
    assert ".png, .tif or .exr" in run(path, photo, *good, "-o", "heat.jpg", code=1).stderr
    run(path, photo, *good, "-o", heat, "--step", 0, code=2)
    run(path, tmp_path / "none.png", *good, "-o", heat, code=1)
    assert not heat.exists()
    heat.write_bytes(b"mine")
    assert "exists" in run(path, photo, *good, "-o", heat, code=1).stderr
    run(path, photo, *good, "-o", heat, "--force")
    assert heat.read_bytes() != b"mine"
    before = photo.read_bytes()
    assert "never replaced" in run(path, photo, *good, "-o", photo, "--force", code=1).stderr
    assert photo.read_bytes() == before
