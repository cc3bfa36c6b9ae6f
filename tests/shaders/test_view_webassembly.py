"""The page of solidtex-view where a browser has no graphics: the engine in WebAssembly draws."""

import os
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image
from view_pages import (
    EYE,
    FIELD_OF_VIEW,
    FLAT,
    HEIGHT,
    MODELS,
    REPOSITORY,
    TEXELS,
    hits,
    message,
    opened,
    picture,
)

from solidtex import Texture
from solidtex_export.commands import view

PACKAGE = Path(os.environ.get("SOLIDTEX_BUILD", REPOSITORY / "build")) / "wasm" / "package"
NAMES = ["stone-grey", "granite-grey"]

pytestmark = pytest.mark.skipif(not PACKAGE.exists(), reason="the npm package is not built")


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("view") / "view.html"
    assert view.main([*NAMES, "--wasm", str(PACKAGE), "-o", str(path)]) == 0
    return path


@pytest.fixture(scope="module")
def page(file: Path, browser: Any) -> Any:
    """A page that finds no graphics, as in a browser whose graphics card is blocked."""
    script = (
        "const get = HTMLCanvasElement.prototype.getContext;"
        "HTMLCanvasElement.prototype.getContext = function (kind, ...rest) {"
        " return kind === '2d' ? get.call(this, kind, ...rest) : null; };"
        "delete Navigator.prototype.gpu;"
    )
    page = opened(browser, file, script=script)
    assert message(page) == ""
    assert page.evaluate("solidtex.backend()") == "WebAssembly"
    return page


@pytest.mark.parametrize("model", NAMES)
@pytest.mark.parametrize(
    ("seed", "place", "cut"),
    [(0, (16, 16, 16), None), (2**63 + 9, (2**24 - 16, -(2**30) + 16, 80), 0.25)],
)
def test_pixels_are_those_of_the_engine(
    page: Any, model: str, seed: int, place: tuple[int, int, int], cut: float | None
) -> None:
    cuts = {"cut": ""} if cut is None else {"cut": "x", "at": cut}
    changes = {"model": NAMES.index(model), "seed": str(seed), "place": place, "shape": "cube"}
    found = picture(page, **changes, **cuts, **FLAT)
    points, is_hit = hits(1.0 if cut is None else cut)
    with Texture(MODELS / f"{model}.solidtex", seed) as texture:
        expected = texture.eval_points(TEXELS / 2 * points[is_hit], place)
    assert is_hit.mean() > 0.2
    errors = np.abs(found[is_hit] - expected.clip(0, 1)).max(axis=1)
    print(f"mean {errors.mean():.2g}, max {errors.max():.2g}")
    # A byte, and the fast precision.
    assert errors.max() <= 0.5 / 255 + 2 / 1024


def test_footprints_are_those_of_the_engine(page: Any) -> None:
    changes = FLAT | {"filter": True, "texels": 96}  # 4 texels a pixel
    found = picture(page, model=1, seed="0", place=(0, 0, 0), shape="cube", cut="", **changes)
    points, is_hit = hits()
    distances = np.linalg.norm(points[is_hit] - EYE, axis=1)
    radii = 0.5 * 96 / 2 * distances * 2 * np.tan(FIELD_OF_VIEW / 2) / HEIGHT
    with Texture(MODELS / f"{NAMES[1]}.solidtex") as texture:
        expected = texture.eval_points(96 / 2 * points[is_hit], radii=radii)
    assert np.abs(found[is_hit] - expected.clip(0, 1)).max() <= 0.5 / 255 + 2 / 1024


@pytest.mark.parametrize("shape", ["sphere", "knot", "rabbit"])
def test_other_shapes_look_as_in_webgl(page: Any, file: Path, browser: Any, shape: str) -> None:
    other = opened(browser, file, "?backend=webgl")
    changes = {"model": 0, "shape": shape, "cut": "z", "at": 0.1, "seed": "0", "place": (0, 0, 0),
               **FLAT, "lit": True, "texels": 6}  # fmt: skip
    found, expected = picture(page, **changes), picture(other, **changes)
    assert np.abs(expected - 0.86).max() > 0.2
    differs = np.abs(found - expected).max(axis=2) > 0.05
    assert differs.mean() < 0.03  # pixels at edges


@pytest.mark.parametrize("backend", ["webassembly", "webgl"])
def test_what_is_chosen_last_is_shown(file: Path, browser: Any, backend: str) -> None:
    """Also where models, seeds and shapes change while others are loaded or drawn."""
    page = opened(browser, file, f"?backend={backend}&texels=16")
    page.evaluate("""async () => {
      for (const model of [1, 0, 1, 1, 0]) solidtex.set({ model, seed: String(model) });
      for (const shape of ["knot", "sphere"]) solidtex.set({ shape });
      await solidtex.set({ model: 1, seed: "5" });
    }""")
    found = picture(page)
    fresh = opened(
        browser, file, f"?backend={backend}&texels=16&model={NAMES[1]}&shape=sphere&seed=5"
    )
    assert np.array_equal(found, picture(fresh))


def test_png_is_that_of_its_name(file: Path, browser: Any) -> None:
    page = opened(browser, file, "?backend=webassembly&texels=16", size=(600, 400))
    page.click("summary")  # the controls are folded on so narrow a page
    with page.expect_download() as download:
        page.click("#png")
        page.evaluate("void solidtex.set({ model: 1 })")
    assert download.value.suggested_filename == f"{NAMES[1]}.png"
    saved = np.asarray(Image.open(download.value.path()).convert("RGB")) / 255
    assert np.array_equal(saved, picture(page))


def test_it_is_the_last_choice_and_may_be_asked_for(file: Path, browser: Any) -> None:
    for query, name in (("", "WebGPU"), ("?backend=webassembly", "WebAssembly")):
        page = opened(browser, file, query, size=(32, 24))
        assert page.evaluate("solidtex.backend()") == name


def test_an_engine_that_fails_is_told(file: Path, browser: Any, tmp_path: Path) -> None:
    text = file.read_text()
    start = text.index("const ENGINE = ")
    damaged = tmp_path / "damaged.html"
    damaged.write_text(text[:start] + text[start:].replace('"wasm":"', '"wasm":"AAAA', 1))
    page = opened(browser, damaged, "?backend=webassembly")
    assert message(page).startswith("found no webassembly in this browser")


def test_the_folder_of_the_package(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    output = tmp_path / "page.html"
    arguments = ["stone-grey", "-o", str(output), "--force"]
    assert view.main([*arguments, "--wasm", "none"]) == 0
    assert "1 model, without WebAssembly, " in capsys.readouterr().out
    without = output.stat().st_size
    assert view.main([*arguments, "--wasm", str(PACKAGE)]) == 0
    assert "1 model, with WebAssembly, " in capsys.readouterr().out
    # The engine, and the model file.
    assert without < output.stat().st_size < without + 900_000
    assert view.main([*arguments, "--wasm", str(tmp_path / "none")]) == 1
    assert "none: found no such folder" in capsys.readouterr().err
    shutil.copytree(PACKAGE, tmp_path / "package")
    (tmp_path / "package" / "index.mjs").unlink()
    assert view.main([*arguments, "--wasm", str(tmp_path / "package")]) == 1
    assert "package: found no index.mjs, expected the folder that" in capsys.readouterr().err
