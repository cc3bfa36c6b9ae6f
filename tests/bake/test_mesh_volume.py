"""The inside of a closed mesh as a sparse volume."""

from __future__ import annotations

import json
import os
import subprocess
from pathlib import Path

import numpy as np
import pytest
from meshes import cube_obj

import solidtex

BUILD = Path(os.environ["SOLIDTEX_BUILD"])
BAKE = BUILD / "bin" / "solidtex-bake"
READER = BUILD / "bin" / "solidtex_dump_vdb"
REPOSITORY = Path(__file__).resolve().parents[2]
MODEL = "granite-grey"

pytestmark = pytest.mark.skipif(not READER.exists(), reason="built without OpenVDB")


def bake(*arguments: object) -> subprocess.CompletedProcess[str]:
    command = [str(BAKE), MODEL, *map(str, arguments), "--to", "volume"]
    return subprocess.run(command, capture_output=True, text=True)


def read_vdb(path: Path) -> tuple[dict, np.ndarray]:
    dump = subprocess.run([READER, path], capture_output=True, check=True).stdout
    line, voxels = dump.split(b"\n", 1)
    grid = json.loads(line)
    return grid, np.frombuffer(voxels, np.float32).reshape(*grid["size"], grid["channels"])


def octahedron(path: Path) -> Path:
    """|x| + |y| + |z| = 1."""
    corners = np.concatenate([np.eye(3), -np.eye(3)])
    lines = ["v {} {} {}".format(*corner) for corner in corners]
    for x in (1, 4):
        for y in (2, 5):
            for z in (3, 6):
                lines.append(f"f {x} {y} {z}" if (x + y + z) % 2 == 0 else f"f {x} {z} {y}")
    path.write_text("\n".join(lines) + "\n")
    return path


def test_only_voxels_inside_are_active(tmp_path: Path) -> None:
    scale, origin = 30.5, np.array([100, -7, 3])
    mesh = octahedron(tmp_path / "a.obj")
    arguments = ["--mesh", mesh, "--texels-per-unit", scale, "--origin", "100,-7,3"]
    result = bake(*arguments, "-o", tmp_path / "a.vdb")
    assert result.returncode == 0, result.stderr
    grid, values = read_vdb(tmp_path / "a.vdb")
    first = np.array(grid["origin"])
    voxels = np.stack(np.meshgrid(*map(np.arange, grid["size"]), indexing="ij"), axis=-1) + first
    points = (voxels + 0.5 - origin) / scale
    distance = np.abs(points).sum(axis=-1) - 1
    found = (values != 0).any(axis=-1)
    # Distances of OpenVDB are those of single precision.
    clear = np.abs(distance) > 1e-3
    assert np.array_equal(found[clear], (distance < 0)[clear])
    assert grid["active"] == found.sum() < 0.3 * found.size
    wanted = solidtex.Texture(MODEL, 0).eval_box(tuple(map(int, first)), tuple(grid["size"]))
    assert np.array_equal(values[found], wanted[found])
    # The grid lies where the mesh lies.
    assert np.allclose(grid["world"], (first + 0.5 - origin) / scale, atol=1e-5)


def test_a_cube_of_separate_charts_is_closed(tmp_path: Path) -> None:
    mesh = cube_obj(tmp_path / "a.obj")
    result = bake("--mesh", mesh, "--texels-per-unit", 10, "-o", tmp_path / "a.vdb")
    assert result.returncode == 0, result.stderr
    grid, _ = read_vdb(tmp_path / "a.vdb")
    assert grid["size"] == [20, 20, 20] and grid["active"] == 8000


def test_half_floats(tmp_path: Path) -> None:
    mesh = cube_obj(tmp_path / "a.obj")
    arguments = ["--mesh", mesh, "--texels-per-unit", 10]
    for name, depth in (("a.vdb", "float"), ("b.vdb", "half")):
        assert bake(*arguments, "-o", tmp_path / name, "--depth", depth).returncode == 0
    rounded = read_vdb(tmp_path / "a.vdb")[1].astype(np.float16)
    assert np.array_equal(read_vdb(tmp_path / "b.vdb")[1], rounded)
    assert (tmp_path / "b.vdb").stat().st_size < (tmp_path / "a.vdb").stat().st_size


def test_an_open_mesh_is_refused(tmp_path: Path) -> None:
    mesh = octahedron(tmp_path / "a.obj")
    mesh.write_text(mesh.read_text().rsplit("f ", 1)[0])
    result = bake("--mesh", mesh, "-o", tmp_path / "a.vdb")
    assert result.returncode == 1
    assert "a.obj: found 3 open edges, expected a closed mesh" in result.stderr
    assert os.listdir(tmp_path) == ["a.obj"]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["-o", "a.npy"], "a.npy: expected a name that ends in .vdb or .nvdb with --to volume"),
        (["-o", "a.vdb", "--size", 9], "--size: found it with --to volume"),
        (["-o", "a.vdb", "--checkpoint", "b"], "--checkpoint: found it with --to volume"),
        (["-o", "a.vdb", "--texels-per-unit", 1e-3], "found no voxel inside; give a larger"),
        (["-o", "a.vdb", "--origin", "1073741824,0,0"], "expected less than 2^30"),
        (["-o", "a.vdb", "--texels-per-unit", 1e5], "TiB of memory, "),
    ],
)
def test_refusals(tmp_path: Path, arguments: list, message: str) -> None:
    octahedron(tmp_path / "m.obj")
    command = [str(BAKE), MODEL, "--mesh", "m.obj", "--to", "volume", *map(str, arguments)]
    result = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path)
    assert result.returncode == 1 and message in result.stderr
    assert os.listdir(tmp_path) == ["m.obj"]
