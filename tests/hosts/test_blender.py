"""Blender, where SOLIDTEX_BPY names a Python with the module bpy 5 (1 GB, so not by default): the
commands of the page make its picture, and the node set-up has the library's values."""

import os
import subprocess
from pathlib import Path

import numpy as np
import pytest
from scipy.ndimage import map_coordinates
from test_pages import PICTURES, REPOSITORY, blocks, pixels, programs

import solidtex

BPY = os.environ.get("SOLIDTEX_BPY", "")
BUILD = Path(os.environ["SOLIDTEX_BUILD"])
needs_bpy = pytest.mark.skipif(not BPY, reason="SOLIDTEX_BPY names no Python with bpy")
WAYS = ("volume", "vertices", "atlas")
VALUES = """
import sys
import bpy, numpy as np
sys.path.insert(0, sys.argv[1])
import solidtex_vdb
bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.mesh.primitive_uv_sphere_add(segments=32, ring_count=16)
ball = bpy.context.object
solidtex_vdb.apply(ball, sys.argv[2], 10.0, (100.0, 50.0, -7.0), 1, ("roughness",))
mesh = ball.evaluated_get(bpy.context.evaluated_depsgraph_get()).to_mesh()
def values(name, key, width):
    found = np.empty(len(mesh.vertices) * width, np.float32)
    mesh.attributes[name].data.foreach_get(key, found)
    return found.reshape(-1, width)
columns = [("position", "vector", 3), ("albedo", "vector", 3), ("roughness", "value", 1)]
np.save(sys.argv[3], np.concatenate([values(*column) for column in columns], axis=1))
"""


def run(command: list, folder: Path, **options: object) -> str:
    done = subprocess.run(
        [str(word) for word in command], cwd=folder, capture_output=True, text=True, check=False,
        **options,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def run_commands(commands: str, folder: Path, bpy: str) -> None:
    """Where `python` is the one with Blender."""
    path = folder / "bin"
    path.mkdir()
    (path / "python").write_text(f'#!/bin/sh\nexec "{Path(bpy).absolute()}" -B "$@"\n')
    (path / "python").chmod(0o755)
    environment = {**os.environ, "PATH": f"{path}:{os.environ['PATH']}", "PYTHONPATH": ""}
    run(["bash", "-euo", "pipefail", "-c", commands], folder, env=environment)


def between_voxels(texture: solidtex.Texture, points: np.ndarray) -> np.ndarray:
    """Values (N, channels) at points (N, 3) as hosts find them: trilinear between voxel centers."""
    from_center = points - 0.5
    lo = np.floor(from_center.min(0)).astype(int)
    size = np.floor(from_center.max(0)).astype(int) + 2 - lo
    voxels = texture.eval_box(lo, size)
    at = (from_center - lo).T
    return np.stack([map_coordinates(v, at, order=1) for v in np.moveaxis(voxels, -1, 0)], axis=-1)


def light(values: np.ndarray) -> np.ndarray:
    """The decoded albedo of encoded values."""
    low = values[:, :3].clip(0)
    return np.where(low <= 0.04045, low / 12.92, ((low + 0.055) / 1.055) ** 2.4)


@needs_bpy
def test_the_page_makes_its_image(tmp_path: Path) -> None:
    (commands,) = programs("blender.md", "sh")
    (tmp_path / "build").symlink_to(BUILD)
    for name in ("plugins", "scenes"):
        (tmp_path / name).symlink_to(REPOSITORY / name)
    run_commands(commands, tmp_path, BPY)
    made = np.concatenate([pixels(tmp_path / f"{way}.png") for way in WAYS], axis=1)
    shown = pixels(PICTURES / "blender.png")
    assert made.shape == shown.shape and shown.std() > 10
    assert np.abs(blocks(made) - blocks(shown)).max() < 8
    # The three ways show one vase: alike, but for how sharp they are.
    first, *others = np.split(made, len(WAYS), axis=1)
    for other in others:
        assert np.abs(blocks(first) - blocks(other)).mean() < 1


@needs_bpy
def test_attributes_have_the_values_of_the_library(tmp_path: Path) -> None:
    bake = BUILD / "bin" / "solidtex-bake"
    box = ["--size", "24", "--origin", "88,38,-19"]
    run([bake, "paint-rusted", *box, "-o", tmp_path / "a.vdb"], tmp_path)
    clean = {**os.environ, "PYTHONPATH": ""}
    out = tmp_path / "a.npy"
    scripts = REPOSITORY / "plugins" / "blender"
    run([BPY, "-B", "-c", VALUES, scripts, tmp_path / "a.vdb", out], tmp_path, env=clean)
    found = np.load(out)
    assert len(found) > 1500  # subdivided
    texture = solidtex.Texture("paint-rusted")
    values = between_voxels(texture, 10 * found[:, :3].astype(np.float64) + (100, 50, -7))
    albedo = light(values)
    roughness = values[:, texture.channels.index("roughness")]
    assert albedo.std() > 0.01
    assert np.abs(found[:, 3:6] - albedo).max() < 1e-4
    assert np.abs(found[:, 6] - roughness).max() < 1e-4
