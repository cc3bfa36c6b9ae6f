"""Python files are formatted and linted, and those of the package typed, as pyproject.toml says."""

import subprocess
import sys
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).resolve().parents[2]
FOLDERS = ("python_export", "plugins", "tests", "scenes", "docs/scenes")


@pytest.mark.parametrize("command", [["check"], ["format", "--check", "--diff"]])
def test_ruff(command: list[str]) -> None:
    configuration = REPOSITORY / "python_export" / "pyproject.toml"
    run = subprocess.run(
        [
            sys.executable,
            "-m",
            "ruff",
            *command,
            "--no-cache",
            f"--config={configuration}",
            *FOLDERS,
        ],
        cwd=REPOSITORY,
        capture_output=True,
        text=True,
        check=False,
    )
    assert run.returncode == 0, run.stdout + run.stderr


def test_mypy(tmp_path: Path) -> None:
    pytest.importorskip("mypy", reason="the Python package mypy is not installed")
    run = subprocess.run(
        [sys.executable, "-m", "mypy", f"--cache-dir={tmp_path}"],
        cwd=REPOSITORY / "python_export",
        capture_output=True,
        text=True,
        check=False,
    )
    assert run.returncode == 0, run.stdout + run.stderr
