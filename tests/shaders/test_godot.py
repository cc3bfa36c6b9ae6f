"""The project of docs/hosts/godot/ shows in Godot's web runtime what the engine evaluates."""

import functools
import http.server
import os
import threading
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image
from view_pages import MODELS, REPOSITORY, pixels_of

from solidtex import Texture
from solidtex_export.commands import export_shader

EXAMPLE = REPOSITORY / "docs" / "hosts" / "godot"
HERE = Path(__file__).parent / "godot"
GODOT = os.environ.get("SOLIDTEX_GODOT", "")
WIDTH, HEIGHT = 480, 270  # of the canvas of godot/index.html
TEXELS_PER_UNIT = 120


def packed(folder: Path) -> None:
    """The example and the scene that captures it, as Godot opens it: an archive."""
    shader = folder / "stone.gdshaderinc"
    options = ["--precision", "half"]
    assert export_shader.main(["stone-grey", "-o", str(shader), *options]) == 0
    project = (EXAMPLE / "project.godot").read_text()
    with zipfile.ZipFile(folder / "stone.zip", "w") as archive:
        archive.writestr("project.godot", project.replace("stone.tscn", "capture.tscn"))
        for file in (
            *(EXAMPLE / name for name in ("stone.gdshader", "stone.tscn", "weights.gd")),
            *(HERE / name for name in ("capture.gd", "capture.tscn")),
            *(folder / name for name in ("stone.gdshaderinc", "stone.weights.bin")),
        ):
            archive.write(file, file.name)


@pytest.mark.skipif(not GODOT, reason="SOLIDTEX_GODOT names no folder with Godot's web runtime")
def test_godot(browser: Any, tmp_path: Path) -> None:
    packed(tmp_path)
    (tmp_path / "index.html").write_bytes((HERE / "index.html").read_bytes())
    for file in Path(REPOSITORY, GODOT).glob("index.*"):
        if file.suffix in (".js", ".wasm"):
            (tmp_path / file.name).symlink_to(file)
    handler = functools.partial(http.server.SimpleHTTPRequestHandler, directory=tmp_path)
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        page = browser.new_page()
        page.set_default_timeout(600_000)
        page.goto(f"http://127.0.0.1:{server.server_port}/index.html")
        page.wait_for_function("document.title == 'ended' || pictures.face")
        errors = page.evaluate("errors")
        pictures = {name: pixels_of(url) for name, url in page.evaluate("pictures").items()}
        server.shutdown()
    # An archive has no cache of classes, which only Godot's editor writes.
    assert [e for e in errors if "ERROR" in e and "global script cache" not in e] == []
    check_face(pictures["face"])
    shown = np.asarray(Image.open(REPOSITORY / "docs/images/hosts/godot.png").convert("RGB"))
    assert np.abs(pictures["scene"] - shown / 255).mean() < 1 / 255


def check_face(found: np.ndarray) -> None:
    """The face z = 0.5 of a box of one unit, which is as high as the picture."""
    first = (WIDTH - HEIGHT) // 2
    at = (np.arange(HEIGHT) + 0.5) / HEIGHT - 0.5
    x, y = np.meshgrid(at, -at)
    points = TEXELS_PER_UNIT * np.stack([x, y, np.full_like(x, 0.5)], axis=-1)
    with Texture(MODELS / "stone-grey.solidtex") as texture:
        radii = 0.5 * TEXELS_PER_UNIT / HEIGHT
        expected = texture.eval_points(points.reshape(-1, 3), radii=radii).clip(0, 1)
    errors = np.abs(found[:, first : first + HEIGHT].reshape(-1, 3) - expected)
    almost_all = np.quantile(errors, 0.999)
    print(f"mean {errors.mean():.2g}, 99.9 % {almost_all:.2g}, max {errors.max():.2g}")
    assert almost_all <= 1 / 255
