"""Writes the page: models, exported shaders and the script in one file."""

from __future__ import annotations

import base64
import json
from collections.abc import Sequence
from dataclasses import dataclass
from importlib import resources
from pathlib import Path

from solidtex_export.export.file_format.model_file import ModelFile
from solidtex_export.export.shader.emitter import TEXTURE_WIDTH
from solidtex_export.export.shader.shader import shader
from solidtex_export.export.shader.tables import OCTAVE_WORDS

SCRIPTS = ("meshes.js", "webgl.js", "webgpu.js", "view.js")
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
    models = json.dumps([_material(m) for m in materials], separators=(",", ":"))
    # No end of the script inside a string.
    models = models.replace("</", "<\\/")
    return html.replace("/*MODELS*/[]", models).replace("/*SCRIPT*/", script)


def _material(material: Material) -> dict[str, object]:
    model = material.model
    glsl = shader(model, ".glsl", FUNCTION, "texture", "half")
    wgsl = shader(model, ".wgsl", FUNCTION, "texture", "half")
    assert glsl.data is not None
    return {
        "name": model.document["name"],
        "octaves": model.document["sampler"]["octaves"],
        "octaveWords": OCTAVE_WORDS,
        "width": TEXTURE_WIDTH,
        "data": base64.b64encode(glsl.data.tobytes()).decode(),
        "glsl": glsl.text,
        "wgsl": wgsl.text,
        "exemplar": _data_url(material.exemplar) if material.exemplar else None,
    }


def _data_url(path: Path) -> str:
    return (
        f"data:{MIME_TYPES[path.suffix.lower()]};base64,"
        f"{base64.b64encode(path.read_bytes()).decode()}"
    )
