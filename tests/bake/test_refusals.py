"""What solidtex-bake refuses, and what a failure leaves."""

from __future__ import annotations

import os
import re
import resource
import subprocess
import sys
from pathlib import Path

import pytest
from bake_box import (
    BAKE,
    BOX,
    FILES,
    MODEL,
    bake,
    run_bake,
)


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
        (["--voxel-size", "2"], 2, "--voxel-size: found 2, expected a length"),
        (["--voxel-size", "0um"], 2, "--voxel-size: found 0um"),
        (["--voxel-size", "1,2um"], 2, "--voxel-size: found 1,2um"),
        (["--voxel-size", "1um,2,4um"], 2, "--voxel-size: found 1um,2,4um"),
        (["--voxel-size", "1um,2mm,4um"], 2, "--voxel-size: found 1um,2mm,4um"),
        (["--voxel-size", "nanmm"], 2, "--voxel-size: found nanmm"),
        (["--voxel-size", "1parsec"], 2, "--voxel-size: found 1parsec"),
        (["--depth", "32"], 2, "--depth"),
        (["--depth", "half"], 1, "--depth half: nrrd holds float, 8, 16"),
        (["--channels", "gloss"], 1, "--channels gloss: "),
        (
            ["--format", "vti"],
            1,
            "a.nrrd: expected a name that ends in .vti with --format vti",
        ),
        (["--format", "gif"], 2, "--format"),
        (["--format", "tif"], 1, "expected a name that ends in .tif with --format tiff"),
        (["--origin", "0,1073807353,0"], 1, "--origin: found 1073807353 along y with --size 8"),
    ],
)
def test_refusals(tmp_path: Path, arguments: list[str], code: int, message: str) -> None:
    result = run_bake("--size", 8, "-o", tmp_path / "a.nrrd", *arguments)
    assert result.returncode == code
    assert message in result.stderr
    assert os.listdir(tmp_path) == []


def test_imagej_has_no_place_for_a_tiny_edge(tmp_path: Path) -> None:
    path = tmp_path / "a.tif"
    done = run_bake("--size", 4, "--voxel-size", "1e-7m", "--format", "imagej", "-o", path)
    assert done.returncode == 1 and "found an edge of 1e-07m, expected 1e-06 to" in done.stderr
    assert os.listdir(tmp_path) == []


def test_slices_replace_no_file(tmp_path: Path) -> None:
    path = tmp_path / "a"
    path.write_text("mine")
    done = run_bake("--size", 4, "--slices", "png", "--force", "-o", path)
    assert done.returncode == 1 and "a: exists already as a file" in done.stderr
    assert path.read_text() == "mine" and "Baking" not in done.stderr


def test_an_extension_that_is_none_is_refused_with_those_that_are(tmp_path: Path) -> None:
    result = run_bake("--size", 4, "-o", tmp_path / "a.txt")
    assert result.returncode == 1
    listed = result.stderr.split("ends in ")[1].split(", or --slices")[0].split(", ")
    assert len(listed) == len(set(listed)) == 13 and ".zarr" in listed
    assert os.listdir(tmp_path) == []
    assert ": -o -.txt: expected a name that ends in" in run_bake("--size", 4, "-o", "-.txt").stderr


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
    assert "--origin: found 1073807350 along z with --size 16, expected voxels" in result.stderr
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
    command = [BAKE, "granite-grey", "--size", "2048,256,128", "-o", tmp_path / name, "--depth"]
    command.append("16" if name == "a.tif" else "float")
    measured = [sys.executable, "-c", PEAK_MEMORY, *map(str, command)]
    done = subprocess.run(measured, capture_output=True, text=True, check=True)
    assert int(done.stdout) < 300 * 1024
