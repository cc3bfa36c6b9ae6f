"""The tabs of docs/hosts/shadertoy/ show in headless Chromium what the engine evaluates."""

import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
from balls import RADIUS, ball, shown
from PIL import Image
from view_pages import MODELS, REPOSITORY, pixels_of

from solidtex import Texture
from solidtex_export.commands import export_shader

FOLDER = REPOSITORY / "docs" / "hosts" / "shadertoy"
VIEW = REPOSITORY / "python_export" / "solidtex_export" / "export" / "view"
SHADERTOY = Path(__file__).with_name("shadertoy.js").read_text()
SIZE = WIDTH, HEIGHT = 384, 216  # room for 141 rows of weights
TIME = 1.0


def test_shadertoy(browser: Any, tmp_path: Path) -> None:
    shader = tmp_path / "gray-stone.glsl"
    options = ["--weights", "texture", "--precision", "half"]
    assert export_shader.main(["stone-grey", "-o", str(shader), *options]) == 0
    subprocess.run([sys.executable, FOLDER / "tabs.py", shader], check=True)
    buffers = [(tmp_path / f"gray-stone-buffer-{letter}.glsl").read_text() for letter in "abcd"]
    tab = (tmp_path / "gray-stone-image.glsl").read_text()
    page = browser.new_page()
    page.add_script_tag(path=VIEW / "webgl.js")
    found = pixels_of(page.evaluate(SHADERTOY, [buffers, tab, SIZE, TIME]))
    normals, is_inside = ball(WIDTH, HEIGHT)
    c, s = np.cos(0.3 * TIME), np.sin(0.3 * TIME)
    x, y, z = np.moveaxis(normals, -1, 0)
    texels = RADIUS * np.stack([c * x - s * z, y, s * x + c * z], axis=-1)[is_inside]
    with Texture(MODELS / "stone-grey.solidtex") as texture:
        expected = shown(texture, normals[is_inside], texels, RADIUS / HEIGHT)
    errors = np.abs(found[is_inside] - expected)
    print(f"mean {errors.mean():.2g}, 99 % {np.quantile(errors, 0.99):.2g}, max {errors.max():.2g}")
    assert np.quantile(errors, 0.99) < 2 / 255
    image = Image.open(REPOSITORY / "docs/images/hosts/shadertoy.png").convert("RGB")
    assert np.abs(found - np.asarray(image) / 255).mean() < 1 / 255


def test_refusals(tmp_path: Path) -> None:
    def told(*arguments: object) -> str:
        done = subprocess.run(
            [sys.executable, FOLDER / "tabs.py", *map(str, arguments)],
            capture_output=True, text=True, cwd=tmp_path, check=False,
        )  # fmt: skip
        assert done.returncode == (1 if arguments else 2)
        assert not list(tmp_path.glob("*-image.glsl"))
        return done.stderr

    assert "arguments are required: shader" in told()
    assert "none.glsl: found no such file" in told("none.glsl")
    for options in (["texture", "--precision", "float"], ["buffer", "--precision", "half"]):
        shader = tmp_path / f"{options[0]}.glsl"
        assert export_shader.main(["stone-grey", "-o", str(shader), "--weights", *options]) == 0
        assert "found other weights than a texture of halves" in told(shader)


def test_tabs_are_not_replaced_without_force(tmp_path: Path) -> None:
    shader, tab = tmp_path / "stone.glsl", tmp_path / "stone-image.glsl"
    options = ["--weights", "texture", "--precision", "half"]
    assert export_shader.main(["stone-grey", "-o", str(shader), *options]) == 0
    command = [sys.executable, FOLDER / "tabs.py", shader]
    tab.write_text("mine")
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 1 and "found an existing file, expected none" in done.stderr
    assert tab.read_text() == "mine" and not (tmp_path / "stone-buffer-a.glsl").exists()
    subprocess.run([*command, "--force"], check=True)
    assert tab.read_text() != "mine"
