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


def programs(page: str, language: str = "python") -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```", (HOSTS / page).read_text(), re.M | re.S)


def link_sources(folder: Path) -> None:
    """A folder that is like the root of the repository before anything was built."""
    for path in REPOSITORY.iterdir():
        if not path.name.startswith((".", "build", "results")):
            (folder / path.name).symlink_to(path)


def run(program: str, folder: Path) -> str:
    """In a folder that has the scenes, as the root of the repository has."""
    link = folder / "scenes"
    if not link.exists():
        link.symlink_to(REPOSITORY / "scenes")
    (folder / "program.py").write_text(program)
    command = [sys.executable, "-B", "program.py"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, f"{program}\n{done.stdout}{done.stderr}"
    return done.stdout


def pixels(path: Path) -> np.ndarray:
    return np.asarray(Image.open(path).convert("RGB"), dtype=float)


def test_python(tmp_path: Path) -> None:
    pytest.importorskip("solidtex", reason="the Python module solidtex was not built")
    first, *others, lazy = programs("python.md")
    assert "albedo.r" in run(first, tmp_path)
    made, shown = pixels(tmp_path / "python.png"), pixels(PICTURES / "python.png")
    assert (made == shown).all() and made.std() > 10
    assert len(others) == 2
    printed = "".join(run(program, tmp_path) for program in others)
    said = re.findall(r"print\(error\)  # (.*?)(?: \.\.\.)?$", others[-1], re.M)
    assert len(said) == 2
    for message in said:
        assert message in printed
    run(lazy, tmp_path)


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


def test_link(tmp_path: Path) -> None:
    """The host is built against an installation in two ways, and renders the picture shown."""
    build, prefix = os.environ["SOLIDTEX_BUILD"], tmp_path / "moved"
    install = ["cmake", "--install", build, "--prefix", str(tmp_path / "first")]
    subprocess.run(install, check=True, capture_output=True)
    (tmp_path / "first").rename(prefix)  # an installation can be moved
    (tmp_path / "ball.cpp").write_text(programs("link.md", "cpp")[0])
    (tmp_path / "CMakeLists.txt").write_text(programs("link.md", "cmake")[0])
    (pkg_config,) = prefix.glob("**/pkgconfig")
    environment = {**os.environ, "CXXFLAGS": "-Wall -Wextra -Werror"}
    environment.pop("SOLIDTEX_MODEL_PATH", None)
    pictures = []
    for commands in programs("link.md", "sh"):
        script = commands.replace("/opt/solidtex/lib/pkgconfig", str(pkg_config))
        script = "set -e\n" + script.replace("/opt/solidtex", str(prefix))
        command = ["bash", "-c", script]
        done = subprocess.run(
            command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False
        )
        assert done.returncode == 0, f"{script}\n{done.stdout}{done.stderr}"
        assert "0 %" in done.stderr
        pictures.append(pixels(tmp_path / "ball.ppm"))
        (tmp_path / "ball.ppm").unlink()
    assert len(pictures) == 2 and (pictures[0] == pictures[1]).all()
    shown = pixels(PICTURES / "link.png")
    # Another libm may round an 8-bit value the other way.
    assert np.abs(pictures[0] - shown).max() <= 1 and shown.std() > 20
