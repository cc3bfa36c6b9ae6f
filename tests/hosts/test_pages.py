"""The programs on the pages of the hosts run as they stand there, and make their pictures."""

import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

REPOSITORY = Path(__file__).resolve().parents[2]
HOSTS = REPOSITORY / "docs" / "hosts"
PICTURES = REPOSITORY / "docs" / "images" / "hosts"


def programs(page: str) -> list[str]:
    return re.findall(r"^```python\n(.*?)^```", (HOSTS / page).read_text(), re.M | re.S)


def run(program: str, folder: Path) -> str:
    """In a folder that has the scenes, as the root of the repository has."""
    link = folder / "scenes"
    if not link.exists():
        link.symlink_to(REPOSITORY / "scenes")
    command = [sys.executable, "-B", "-c", program]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, f"{program}\n{done.stdout}{done.stderr}"
    return done.stdout


def pixels(path: Path) -> np.ndarray:
    return np.asarray(Image.open(path).convert("RGB"), dtype=float)


def test_python(tmp_path: Path) -> None:
    pytest.importorskip("solidtex", reason="the Python module solidtex was not built")
    first, *others = programs("python.md")
    assert "albedo.r" in run(first, tmp_path)
    made, shown = pixels(tmp_path / "python.png"), pixels(PICTURES / "python.png")
    assert (made == shown).all() and made.std() > 10
    assert len(others) == 2
    printed = "".join(run(program, tmp_path) for program in others)
    said = re.findall(r"print\(error\)  # (.*?)(?: \.\.\.)?$", others[-1], re.M)
    assert len(said) == 2
    for message in said:
        assert message in printed


def blocks(picture: np.ndarray) -> np.ndarray:
    height, width = (n // 20 for n in picture.shape[:2])
    cut = picture[: 20 * height, : 20 * width].reshape(height, 20, width, 20, 3)
    return cut.mean(axis=(1, 3))


def test_mitsuba(tmp_path: Path) -> None:
    pytest.importorskip("mitsuba", reason="the Python package mitsuba is not installed")
    pytest.importorskip("solidtex", reason="the Python module solidtex was not built")
    (program,) = programs("mitsuba.md")
    assert os.environ["SOLIDTEX_BUILD"]
    run(program, tmp_path)
    made, shown = pixels(tmp_path / "mitsuba.png"), pixels(PICTURES / "mitsuba.png")
    assert made.shape == shown.shape and shown.std() > 20
    # Another version may sample differently: as much as noise leaves of means over 400 pixels.
    assert np.abs(blocks(made) - blocks(shown)).max() < 6
