"""The measurement of bakes runs and says what it measured. No times are judged."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).resolve().parents[2]
BAKE = Path(os.environ["SOLIDTEX_BUILD"]) / "bin" / "solidtex-bake"


def run(*arguments: object) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, REPOSITORY / "benchmarks" / "volume_bake.py", "--bake", BAKE]
    return subprocess.run(
        [*map(str, command), *map(str, arguments)], capture_output=True, text=True, timeout=300
    )


def test_both_are_measured_in_one_run(tmp_path: Path) -> None:
    for package in ("onnx", "torch", "zarr"):
        pytest.importorskip(package, reason=f"{package} is not installed")
    done = run("--size", 32, "--block", 16, "--threads", 1, "--folder", tmp_path)
    assert done.returncode == 0, done.stderr
    head, ours, other, ratio = done.stdout.splitlines()
    assert head == "granite-grey, 32^3 voxels, 1 threads, best of 1"
    assert ours.startswith("solidtex-bake ") and other.startswith("PyTorch + zarr-python ")
    assert re.fullmatch(r"ratio: \d+\.\d, of processors \d+\.\d\d", ratio)
    assert not os.listdir(tmp_path)


def test_half_a_block_is_refused() -> None:
    done = run("--size", 100)
    assert done.returncode != 0 and "--size: found 100" in done.stderr


def test_slices_are_measured_beside_other_programs(tmp_path: Path) -> None:
    others = {"oiiotool": ".tif + oiiotool ", "ffmpeg": ".raw + ffmpeg "}
    expected = [line for program, line in others.items() if shutil.which(program)]
    if not expected:
        pytest.skip("neither oiiotool nor ffmpeg is installed")
    done = run("slices", "--size", 8, "--threads", 1, "--folder", tmp_path)
    assert done.returncode == 0, done.stderr
    _, *lines = done.stdout.splitlines()
    starts = ["solidtex-bake ", *expected, *["ratio: "] * len(expected)]
    for line, start in zip(lines, starts, strict=True):
        assert line.startswith(start), done.stdout


def test_two_processes_are_measured_beside_one(tmp_path: Path) -> None:
    done = run("processes", "--size", 20, "--threads", 1, "--folder", tmp_path)
    assert done.returncode == 0, done.stderr
    _, one, two, _ = done.stdout.splitlines()
    assert one.startswith("1 process ") and two.startswith("2 processes ")
