"""Includes follow the arrows: tools -> plugins -> public header, and the rooms of the engine."""

import re
from collections.abc import Iterator
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).resolve().parents[2]
ROOM_LINE = re.compile(r"^#   (\w+) +->((?: \w+)*)", re.MULTILINE)
INCLUDE = re.compile(r"^\s*#\s*include\s+[<\"]([^>\"]+)[>\"]", re.MULTILINE)
FOREIGN = ("plugins/", "tools/", "embree", "OpenImageIO", "CGAL", "OpenEXR", "Imath", "glm")


def drawn_arrows() -> dict[str, set[str]]:
    """The rooms of engine/CMakeLists.txt, each with the rooms that it may include."""
    text = (REPOSITORY / "engine" / "CMakeLists.txt").read_text()
    return {room: set(targets.split()) for room, targets in ROOM_LINE.findall(text)}


def includes(folder: Path) -> Iterator[tuple[Path, str]]:
    for path in sorted(folder.rglob("*")):
        if path.suffix in (".h", ".hpp", ".cpp", ".c", ".in"):
            for name in INCLUDE.findall(path.read_text()):
                yield path.relative_to(REPOSITORY), name


ARROWS = drawn_arrows()


def test_every_room_is_drawn_and_no_arrows_form_a_circle() -> None:
    rooms = {path.parent.name for path in (REPOSITORY / "engine").glob("*/*.cpp")}
    rooms |= {path.parent.name for path in (REPOSITORY / "engine").glob("*/*.h")}
    assert rooms == set(ARROWS)
    assert set().union(*ARROWS.values()) <= rooms
    TopologicalSorter(ARROWS).prepare()  # raises CycleError


@pytest.mark.parametrize("room", ARROWS)
def test_a_room_includes_exactly_what_is_drawn(room: str) -> None:
    found = {
        name.split("/")[1]
        for _, name in includes(REPOSITORY / "engine" / room)
        if name.startswith("engine/")
    }
    assert found - {room} == ARROWS[room]


def test_the_engine_includes_no_plugin_tool_or_library_of_a_renderer() -> None:
    foreign = [
        f"{path}: {name}"
        for path, name in includes(REPOSITORY / "engine")
        if name.startswith(FOREIGN)
    ]
    assert not foreign


@pytest.mark.parametrize(
    ("folder", "forbidden"), [("plugins", ("engine/", "tools/")), ("tools", ("engine/",))]
)
def test_plugins_and_tools_see_only_the_public_header(
    folder: str, forbidden: tuple[str, ...]
) -> None:
    found = list(includes(REPOSITORY / folder))
    assert any(name.startswith("solidtex/") for _, name in found)
    assert not [f"{path}: {name}" for path, name in found if name.startswith(forbidden)]


def test_names_of_catch2_are_in_one_place() -> None:
    """Versions 2 and 3 name matchers differently; tests/unit/catch.hpp alone knows both."""
    paths = sorted((REPOSITORY / "tests").rglob("*.[ch]pp"))
    assert len(paths) > 50
    found = [path.name for path in paths if re.search(r"\bCatch::|\bContains\(", path.read_text())]
    assert found == ["catch.hpp"]
