"""Browsers and pages for tests of solidtex-view."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from view_pages import CHROMIUM, MODELS, OPTIONS, opened

from solidtex_export.commands import view


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("view") / "view.html"
    arguments = [MODELS / "stone-grey.solidtex", "-o", path]
    assert view.main([str(a) for a in arguments]) == 0
    return path


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    if not CHROMIUM:
        pytest.skip("Chromium is not installed")
    with playwright.sync_playwright() as p:
        browser = p.chromium.launch(executable_path=CHROMIUM, args=OPTIONS)
        yield browser
        browser.close()


@pytest.fixture(scope="module", params=["webgl", "webgpu"])
def page(request: pytest.FixtureRequest, file: Path, browser: Any) -> Any:
    page = opened(browser, file, f"?backend={request.param}")
    assert (
        page.evaluate("solidtex.backend()")
        == {"webgl": "WebGL 2", "webgpu": "WebGPU"}[request.param]
    )
    return page
