"""OpenImageIO as Python's wheels bring it, where SOLIDTEX_WHEELS is set (pip downloads it, and the
plugin is built for it, so not by default): the page's commands give the system's picture."""

import os
import re
from pathlib import Path

import numpy as np
import pytest
from test_blender import run
from test_pages import REPOSITORY, link_sources, pixels, programs

pytestmark = pytest.mark.skipif(
    "SOLIDTEX_WHEELS" not in os.environ, reason="SOLIDTEX_WHEELS is not set"
)


@pytest.mark.parametrize("version", ["3.0.19.1", "3.2.2.0"])
def test_the_plugin_built_for_a_wheel_gives_the_same_image(version: str, tmp_path: Path) -> None:
    link_sources(tmp_path)
    _, of_wheels = programs("openimageio.md", "sh")
    commands = re.sub(r"^version=.*", f"version={version}", of_wheels)
    assert version in commands
    run(["bash", "-euo", "pipefail", "-c", commands], tmp_path)
    plugin = Path(os.environ["SOLIDTEX_BUILD"]) / "lib" / "openimageio"
    query = f"{REPOSITORY}/models/wood-oak.solidtex?size=512x512x1&lod=0"
    system = {**os.environ, "OIIO_LIBRARY_PATH": str(plugin)}
    run(["/usr/bin/oiiotool", query, "-o", "oak.png"], tmp_path, env=system)
    shown = pixels(tmp_path / "oak.png")
    assert shown.std() > 10
    assert np.array_equal(pixels(tmp_path / "oak-wheel.png"), shown)
