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


def test_the_picture_of_pyvista(made: Path) -> None:
    pytest.importorskip("pyvista")
    (program,) = programs("python")
    done = subprocess.run([sys.executable, "-B", "-c", program], cwd=made, capture_output=True)
    assert done.returncode == 0, done.stderr.decode()
    pictures = [
        np.asarray(Image.open(path).convert("RGB"), dtype=float)
        for path in (
            made / "volume-pyvista.png",
            REPOSITORY / "docs" / "images" / "volume-pyvista.png",
        )
    ]
    assert pictures[0].shape == pictures[1].shape and pictures[1].std() > 20
    # Another version of VTK may shade differently.
    assert np.abs(blocks(pictures[0]) - blocks(pictures[1])).max() < 10
