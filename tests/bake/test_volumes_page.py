"""The commands of docs/volumes.md run as they stand there, and make its picture."""

import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

REPOSITORY = Path(__file__).resolve().parents[2]
PAGE = (REPOSITORY / "docs" / "volumes.md").read_text()
BUILD = Path(os.environ["SOLIDTEX_BUILD"])


def programs(language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```", PAGE, re.M | re.S)


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder in which all commands ran."""
    if not (BUILD / "bin" / "solidtex_dump_vdb").exists():
        pytest.skip("built without OpenVDB")
    folder = tmp_path_factory.mktemp("volumes")
    (folder / "build").symlink_to(BUILD)
    (folder / "scenes").symlink_to(REPOSITORY / "scenes")
    for commands in programs("sh"):
        command = ["bash", "-euo", "pipefail", "-c", commands]
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
    return folder


def test_commands_write_all_formats_of_the_page(made: Path) -> None:
    written = {path.suffix for path in made.iterdir()}
    listed = set(re.findall(r"^\| `(\.\w+)`", PAGE, re.M)) - {".nrrd", ".nhdr", ".raw"}
    assert written >= listed | {".nrrd", ".raw"}
    assert (made / "slices" / "0063.png").exists() and (made / "granite.json").exists()


def blocks(picture: np.ndarray) -> np.ndarray:
    height, width = (n // 20 for n in picture.shape[:2])
    cut = picture[: 20 * height, : 20 * width].reshape(height, 20, width, 20, 3)
    return cut.mean(axis=(1, 3))


def assert_makes_its_picture(made: Path, name: str, python: str) -> None:
    (program,) = (program for program in programs("python") if name in program)
    display = ["xvfb-run", "-a", "-s", "-screen 0 1280x1024x24"] if "napari" in name else []
    environment = dict(os.environ) | ({} if python == sys.executable else {"PYTHONPATH": ""})
    command = [*display, python, "-B", "-c", program]
    done = subprocess.run(command, cwd=made, env=environment, capture_output=True)
    assert done.returncode == 0, done.stderr.decode()
    pictures = [
        np.asarray(Image.open(path).convert("RGB"), dtype=float)
        for path in (made / name, REPOSITORY / "docs" / "images" / name)
    ]
    assert pictures[0].shape == pictures[1].shape and pictures[1].std() > 20
    # Another version of a program may shade differently.
    assert np.abs(blocks(pictures[0]) - blocks(pictures[1])).max() < 10


def test_the_picture_of_pyvista(made: Path) -> None:
    pytest.importorskip("pyvista")
    assert_makes_its_picture(made, "volume-pyvista.png", sys.executable)


@pytest.mark.skipif("SOLIDTEX_NAPARI" not in os.environ, reason="names no Python with napari")
def test_the_picture_of_napari(made: Path) -> None:
    """Python with napari, PyQt6 and napari-ome-zarr; the program xvfb-run."""
    assert_makes_its_picture(made, "volume-napari.png", os.environ["SOLIDTEX_NAPARI"])


@pytest.mark.skipif("SOLIDTEX_BPY45" not in os.environ, reason="names no Python with bpy 4.5")
def test_the_picture_of_blender(made: Path) -> None:
    assert_makes_its_picture(made, "volume-blender.png", os.environ["SOLIDTEX_BPY45"])
