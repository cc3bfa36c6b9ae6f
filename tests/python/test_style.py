"""Python files are formatted, linted and typed, and import each other, as pyproject.toml says."""

import subprocess
import sys
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).resolve().parents[2]
PACKAGE = REPOSITORY / "python_export"
FOLDERS = ("python_export", "plugins", "benchmarks", "tests", "scenes", "docs/scenes")


def assert_satisfied(folder: Path, *command: str) -> None:
    """The tool, a module of this Python, finds nothing when it runs in the folder."""
    run = subprocess.run(
        [sys.executable, "-m", *command], cwd=folder, capture_output=True, text=True, check=False
    )
    assert run.returncode == 0, run.stdout + run.stderr


@pytest.mark.parametrize("command", [["check"], ["format", "--check", "--diff"]])
def test_ruff(command: list[str]) -> None:
    configuration = f"--config={PACKAGE / 'pyproject.toml'}"
    assert_satisfied(REPOSITORY, "ruff", *command, "--no-cache", configuration, *FOLDERS)


def test_mypy(tmp_path: Path) -> None:
    pytest.importorskip("mypy", reason="the Python package mypy is not installed")
    assert_satisfied(PACKAGE, "mypy", f"--cache-dir={tmp_path}")


def test_no_package_imports_one_above_it(tmp_path: Path) -> None:
    pytest.importorskip("importlinter", reason="the Python package import-linter is not installed")
    lint = "from importlinter.cli import lint_imports_command; lint_imports_command()"
    command = [sys.executable, "-c", lint, "--cache-dir", str(tmp_path)]
    run = subprocess.run(command, cwd=PACKAGE, capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stdout + run.stderr
