"""Small cases of benchmarks/failing_calls.py and benchmarks/kills.py."""

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


@pytest.mark.skipif(
    not list((BUILD / "tests/faults").glob("libsolidtex_faults.*")), reason="a build with sanitizers"
)
def test_every_program_reports_a_call_that_fails(inputs: Path) -> None:
    every = 1 if IS_LONG else 9
    assert "findings: 0" in findings("failing_calls.py", "--every", every, "--inputs", inputs)


def test_killed_programs_go_on(inputs: Path) -> None:
    kills = 1000 if IS_LONG else 21
    assert "findings: 0" in findings("kills.py", "--kills", kills, "--inputs", inputs)
