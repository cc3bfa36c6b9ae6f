"""Small cases of benchmarks/failing_calls.py, kills.py and foreign_files.py."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).resolve().parents[2]
BUILD = Path(os.environ["SOLIDTEX_BUILD"])
IS_LONG = bool(os.environ.get("SOLIDTEX_LONG_TESTS"))


def findings(program: str, *arguments: object) -> str:
    command = [sys.executable, "-B", REPOSITORY / "benchmarks" / program, "--build", BUILD]
    done = subprocess.run(
        [*map(str, command), *map(str, arguments)], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def inputs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Inputs of all jobs; the first run of a benchmark makes them."""
    return tmp_path_factory.mktemp("jobs") / "inputs"


FAILING = ["npy", "nhdr", "flipbook", "slices png", "mesh glb", "mix", "detect", "render png"]
KILLED = ["npy", "zarr", "slices png"]
"""Those that take little time; SOLIDTEX_LONG_TESTS tries all."""


without_sanitizers = pytest.mark.skipif(
    not list((BUILD / "tests/faults").glob("libsolidtex_faults.*")),
    reason="a build with sanitizers",
)


@without_sanitizers
def test_every_program_reports_a_call_that_fails(inputs: Path) -> None:
    chosen = [] if IS_LONG else ["--every", 7, *FAILING]
    assert "findings: 0" in findings("failing_calls.py", "--inputs", inputs, *chosen)


def test_killed_programs_go_on(inputs: Path) -> None:
    chosen = [] if IS_LONG else ["--kills", 12, *KILLED]
    assert "findings: 0" in findings("kills.py", "--inputs", inputs, *chosen)


@without_sanitizers
def test_files_of_other_people_are_read_or_refused(tmp_path: Path) -> None:
    corpus = REPOSITORY / "tests/fuzz/corpus"
    mesh = (corpus / "obj/tetrahedron").read_bytes()
    (tmp_path / "a.obj").write_bytes(mesh)
    (tmp_path / "cut.ply").write_bytes((corpus / "ply/little").read_bytes()[:-9])
    for name in ("png", "long.bmp", "strip.tiff", "unknown"):
        ending = Path(name).suffix or ".png"
        (tmp_path / f"{Path(name).stem}{ending}").write_bytes(
            (corpus / "image" / name).read_bytes()
        )
    lines = findings("foreign_files.py", tmp_path).splitlines()
    counts = {name: row for name, *row in map(str.split, lines[1:-1])}
    assert {name: row[:4] for name, row in counts.items()} == {
        "mesh": ["2", "1", "1", "0"],
        "encode": ["4", "0", "4", "0"],
        "environment": ["4", "1", "3", "0"],
        "train": ["4", "0", "4", "0"],
    }
