"""Mixes of a space's materials in a rendered scene."""

import json
import os
from pathlib import Path
from typing import Any

import pytest
from mixing import BIN, change_document, document, folder, mixed, run

__all__ = ["folder"]

PLANE = """ply
format ascii 1.0
element vertex 4
property float x
property float y
property float z
property float s
property float t
property float wear
element face 1
property list uchar int vertex_indices
end_header
-1 -1 0 0 0 0
1 -1 0 1 0 1
1 1 0 1 1 1
-1 1 0 0 1 0
4 0 1 2 3
"""


def scene(color: dict[str, Any]) -> dict[str, Any]:
    return {
        "version": 1,
        "render": {"size": [40, 30], "spp": 4},
        "camera": {"position": [0, 0, 4], "look_at": [0, 0, 0], "fov": 30},
        "materials": {"stone": {"type": "diffuse", "color": color | {"texels_per_unit": 20}}},
        "objects": [{"mesh": "plane.ply", "material": "stone"}],
        "environment": {"color": [1, 1, 1]},
    }


def render(folder: Path, color: dict[str, Any], *arguments: object) -> tuple[bytes, str]:
    """The image's bytes and the printed lines."""
    if not (BIN / "solidtex-render").exists():
        pytest.skip("built without the renderer")
    (folder / "plane.ply").write_text(PLANE)
    (folder / "scene.json").write_text(json.dumps(scene(color)))
    environment = os.environ | {"SOLIDTEX_MODEL_PATH": str(folder)}
    image = folder / "image.exr"
    result = run("solidtex-render", "scene.json", "-o", image, "--force", *arguments,
                 cwd=folder, env=environment)  # fmt: skip
    assert result.returncode == 0, result.stderr
    return image.read_bytes(), result.stdout + result.stderr


def test_scene_at_a_level_is_the_mixed_model(folder: Path) -> None:
    mixed(folder, "quarter.solidtex", "a.solidtex", "b.solidtex", "--weights", "0.75,0.25")
    expected, _ = render(folder, {"solid": "quarter.solidtex"})
    plane = {"point": [0, 0, -1], "normal": [0, 0, 1]}  # the number is 1 everywhere
    color = {"mix": ["a.solidtex", "pebbles:stone-1"], "blend": "codes", "levels": 4}
    found, _ = render(folder, color | {"by": {"plane": plane, "range": [0, 4]}})
    assert found == expected
    end, _ = render(folder, color | {"by": {"plane": plane, "range": [0, 1]}})
    assert end == render(folder, {"solid": "b.solidtex"})[0]


@pytest.mark.parametrize("blend", ["codes", "outputs"])
def test_scene_has_the_same_bits_with_any_thread_count(folder: Path, blend: str) -> None:
    mixes = {"mix": ["a.solidtex", "b.solidtex"], "blend": blend}
    color = mixes | {"by": {"attribute": "wear"}}
    one, _ = render(folder, color, "--threads", 1)
    assert render(folder, color, "--threads", 3)[0] == one
    reversed_, _ = render(folder, mixes | {"by": {"attribute": "wear", "range": [1, 0]}})
    assert reversed_ != one


def test_scene_blends_codes_of_lattices_and_outputs_of_samplers(folder: Path) -> None:
    color = {"mix": ["a.solidtex", "b.solidtex"], "by": {"attribute": "wear"}}
    found, _ = render(folder, color)
    family = document(folder / "a.solidtex")["family"]
    expected, _ = render(folder, color | {"blend": "codes" if family == "field" else "outputs"})
    other, _ = render(folder, color | {"blend": "outputs" if family == "field" else "codes"})
    assert found == expected
    assert found != other


def test_scene_notes_why_it_blends_outputs(folder: Path) -> None:
    change_document(folder / "a.solidtex", folder / "tuned.solidtex", {"fine_tuned": {}})
    color = {"mix": ["b.solidtex", "tuned.solidtex"], "by": {"sphere": 0.5, "range": [0, 0.4]}}
    _, text = render(folder, color)
    assert "mix of outputs, not of codes: " in text and "expected" not in text
    assert "tuned.solidtex: found a model that was fine-tuned" in text
