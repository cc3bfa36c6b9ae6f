"""What an editor knows of the module: its stubs are complete, its functions documented."""

import ast
import inspect
import subprocess
import sys
from pathlib import Path

import pytest

import solidtex

FOLDER = Path(solidtex.__file__).parent
PROGRAM = """
import numpy as np
from numpy.typing import NDArray
from typing import assert_type

import solidtex
from solidtex import Texture

with Texture("granite-grey", seed=1, precision="fast") as texture:
    values = texture.eval_points([[0.0, 1.0, 2.0]], (0, 0, 0), radii=2.0)
    assert_type(values, NDArray[np.float32])
    room: NDArray[np.float32] = np.zeros((1, 3), np.float32)
    assert_type(texture.eval_points(values, out=room), NDArray[np.float32])
    assert_type(texture.eval_box((0, 0, 0), (1, 2, 3)), NDArray[np.float32])
    _, jacobians = texture.eval_jacobian(values, axes=np.eye(3))
    assert_type(jacobians, NDArray[np.float32])
    assert_type(texture.channels, tuple[str, ...])
    assert_type(texture.statistics().hits, int)
    assert_type(solidtex.target(), str)
"""
WRONG = ("seed='1'", "precision='half'", "depth=3")


def public_functions() -> list[tuple[str, object]]:
    members = [(name, getattr(solidtex, name)) for name in solidtex.__all__]
    inside = inspect.getmembers(solidtex.Texture)
    return members + [(name, member) for name, member in inside if not name.startswith("_")]


@pytest.mark.parametrize(("name", "member"), public_functions(), ids=lambda v: str(v)[:20])
def test_everything_public_is_documented(name: str, member: object) -> None:
    assert inspect.getdoc(member), f"{name} has no docstring"


def test_the_stub_covers_the_engine_module() -> None:
    assert (FOLDER / "py.typed").exists()
    tree = ast.parse((FOLDER / "_engine.pyi").read_text())
    (texture,) = (n for n in tree.body if isinstance(n, ast.ClassDef) and n.name == "Texture")
    stubbed = {node.name for node in texture.body if isinstance(node, ast.FunctionDef)}
    from solidtex import _engine

    there = {name for name in vars(_engine.Texture) if not name.startswith("_")}
    assert there and there <= stubbed


def mypy(folder: Path, program: str) -> subprocess.CompletedProcess[str]:
    """Of the program, and of the package where there is none."""
    (folder / "program.py").write_text(program)
    what = [str(folder / "program.py")] if program else ["-p", "solidtex"]
    command = [sys.executable, "-m", "mypy", "--strict", f"--cache-dir={folder}", *what]
    return subprocess.run(command, cwd=FOLDER.parent, capture_output=True, text=True, check=False)


def test_mypy_agrees(tmp_path: Path) -> None:
    pytest.importorskip("mypy", reason="the Python package mypy is not installed")
    for program in (PROGRAM, ""):
        run = mypy(tmp_path, program)
        assert run.returncode == 0, run.stdout + run.stderr
    wrong = "".join(f"solidtex.Texture('granite-grey', {part})\n" for part in WRONG)
    run = mypy(tmp_path, "import solidtex\n" + wrong)
    assert run.stdout.count("error:") == len(WRONG), run.stdout
