"""Writes the page: models, exported shaders and the script in one file."""

from __future__ import annotations

import base64
import gzip
import itertools
import json
from collections.abc import Sequence
from dataclasses import dataclass
from importlib import resources
from pathlib import Path

from solidtex_export.export.file_format.checks import ModelFileError
from solidtex_export.export.file_format.model_file import ModelFile, serialize
from solidtex_export.export.shader.emitter import TEXTURE_WIDTH
from solidtex_export.export.shader.lattice import fragment_source, lattice_program
from solidtex_export.export.shader.network import color_channels
from solidtex_export.export.shader.shader import shader
from solidtex_export.export.shader.tables import OCTAVE_WORDS
from solidtex_export.export.verification.model_output import OutputError
from solidtex_export.generators.regions import Box, alignment

SCRIPTS = (
    "meshes.js", "rabbit.js", "bricks.js", "webgl.js", "lattice_webgl.js", "webgpu.js",
    "lattice_webgpu.js", "webassembly.js", "view.js",
)  # fmt: skip
PACKAGE_SCRIPTS = ("solidtex-fast.mjs", "index.mjs")
"""Of the npm package: one module, which engine_worker.js imports."""
PACKAGE_WASM = "solidtex-fast.wasm"
PACKAGE = Path(__file__).resolve().parents[4] / "build" / "wasm" / "package"
"""Where the CMake target solidtex_wasm of a checkout writes the package."""
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


def package_folder(given: Path | None = None) -> Path | None:
    """The folder of the npm package: the given one, or else a built one, or None."""
    if given is None and not PACKAGE.exists():
        return None
    package = given or PACKAGE
    if not package.is_dir():
        raise OutputError(f"{package}: found no such folder, expected that of the npm package")
    for name in (*PACKAGE_SCRIPTS, PACKAGE_WASM):
        if not (package / name).is_file():
            raise OutputError(
                f"{package}: found no {name}, expected the folder that the CMake target"
                " solidtex_wasm writes"
            )
    return package


def distinct_names(names: Sequence[str]) -> list[str]:
    """Number names that repeat: a, a-2, a-3. The menu and the address of the page need one each."""
    distinct: list[str] = []
    for name in names:
        numbered = (f"{name}-{number}" for number in itertools.count(2))
        taken = {*names, *distinct} if name in distinct else distinct
        distinct.append(next(n for n in itertools.chain([name], numbered) if n not in taken))
    return distinct


def page(materials: Sequence[Material], package: Path | None = None) -> str:
    """`package` is the folder of the npm package, whose engine draws where nothing else can."""
    source = resources.files(__package__)
    html = source.joinpath("page.html").read_text()
    script = "\n".join(source.joinpath(name).read_text() for name in SCRIPTS)
    script = script.replace('/*FRAGMENTS*/""', json.dumps(fragment_source()))
    names = distinct_names([m.model.document["name"] for m in materials])
    models = [
        _material(m, package is not None) | {"name": name}
        for m, name in zip(materials, names, strict=True)
    ]
    html = html.replace("/*MODELS*/[]", _inside_script(models))
    html = html.replace("/*ENGINE*/null", _inside_script(_engine(package)))
    return html.replace("/*SCRIPT*/", script)


def _inside_script(value: object) -> str:
    return json.dumps(value, separators=(",", ":")).replace("</", "<\\/")


def _engine(package: Path | None) -> dict[str, str] | None:
    if package is None:
        return None
    worker = resources.files(__package__).joinpath("engine_worker.js").read_text()
    script = "\n".join(package.joinpath(name).read_text() for name in PACKAGE_SCRIPTS)
    wasm = package.joinpath(PACKAGE_WASM).read_bytes()
    files = {"worker": worker.encode(), "script": script.encode(), "wasm": wasm}
    return {name: _packed(data) for name, data in files.items()}


def _material(material: Material, with_file: bool) -> dict[str, object]:
    model = material.model
    numbers = sum(tensor.size for tensor in model.tensors.values())
    if numbers > MAX_NUMBERS:
        raise ModelFileError(
            f"{model.document['name']}: found {numbers} weights, expected at most {MAX_NUMBERS},"
            " for which every browser has room; train a smaller network"
        )
    make = _sampler if model.document["family"] == "sampler" else _lattice
    exemplar = _data_url(material.exemplar) if material.exemplar else None
    file = {"file": _packed(serialize(model)), "color": color_channels(model)} if with_file else {}
    return {"name": model.document["name"], "exemplar": exemplar, **make(model), **file}


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


def _packed(data: bytes) -> str:
    return _base64(gzip.compress(data, mtime=0))


def _base64(data: bytes) -> str:
    return base64.b64encode(data).decode()


def _data_url(path: Path) -> str:
    return f"data:{MIME_TYPES[path.suffix.lower()]};base64,{_base64(path.read_bytes())}"
