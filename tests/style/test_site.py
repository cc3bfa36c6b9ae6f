"""The documentation as a site: it builds without a warning, and its pages link to each other."""

import html.parser
import os
import subprocess
import sys
from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest

pytest.importorskip("mkdocs", reason="mkdocs is not installed")
pytest.importorskip("mkdocstrings", reason="mkdocstrings is not installed")

REPOSITORY = Path(__file__).resolve().parents[2]


class Page(html.parser.HTMLParser):
    """Links and anchors of a page."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.links: set[str] = set()
        self.anchors: set[str] = set()
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        for name, value in attrs:
            if name == "id" and value:
                self.anchors.add(value)
            elif (tag, name) in {("a", "href"), ("img", "src"), ("link", "href")} and value:
                self.links.add(value)


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("site")
    # With --quiet the plugins print no warnings, and --strict counts none.
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "-d", str(folder)]
    environment = {**os.environ, "NO_MKDOCS_2_WARNING": "1"}
    result = subprocess.run(
        command, cwd=REPOSITORY, capture_output=True, text=True, check=False, env=environment
    )
    assert result.returncode == 0 and "WARNING" not in result.stderr, result.stderr
    return folder


def test_every_page_of_the_repository_is_there(site: Path) -> None:
    docs = REPOSITORY / "docs"
    for page in docs.rglob("*.md"):
        name = "index.html" if page.name == "README.md" else f"{page.stem}.html"
        assert (site / page.relative_to(docs).with_name(name)).is_file(), page


def test_links_lead_to_pages_images_and_headings(site: Path) -> None:
    pages = {
        path: Page(path.read_text()) for path in site.rglob("*.html") if path.name != "404.html"
    }
    wrong = []
    for path, page in pages.items():
        for link in page.links:
            url = urlsplit(link)
            if url.scheme or link.startswith("//"):
                continue
            target = (path.parent / unquote(url.path)).resolve() if url.path else path
            target = target / "index.html" if target.is_dir() else target
            if not target.is_file():
                wrong.append(f"{path.relative_to(site)}: {link}: no such file")
            elif url.fragment and target in pages and url.fragment not in pages[target].anchors:
                wrong.append(f"{path.relative_to(site)}: {link}: no such heading")
    assert len(pages) > 70 and not wrong, "\n".join(wrong)


def test_the_reference_comes_from_docstrings_and_the_header(site: Path) -> None:
    assert (
        "Evaluate the texture at origin + points." in (site / "reference/python.html").read_text()
    )
    assert "solidtex_set_progress_callback" in (site / "reference/c.html").read_text()
    assert "footprint" in (site / "search" / "search_index.json").read_text()
