"""Writes the page: models, exported shaders and the script in one file."""

from __future__ import annotations

import base64
import json
from collections.abc import Sequence
from dataclasses import dataclass
from importlib import resources
from pathlib import Path

from solidtex_export.export.file_format.checks import ModelFileError
from solidtex_export.export.file_format.model_file import ModelFile
from solidtex_export.export.shader.emitter import TEXTURE_WIDTH
from solidtex_export.export.shader.lattice import fragment_source, lattice_program
from solidtex_export.export.shader.network import color_channels
from solidtex_export.export.shader.shader import shader
from solidtex_export.export.shader.tables import OCTAVE_WORDS
from solidtex_export.generators.regions import Box, alignment

SCRIPTS = (
    "meshes.js", "bricks.js", "webgl.js", "lattice_webgl.js", "webgpu.js", "lattice_webgpu.js",
    "view.js",
)  # fmt: skip
BRICK = 32
"""Voxels along each axis that a page computes at once, as bricks.js has it."""
MAX_NUMBERS = 2**22
"""Weights in the largest texture of which every WebGPU is capable: 8192 rows of 128 texels."""
FUNCTION = "solidtex_solid"
MIME_TYPES = {".jpg": "image/jpeg", ".jpeg": "image/jpeg", ".png": "image/png"}


@dataclass(frozen=True)
class Material:
    model: ModelFile
    exemplar: Path | None = None


def page(materials: Sequence[Material]) -> str:
    source = resources.files(__package__)
    html = source.joinpath("page.html").read_text()
    script = "\n".join(source.joinpath(name).read_text() for name in SCRIPTS)
    script = script.replace('/*FRAGMENTS*/""', json.dumps(fragment_source()))
    models = json.dumps([_material(m) for m in materials], separators=(",", ":"))
    # No end of the script inside a string.
    models = models.replace("</", "<\\/")
    return html.replace("/*MODELS*/[]", models).replace("/*SCRIPT*/", script)


def _material(material: Material) -> dict[str, object]:
    model = material.model
    numbers = sum(tensor.size for tensor in model.tensors.values())
    if numbers > MAX_NUMBERS:
        raise ModelFileError(
            f"{model.document['name']}: found {numbers} weights, expected at most {MAX_NUMBERS},"
            " for which every browser has room; train a smaller network"
        )
    make = _sampler if model.document["family"] == "sampler" else _lattice
    exemplar = _data_url(material.exemplar) if material.exemplar else None
    return {"name": model.document["name"], "exemplar": exemplar, **make(model)}


def _sampler(model: ModelFile) -> dict[str, object]:
    glsl = shader(model, ".glsl", FUNCTION, "texture", "half")
    wgsl = shader(model, ".wgsl", FUNCTION, "texture", "half")
    assert glsl.data is not None
    return {
        "octaves": model.document["sampler"]["octaves"],
        "octaveWords": OCTAVE_WORDS,
        "width": TEXTURE_WIDTH,
        "data": _base64(glsl.data.tobytes()),
        "glsl": glsl.text,
        "wgsl": wgsl.text,
    }


def _lattice(model: ModelFile) -> dict[str, object]:
    """Passes of the brick at 0, with a voxel more on each side: all others are shifted."""
    nodes = model.document["field"]["nodes"]
    if alignment(nodes) > BRICK:
        raise ModelFileError(
            f"{model.document['name']}: found voxels of {alignment(nodes)} texels, expected at most"
            f" {BRICK}, which a page computes at once; train it with fewer levels"
        )
    program = lattice_program(model)
    passes = program.passes(Box((-1,) * 3, (BRICK + 1,) * 3))
    lattice = {
        "wgsl": program.source,
        "weights": _base64(program.weights.tobytes()),
        "passes": [p.document() for p in passes],
        "output": passes[-1].step.name,
        "color": color_channels(model),
    }
    return {"lattice": lattice}


def _base64(data: bytes) -> str:
    return base64.b64encode(data).decode()


def _data_url(path: Path) -> str:
    return f"data:{MIME_TYPES[path.suffix.lower()]};base64,{_base64(path.read_bytes())}"
