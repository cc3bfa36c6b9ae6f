"""solidtex-view: the page shows in headless Chromium what the engine and solidtex-render show."""

import functools
import http.server
import itertools
import json
import os
import re
import shutil
import subprocess
import threading
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio
import pytest
from PIL import Image, ImageChops
from view_pages import (
    BOUND,
    CAMERA,
    EYE,
    FIELD_OF_VIEW,
    FLAT,
    HEIGHT,
    MODELS,
    REPOSITORY,
    SIZE,
    TEXELS,
    WIDTH,
    hits,
    message,
    opened,
    picture,
    pixels_of,
)

from solidtex import Texture
from solidtex_export.commands import export_shader, view
from solidtex_export.export import random_models
from solidtex_export.export.file_format import model_file
from solidtex_export.export.view.page import distinct_names

BINARIES = Path(os.environ.get("SOLIDTEX_BUILD", REPOSITORY / "build")) / "bin"
DOCUMENTATION = REPOSITORY / "docs" / "view.md"
DEEP = random_models.lattice_model(levels=7, noise=1, step=1)
LARGE = random_models.sampler_model(octaves=4, hidden=3, width=2100)


@pytest.mark.parametrize(
    ("seed", "place", "cut"),
    [
        (0, (0, 0, 0), None),
        (2**63 + 9, (2**24 - 5, -(2**24), 77), None),
        (0, (0, 0, 0), 0.25),
    ],
)
def test_pixels_are_those_of_the_engine(
    page: Any, seed: int, place: tuple[int, int, int], cut: float | None
) -> None:
    cuts = {"cut": ""} if cut is None else {"cut": "x", "at": cut}
    found = picture(page, seed=str(seed), place=place, shape="cube", **cuts, **FLAT)
    points, is_hit = hits(1.0 if cut is None else cut)
    with Texture(MODELS / "stone-grey.solidtex", seed) as texture:
        expected = texture.eval_points(TEXELS / 2 * points[is_hit], place)
    assert is_hit.mean() > 0.2
    errors = np.abs(found[is_hit] - expected.clip(0, 1)).max(axis=1)
    print(f"mean {errors.mean():.2g}, 99 % {np.quantile(errors, 0.99):.2g}, max {errors.max():.2g}")
    # A rasterizer moves corners to a grid of 1/16 to 1/256 of a pixel.
    assert errors.mean() <= BOUND
    assert errors.max() <= 10 * BOUND


def test_albedo_is_that_of_the_renderer(page: Any, tmp_path: Path) -> None:
    corners = [f"v {x} {y} {z}\n" for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
    faces = ["1 2 4 3", "5 7 8 6", "1 5 6 2", "3 4 8 7", "1 3 7 5", "2 6 8 4"]
    (tmp_path / "cube.obj").write_text("".join(corners) + "".join(f"f {f}\n" for f in faces))
    color = {"solid": str(MODELS / "stone-grey.solidtex"), "texels_per_unit": 3}
    scene = {
        "version": 1,
        "render": {"size": SIZE, "spp": 256},
        "camera": {
            "position": EYE.tolist(), "look_at": [0, 0, 0], "fov": np.degrees(FIELD_OF_VIEW)
        },
        "materials": {"stone": {"type": "diffuse", "color": color}},
        "objects": [{"mesh": "cube.obj", "material": "stone"}],
    }  # fmt: skip
    (tmp_path / "scene.json").write_text(json.dumps(scene))
    command = [BINARIES / "solidtex-render", "scene.json", "-o", "albedo.exr", "--view", "albedo",
               "--texture-filter", "none", "--quiet"]  # fmt: skip
    subprocess.run(command, cwd=tmp_path, check=True)
    linear = oiio.ImageBuf(str(tmp_path / "albedo.exr")).get_pixels(oiio.FLOAT)[..., :3]
    expected = np.where(linear < 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    coarse = FLAT | {"texels": 6}
    found = picture(page, seed="0", place=(0, 0, 0), shape="cube", cut="", **coarse)
    inside = hits()[1]
    for axis in (0, 1):  # the renderer averages over pixels: leave those at edges out
        for step in (-1, 1):
            inside = inside & np.roll(hits()[1], step, axis)
    difference = np.abs(found - expected)[inside]
    # The renderer's pixels are means over an area, the page's are points.
    print(f"mean {difference.mean():.2g}, 95 % {np.quantile(difference, 0.95):.2g}")
    assert np.mean(difference) < 0.01
    assert np.quantile(difference, 0.95) < 0.02
    assert np.corrcoef(found[inside].ravel(), expected[inside].ravel())[0, 1] > 0.95


def test_the_address_sets_controls(file: Path, browser: Any) -> None:
    query = "?texels=2048&cut=y&at=-0.5&place=1,-2,3&seed=12&shape=sphere&model=stone-grey"
    page = opened(browser, file, query, size=(32, 24))
    names = ["model", "shape", "texels", "cut", "at", "place", "seed"]
    found = page.evaluate("names => names.map((name) => solidtex.state[name])", names)
    assert found == [0, "sphere", 2048, "y", -0.5, [1, -2, 3], "12"]
    assert page.text_content("label[for=texels]") == "texels across: 2048"
    assert page.text_content("label[for=at]") == "cut at: -0.5"
    assert message(page) == ""


def test_wrong_values_of_the_address_are_named(file: Path, browser: Any) -> None:
    """All of them; the page shows its defaults instead."""
    told = {
        "backend=foo": 'backend: found "foo", expected webgpu, webgl or webassembly',
        "model=none": 'model: found "none", expected stone-grey',
        "shape=toString": 'shape: found "toString", expected cube, sphere, knot or rabbit',
        "texels=9999999": 'texels: found "9999999", expected a number from 16 to 2048',
        "cut=q": 'cut: found "q", expected x, y or z',
        "at=": 'at: found "", expected a number from -1 to 1',
        "place=1,2": 'place: found "1,2", expected three whole numbers up to 2^30, as 1, 2, 3',
        "seed=-1": 'seed: found "-1", expected a whole number from 0 to 2^64 - 1',
    }
    page = opened(browser, file, f"?{'&'.join(told)}", size=(32, 24))
    assert message(page).split("\n") == list(told.values())
    names = ["model", "shape", "texels", "cut", "at", "place", "seed"]
    found = page.evaluate("names => names.map((name) => solidtex.state[name])", names)
    assert found == [0, "cube", 512, "", 0, [0, 0, 0], "0"]


def test_the_picture_of_the_page(file: Path, browser: Any, tmp_path: Path) -> None:
    """The image of docs/view.md is a screenshot of the address under it, fonts aside."""
    (address,) = re.findall(r"^\(`materials\.html(.*)`\)$", DOCUMENTATION.read_text(), re.M)
    shown = Image.open(DOCUMENTATION.parent / "images/hosts/view.png").convert("RGB")
    page = opened(browser, file, address, shown.size)
    page.screenshot(path=tmp_path / "view.png")
    made = Image.open(tmp_path / "view.png").convert("RGB")
    right_of_controls = page.evaluate("document.getElementById('controls').offsetWidth + 20")
    difference = np.asarray(ImageChops.difference(made, shown))[:, right_of_controls:]
    assert difference.mean() < 1 and np.asarray(shown).std() > 20


def test_the_cube_is_shown_whole_beside_the_controls(file: Path, browser: Any) -> None:
    for width, height in ((320, 120), (90, 120)):
        page = opened(browser, file, "?texels=16", (width, height))
        found = picture(page, lit=False)
        shown = np.abs(found - 0.86).max(axis=-1) > 0.02
        rows, columns = shown.any(axis=1), shown.any(axis=0)
        assert not (rows[0] or rows[-1] or columns[0] or columns[-1])
        covered = page.evaluate("document.getElementById('controls').offsetWidth")
        assert covered > width / 2 or not columns[:covered].any()


def test_the_exemplar_leaves_the_shape_free(tmp_path: Path, browser: Any) -> None:
    file, photo, model = (tmp_path / name for name in ("a.html", "a.png", "a.solidtex"))
    Image.new("RGB", (512, 512), "red").save(photo)
    model.write_bytes(model_file.serialize(random_models.lattice_model(levels=1, noise=1, step=1)))
    assert view.main([str(a) for a in (model, "--exemplar", photo, "-o", file)]) == 0
    for size in ((760, 480), (1200, 700), (500, 480), (360, 640)):
        page = opened(browser, file, "?texels=16&seed=1", size)
        box = page.evaluate("document.getElementById('exemplar').getBoundingClientRect()")
        shown = np.abs(picture(page, lit=False) - 0.86).max(axis=-1) > 0.02
        covered = shown[int(box["top"]) : int(box["bottom"]), int(box["left"]) : int(box["right"])]
        assert covered.size > 50 * 50 and not covered.any(), (size, box, covered.mean())


def test_controls_are_folded_where_they_would_cover_half(file: Path, browser: Any) -> None:
    for width, is_open in ((1000, True), (600, False)):
        page = opened(browser, file, "?texels=16", (width, 60))
        assert page.evaluate("document.getElementById('controls').open") == is_open


def test_the_progress_is_seen_beside_folded_controls(file: Path, browser: Any) -> None:
    page = opened(browser, file, "?texels=16", (360, 640))
    assert not page.evaluate("document.getElementById('controls').open")
    progress = page.locator("#progress")
    assert not progress.is_visible()
    page.evaluate("document.getElementById('progress').value = 'drawn: 40 %'")
    assert progress.is_visible()
    box, controls = progress.bounding_box(), page.locator("#controls").bounding_box()
    assert controls["x"] + controls["width"] < box["x"] and box["x"] + box["width"] <= 360
    assert box["y"] >= 0 and box["y"] + box["height"] < 100


def between_voxels(texture: Texture, points: np.ndarray, place: tuple[int, int, int]) -> np.ndarray:
    """The engine's voxels, linearly interpolated: what a page shows of a lattice."""
    lo = np.floor(points.min(axis=0)).astype(int) - 1
    size = np.ceil(points.max(axis=0)).astype(int) + 1 - lo
    voxels = texture.eval_box((lo + place).tolist(), size.tolist())
    cells = np.floor(points - lo - 0.5).astype(int)
    t = points - lo - 0.5 - cells
    corners = list(itertools.product((0, 1), repeat=3))
    weights = [np.prod(np.where(corner, t, 1 - t), axis=1, keepdims=True) for corner in corners]
    values = [voxels[tuple((cells + corner).T)] for corner in corners]
    return np.sum([w * v for w, v in zip(weights, values, strict=True)], axis=0)


PLACE = (16, 16, 16)
LATTICE = {"shape": "cube", "cut": "", **FLAT}

# The first picture shows one brick.
START = f"texels={TEXELS}&place={','.join(map(str, PLACE))}"


@pytest.fixture(scope="module")
def lattice_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("view") / "lattice.html"
    assert view.main([str(MODELS / "granite-grey.solidtex"), "-o", str(path)]) == 0
    return path


@pytest.fixture(scope="module", params=["webgl", "webgpu"])
def lattice_page(request: pytest.FixtureRequest, lattice_file: Path, browser: Any) -> Any:
    return opened(browser, lattice_file, f"?backend={request.param}&{START}")


@pytest.mark.parametrize(
    ("seed", "place", "texels"),
    [
        (0, PLACE, TEXELS),
        (2**63 + 9, (2**24 - 16, -(2**30) + 16, 80), TEXELS),
        (2**63 + 9, (2**24, -(2**30) + 16, 80), 6),  # at the border of two bricks
    ],
)
def test_lattice_pixels_are_those_of_the_engine(
    lattice_page: Any, seed: int, place: tuple[int, int, int], texels: int
) -> None:
    changes = LATTICE | {"texels": texels}
    found = picture(lattice_page, seed=str(seed), place=place, **changes)
    points, is_hit = hits()
    with Texture(MODELS / "granite-grey.solidtex", seed) as texture:
        positions = texels / 2 * points[is_hit]
        expected = between_voxels(texture, positions, place).clip(0, 1)
        cubic = texture.eval_points(positions, place).clip(0, 1)
    errors = np.abs(found[is_hit] - expected).max(axis=1)
    print(f"mean {errors.mean():.2g}, max {errors.max():.2g};"
          f" cubic: mean {np.abs(found[is_hit] - cubic).mean():.2g}")  # fmt: skip
    assert expected.std() > 0.02
    # The texture has bytes, the canvas too, and a rasterizer moves corners.
    assert errors.mean() <= 2 / 255
    assert errors.max() <= 10 * BOUND


def test_a_lattice_picture_without_new_bricks_computes_none(lattice_page: Any) -> None:
    before = picture(lattice_page, seed="0", place=PLACE, **LATTICE)
    refuse = "() => { view.material.compute = () => { throw new Error('computed'); }; }"
    lattice_page.evaluate(refuse)
    turned = CAMERA | {"eye": [2.0, 2.5, 3.0]}
    after = picture(lattice_page, **LATTICE | {"camera": turned})
    assert np.abs(before - after).max() > 0.1
    lattice_page.evaluate("delete view.material.compute")


def test_a_browser_that_draws_no_floats(lattice_file: Path, browser: Any) -> None:
    script = "WebGL2RenderingContext.prototype.getExtension = () => null"
    page = opened(browser, lattice_file, "?backend=webgl", script=script)
    assert message(page).startswith("granite-grey: a model of the lattice family needs WebGPU, or")


def test_a_lost_device(file: Path, browser: Any) -> None:
    """The message stays when the view changes."""
    losses = {"webgl": "view.gl.getExtension('WEBGL_lose_context').loseContext()",
              "webgpu": "view.device.destroy()"}  # fmt: skip
    for backend, loss in losses.items():
        page = opened(browser, file, f"?backend={backend}", size=(32, 24))
        page.evaluate(loss)
        page.wait_for_function("!document.getElementById('message').hidden")
        page.evaluate("solidtex.set({texels: 64})")
        told = message(page)
        assert " was lost" in told and told.endswith("reload the page")


def test_gallery_shows_all_shipped_models(browser: Any, tmp_path: Path) -> None:
    """The page of docs/gallery.md: each model has its own colors."""
    text = (REPOSITORY / "docs/gallery.md").read_text()
    assert "solidtex-view models/*.solidtex -o materials.html" in text
    models = sorted(MODELS.glob("*.solidtex"))
    file = tmp_path / "materials.html"
    assert view.main([*map(str, models), "--wasm", "none", "-o", str(file)]) == 0
    megabytes = file.stat().st_size / 1e6
    assert f"The page with {len(models)} models has {megabytes:.1f} MB" in text
    page = opened(browser, file, f"?{START}&model={models[-1].stem}")
    assert page.evaluate("solidtex.state.model") == len(models) - 1
    points, is_hit = hits()
    for index, model in enumerate(models):
        found = picture(page, model=index, **LATTICE)[is_hit]
        with Texture(model) as texture:
            evaluate = texture.eval_points
            if model_file.read(model).document["family"] == "field":
                evaluate = functools.partial(between_voxels, texture)
            expected = evaluate(TEXELS / 2 * points[is_hit], PLACE)[:, :3].clip(0, 1)
        assert np.abs(found - expected).mean() < 2 * BOUND, model.stem


def test_a_browser_without_graphics(tmp_path: Path, browser: Any) -> None:
    """The page has no WebAssembly either: it says what to do, without controls that do nothing."""
    file = tmp_path / "page.html"
    assert view.main(["stone-grey", "--wasm", "none", "-o", str(file)]) == 0
    script = "HTMLCanvasElement.prototype.getContext = () => null; delete Navigator.prototype.gpu;"
    page = opened(browser, file, script=script)
    told = "write the page again with solidtex-view --wasm FOLDER, which draws by WebAssembly"
    assert message(page) == f"found no WebGPU or WebGL 2 in this browser; {told}"
    assert not page.locator("#controls").is_visible()
    for backend, found in (
        ("webgpu", "found no webgpu in this browser; open the page without backend=webgpu"),
        ("webassembly", "found no WebAssembly in this page; write the page again with solidtex-"),
    ):
        page.goto(f"file://{file}?backend={backend}")
        page.evaluate("solidtex.ready")
        assert message(page).startswith(found)


def test_models_of_one_name_are_numbered(
    browser: Any, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "page.html"
    assert view.main(["stone-grey", "stone-grey", "--wasm", "none", "-o", str(file)]) == 0
    told = "found another model named stone-grey: the page shows it as stone-grey-2"
    assert told in capsys.readouterr().err
    page = opened(browser, file, "?texels=16&model=stone-grey-2", size=(32, 24))
    assert (page.evaluate("solidtex.state.model"), message(page)) == (1, "")
    assert distinct_names(["a", "a", "a-2", "b", "a"]) == ["a", "a-3", "a-2", "b", "a-4"]


def test_page_is_small_and_needs_no_network(file: Path) -> None:
    text = file.read_text()
    assert len(text) - len(re.search(r"^const MODELS = .*$", text, re.M)[0]) < 1 << 20
    assert "http" not in text.replace("https://github.com", "")


def test_exemplar_and_refusals(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    stone = MODELS / "stone-grey.solidtex"
    Image.new("RGB", (4, 4)).save(tmp_path / "photo.png")
    (tmp_path / "text.png").write_text("text")
    deep, large = tmp_path / "deep.solidtex", tmp_path / "large.solidtex"
    deep.write_bytes(model_file.serialize(DEEP))
    large.write_bytes(model_file.serialize(LARGE))
    page = tmp_path / "page.html"
    arguments = [stone, "--exemplar", tmp_path / "photo.png", "-o", page]
    assert view.main([str(a) for a in arguments]) == 0
    assert "data:image/png;base64," in page.read_text()
    for wrong, told in (
        ([large], "weights, expected at most 4194304"),
        ([deep], "found voxels of 64 texels, expected at most 32"),
        (
            [stone, "--exemplar", "a.png", "b.png"],
            "--exemplar: found 2 images, expected at most 1",
        ),
        ([stone, "--exemplar", "a.gif"], "found '.gif', expected .jpg or .png"),
        ([stone, "--exemplar", "a.png"], "found no such file"),
        ([stone, "--exemplar", tmp_path / "text.png"], "text.png: "),
    ):
        other = tmp_path / "other.html"
        assert view.main([*map(str, wrong), "-o", str(other)]) == 1
        assert told in capsys.readouterr().err
        assert not other.exists()


THREE = os.environ.get("SOLIDTEX_THREE", "")


@pytest.mark.skipif(not THREE, reason="SOLIDTEX_THREE names no folder where npm installed three")
def test_three_js_example(browser: Any, tmp_path: Path) -> None:
    """The page of docs/hosts/threejs/ shows the stone's mean color on the knot."""
    shutil.copy(REPOSITORY / "docs/hosts/threejs/index.html", tmp_path)
    (tmp_path / "node_modules").symlink_to(Path(REPOSITORY, THREE, "node_modules"))
    arguments = [MODELS / "stone-grey.solidtex", "-o", tmp_path / "stone.glsl"]
    options = ["--weights", "texture", "--precision", "half"]
    assert export_shader.main([*map(str, arguments), *options]) == 0
    handler = functools.partial(http.server.SimpleHTTPRequestHandler, directory=tmp_path)
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        page = browser.new_page(viewport={"width": WIDTH, "height": HEIGHT})
        page.set_default_timeout(300_000)
        page.goto(f"http://127.0.0.1:{server.server_port}/index.html")
        page.wait_for_function("document.title == 'rendered'")
        url = page.evaluate("document.querySelector('canvas').toDataURL()")
        server.shutdown()
    pixels = pixels_of(url)
    on_knot = np.abs(pixels - 0xDD / 255).max(axis=-1) > 0.02
    assert 0.2 < on_knot.mean() < 0.8
    # Gray with the variation of stone, not one flat color.
    assert np.ptp(pixels[on_knot].mean(axis=0)) < 20 / 255
    assert pixels[on_knot].std() > 10 / 255
