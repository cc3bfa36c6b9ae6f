"""The measurements of the renderer run and say what they measured. No times are judged."""

import os
import re
from pathlib import Path
from typing import Any

import measure_renderer
import pytest

BINARIES = Path(os.environ["SOLIDTEX_BUILD"]) / "bin"
QUICK = ["--triangles", "400", "--size", "96", "--spp", "16", "--texels", "8", "--rounds", "2"]


def measured(capsys: Any, *arguments: str) -> str:
    programs = ["--render", f"{BINARIES / 'solidtex-render'}"]
    programs += ["--bench", f"{BINARIES / 'solidtex-bench'}"]
    assert measure_renderer.main([*arguments, *QUICK, "--quick", *programs]) == 0
    return capsys.readouterr().out


def number(text: str, pattern: str) -> float:
    found = re.search(pattern, text)
    assert found, text
    return float(found[1])


def test_a_frame_with_bricks(capsys: Any) -> None:
    text = measured(capsys, "frame")
    assert number(text, r"takes the time to ([\d.]+) ") > 0
    computed = number(text, r"bricks: (\d+) computed")
    assert computed == number(text, r"computed, (\d+) needed") > 0
    assert "sampler" not in text


@pytest.mark.parametrize("threads", ["1", "2"])
def test_points_while_rendering(capsys: Any, threads: str) -> None:
    text = measured(capsys, "points", "--threads", threads)
    for name in ("sampler.batch", "sampler.coherent"):
        assert number(text, rf"{name} .* rendering is ([\d.]+) ") > 0
    assert "bricks" not in text


def test_refusals(capsys: Any) -> None:
    assert measure_renderer.main(["frames"]) == 1
    assert "found the measurement frames, expected frame or points" in capsys.readouterr().err
    arguments = ["frame", "--field-model", "no-such-model", *QUICK]
    arguments += ["--render", f"{BINARIES / 'solidtex-render'}"]
    assert measure_renderer.main(arguments) == 1
    assert "no-such-model" in capsys.readouterr().err
    with pytest.raises(ValueError, match="statistics"):
        measure_renderer.parse_stats("rendering: 1 s")
