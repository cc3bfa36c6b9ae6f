"""Runs solidtex-mix in a folder with a small random space."""

import json
import os
import subprocess
from pathlib import Path
from typing import Any

import pytest
from safetensors import safe_open
from safetensors.numpy import load_file, save_file

from solidtex_export.spaces.random_space import Sizes, random_space

BIN = Path(os.environ["SOLIDTEX_BUILD"]) / "bin"
FAMILIES = ("lattice", "sampler")


def run(program: str, *arguments: object, **options: Any) -> subprocess.CompletedProcess[str]:
    command = [str(BIN / program), *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, **options)


def mix(folder: Path, *arguments: object) -> subprocess.CompletedProcess[str]:
    """Run solidtex-mix where the spaces of the folder are found by name."""
    environment = os.environ | {"SOLIDTEX_MODEL_PATH": str(folder)}
    return run("solidtex-mix", *arguments, cwd=folder, env=environment)


def mixed(folder: Path, name: str, *arguments: object) -> Path:
    result = mix(folder, *arguments, "-o", name)
    assert result.returncode == 0, result.stderr
    assert (result.stderr, result.stdout) == ("", f"{name}\n")
    return folder / name


def document(path: Path) -> dict[str, Any]:
    with safe_open(path, "numpy") as file:
        return json.loads(file.metadata()["solidtex"])


def tensors_equal(a: Path, b: Path) -> bool:
    left, right = load_file(a), load_file(b)
    return left.keys() == right.keys() and all(
        left[k].tobytes() == right[k].tobytes() for k in left
    )


def change_document(path: Path, out: Path, change: dict[str, Any]) -> None:
    """Copy a model with a changed training."""
    changed = document(path)
    changed["training"] |= change
    save_file(load_file(path), out, {"solidtex": json.dumps(changed)})


@pytest.fixture(params=FAMILIES)
def folder(tmp_path: Path, request: pytest.FixtureRequest) -> Path:
    """A folder with the space "pebbles" and models of two of its photographs."""
    space = random_space(Sizes(family=request.param, name="pebbles"), seed=3)
    (tmp_path / "pebbles.solidtex-space").write_bytes(space.encode())
    for i, name in enumerate(("a", "b")):
        mixed(
            tmp_path,
            f"{name}.solidtex",
            f"pebbles:stone-{i}",
            "pebbles:stone-4",
            "--weights",
            "1,0",
        )
    return tmp_path
