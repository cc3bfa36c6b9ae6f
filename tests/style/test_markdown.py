"""Links, anchors and paths in the documentation exist, and its lines are wrapped."""

import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).resolve().parents[2]
WIDTH = 100

SOURCES = {".py", ".cpp", ".h", ".hpp", ".c", ".osl", ".toml", ".j2", ".cmake", ".txt", ".sh"}


def tracked(suffixes: set[str]) -> list[Path]:
    """Files of the repository, without hidden folders, builds and results."""
    folders = [
        path
        for path in REPOSITORY.iterdir()
        if not path.name.startswith((".", "build", "results")) and not path.is_symlink()
    ]
    files = [path for path in folders if path.is_file()]
    files += [path for folder in folders if folder.is_dir() for path in folder.rglob("*.*")]
    return sorted(path for path in files if path.suffix in suffixes)


PAGES = tracked({".md"})


def name(path: Path) -> str:
    return str(path.relative_to(REPOSITORY))


def prose(page: Path) -> Iterator[tuple[int, str]]:
    """Lines outside of fenced blocks, with their numbers."""
    fenced = False
    for number, line in enumerate(page.read_text().splitlines(), 1):
        if line.startswith("```"):
            fenced = not fenced
        elif not fenced:
            yield number, line


@cache
def anchors(page: Path) -> set[str]:
    """Anchors of the headings, as GitHub makes them."""
    found: set[str] = set()
    for _, line in prose(page):
        if heading := re.match(r"#{1,6} +(.*?)[ #]*$", line):
            text = re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", heading[1]).lower()
            base = re.sub(r"[^\w\- ]", "", text).replace(" ", "-")
            count = 0
            while (anchor := f"{base}-{count}" if count else base) in found:
                count += 1
            found.add(anchor)
    return found


def broken(page: Path, link: str) -> str | None:
    """What is wrong with a relative link of the page."""
    path, _, anchor = link.partition("#")
    target = (page.parent / path).resolve() if path else page
    if not target.exists():
        return f"{link}: no such file"
    if anchor and anchor not in anchors(target):
        return f"{link}: no such heading"
    return None


def root_path(text: str) -> Path | None:
    """The file or folder of the repository that a text in backticks names, NAME excepted."""
    first, slash, rest = text.partition("/")
    if not slash or re.search(r"[^\w./-]|NAME", text):
        return None
    if first == "solidtex_export":
        return REPOSITORY / "python_export" / text
    own = REPOSITORY / first
    if first.startswith((".", "build", "results")) or not own.is_dir() or not rest:
        return None
    return REPOSITORY / text


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_links_and_paths(page: Path) -> None:
    wrong = []
    for number, line in prose(page):
        links = re.findall(r"\]\(([^)\s]+)\)", re.sub(r"`[^`]*`", "", line))
        found = [broken(page, link) for link in links if not re.match(r"[a-z]+:", link)]
        for text in re.findall(r"`([^`]+)`", line):
            path = root_path(text)
            if path is not None and not path.exists():
                found.append(f"`{text}`: no such file")
        wrong += [f"{name(page)}:{number}: {problem}" for problem in found if problem]
    assert not wrong, "\n".join(wrong)


def test_links_in_sources() -> None:
    """Pages that comments, help texts and messages name exist, with their headings."""
    wrong = []
    for file in tracked(SOURCES):
        for link in re.findall(r"\bdocs/[\w/-]+\.md(?:#[\w-]+)?", file.read_text()):
            if problem := broken(REPOSITORY / "README.md", link):
                wrong.append(f"{name(file)}: {problem}")
    assert not wrong, "\n".join(wrong)


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_lines_are_wrapped(page: Path) -> None:
    """Tables may be wider; the target of a link does not count."""
    wide = [
        f"{name(page)}:{number}: {len(line)} columns, expected at most {WIDTH}"
        for number, line in enumerate(page.read_text().splitlines(), 1)
        if len(re.sub(r"\]\([^)]*\)", "]", line)) > WIDTH and not line.startswith("|")
    ]
    assert not wide, "\n".join(wide)


def test_every_experiment_is_listed() -> None:
    folder = REPOSITORY / "docs" / "experiments"
    listed = set(re.findall(r"\]\(([\w-]+\.md)\)", (folder / "README.md").read_text()))
    assert listed == {page.name for page in folder.glob("*.md")} - {"README.md"}
