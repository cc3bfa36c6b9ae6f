"""A small box that the tests bake, and what its file should hold."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import numpy as np

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
