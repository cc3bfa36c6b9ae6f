"""What a user does with the page of solidtex-view in headless Chromium."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from test_view_meshes import glb
from view_pages import CAMERA, EYE, FLAT, HEIGHT, TEXELS, WIDTH, message, picture


def test_a_drag_turns_the_view(page: Any) -> None:
    page.evaluate("document.getElementById('controls').hidden = true")  # it covers so small a page
    before = picture(page, camera=None, shape="cube", cut="", texels=TEXELS, lit=True)
    page.mouse.move(WIDTH / 2, HEIGHT - 4)
    page.mouse.down()
    page.mouse.move(WIDTH / 2 + 30, HEIGHT - 4)
    page.mouse.up()
    yaw = page.evaluate("solidtex.state.yaw")
    after = picture(page)
    assert yaw == pytest.approx(0.6 - 30 / 150)
    assert before.shape == after.shape
    assert np.abs(before - after).max() > 0.1


def test_a_cut_keeps_its_half_while_the_shape_turns(page: Any) -> None:
    behind = {**CAMERA, "eye": (-EYE).tolist()}
    picture(page, shape="cube", cut="x", at=0, **FLAT)
    turned = picture(page, camera=behind)
    chosen_there = [picture(page, cut=cut) for cut in ("", "x")][1]
    assert np.abs(turned - chosen_there).max() > 0.1
    assert np.array_equal(picture(page), chosen_there)


def test_two_fingers_come_closer(page: Any) -> None:
    picture(page, camera=None, shape="cube", cut="")
    before = page.evaluate("solidtex.state.distance")
    touch = page.context.new_cdp_session(page)

    def fingers(kind: str, *columns: int) -> None:
        points = [{"x": x, "y": HEIGHT - 4, "id": i} for i, x in enumerate(columns)]
        touch.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})

    fingers("touchStart", 25, 35)
    fingers("touchMove", 20, 40)
    fingers("touchEnd")
    assert page.evaluate("solidtex.state.distance") == pytest.approx(before / 2, rel=0.01)
    page.evaluate("distance => solidtex.set({distance})", before)


def test_refused_values_are_named(page: Any) -> None:
    page.evaluate("solidtex.set({seed: 'x'})")
    assert message(page) == 'seed: found "x", expected a whole number from 0 to 2^64 - 1'
    page.evaluate("solidtex.set({seed: '0'})")


def show_controls(page: Any) -> None:
    page.evaluate("Object.assign(document.getElementById('controls'), {hidden: false, open: true})")


def test_a_place_is_typed(page: Any) -> None:
    """The text stays while it is no place yet, and the message too."""
    show_controls(page)
    page.focus("#place")
    page.keyboard.press("Control+A")
    page.keyboard.type("-40, 12,")
    assert page.input_value("#place") == "-40, 12,"
    assert message(page).startswith('place: found "-40, 12,", expected three whole numbers')
    page.keyboard.type(" 7")
    page.wait_for_function("document.getElementById('message').hidden")
    assert page.evaluate("solidtex.state.place") == [-40, 12, 7]
    page.evaluate("solidtex.set({place: [0, 0, 0]})")
    page.evaluate("document.activeElement.blur()")
    assert page.input_value("#place") == "0, 0, 0"


def test_a_seed_that_cannot_be_read_is_not_taken(page: Any) -> None:
    show_controls(page)
    page.focus("#seed")
    page.keyboard.press("Control+A")
    page.keyboard.type("a")
    assert message(page).startswith('seed: found "a", expected a whole number')
    page.evaluate("document.activeElement.blur()")
    assert (page.input_value("#seed"), message(page)) == ("0", "")


def test_a_mesh_is_chosen(page: Any, tmp_path: Path) -> None:
    file = tmp_path / "own.glb"
    file.write_bytes(glb())
    page.set_input_files("#file", file)
    page.wait_for_function("solidtex.state.shape === 'own.glb'")
    page.wait_for_function("document.getElementById('progress').value === ''")
    assert message(page) == "" and page.input_value("#shape") == "own.glb"
