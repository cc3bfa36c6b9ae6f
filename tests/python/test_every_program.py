"""One rule for every program, in C++ and in Python: docs/command-line.md.

Results are on standard output, with --json as one object; `-o -` writes the file itself there.
Everything else is on standard error.
"""

import importlib
import json
import os
import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import small_spaces
import torch
from PIL import Image
from small_trainings import SMALL, save_photo
from test_import import published_state

from solidtex_export import __version__
from solidtex_export.export import random_models
from solidtex_export.export.file_format import model_file
from solidtex_export.spaces.random_space import Sizes, random_space

REPOSITORY = Path(__file__).resolve().parents[2]
BIN = Path(os.environ["SOLIDTEX_BUILD"]) / "bin"
SCRIPTS = tomllib.loads((REPOSITORY / "python_export/pyproject.toml").read_text())["project"][
    "scripts"
]
FULL = Path("/dev/full")
OPTIONS = ("--help", "--quiet", "--json", "--config", "--completion", "--version")

# Documents of their own: --json FILE of two programs, and the report on a model.
OWN_DOCUMENTS = ("solidtex-bench", "solidtex-eval", "solidtex-info")


@dataclass
class Run:
    """A command of the folder of inputs. OUT is the file that it writes."""

    arguments: str
    out: str = ""
    pipe: str = "-"  # in place of OUT; empty: it writes no single file


RUNS = {
    "solidtex-info": Run("granite-grey", pipe=""),
    "solidtex-bake": Run("granite-grey --size 8 -o OUT", "box.npy", "-.npy"),
    "solidtex-render": Run(
        f"{REPOSITORY}/scenes/meshes/ball-cut.ply --model granite-grey --size 8,6 --spp 1 -o OUT",
        "a.png",
    ),
    "solidtex-mix": Run("pebbles:stone-0 pebbles:stone-1 -o OUT", "mixture.solidtex"),
    "solidtex-encode": Run("photo.png --space pebbles -o OUT", "photo.solidtex"),
    "solidtex-detect": Run("pebbles photo.png --patch 0,0,32,32 -o OUT", "heat.png"),
    "solidtex-bench": Run("noise.uniform --quick --seconds 0.01 --json -", pipe=""),
    "solidtex-train": Run(
        "photo.png -o trained --preset sampler --steps 1 --size 32 SMALL", pipe=""
    ),
    "solidtex-export": Run("result-sampler -o OUT --license CC0-1.0", "result-sampler.solidtex"),
    "solidtex-eval": Run("model.solidtex wall.png --json -", pipe=""),
    "solidtex-measure": Run(
        "volume.npy --voxel-size 1um --axes x --without permeability --representative none",
        pipe="",
    ),
    "solidtex-fidelity": Run("plan.toml -o cells --table table.md", pipe=""),
    "solidtex-export-onnx": Run("model.solidtex -o OUT", "model.onnx"),
    "solidtex-export-shader": Run(
        "model.solidtex --weights constant -o OUT", "model.glsl", "-.glsl"
    ),
    "solidtex-view": Run("model.solidtex -o OUT", "model.html"),
    "solidtex-solids": Run("marble -o . --size 16", pipe=""),
    "solidtex-pretrain-descriptor": Run("-o descriptor --steps 1", pipe=""),
    "solidtex-import-solidtexturenets": Run("params.pytorch -o OUT", "params.solidtex"),
    "solidtex-train-space": Run("photos/list.csv --preset space.toml --steps 1 -o space", pipe=""),
    "solidtex-export-space": Run("space -o OUT", "space.solidtex-space"),
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Inputs of all programs."""
    folder = tmp_path_factory.mktemp("inputs")
    save_photo(folder / "photo.png")
    pixels = np.random.default_rng(1).integers(0, 255, (72, 72, 3), np.uint8)
    Image.fromarray(pixels).save(folder / "wall.png")
    model_file.write(folder / "model.solidtex", random_models.sampler_model(4, 3, 7))
    space = random_space(Sizes(family="sampler", name="pebbles"), seed=3)
    (folder / "pebbles.solidtex-space").write_bytes(space.encode())
    np.save(folder / "volume.npy", np.indices((12,) * 3).sum(0) % 3 > 0)
    torch.save(published_state(), folder / "params.pytorch")
    (folder / "plan.toml").write_text(
        'minutes = 1\nmethods = ["lattice"]\n[[exemplar]]\nname = "a"\nphoto = "volume.npy"\n'
    )
    small_spaces.save_photos(folder / "photos")
    small_spaces.save_preset(folder / "space.toml", "sampler")
    return folder


@dataclass
class Result:
    code: int
    out: bytes
    err: bytes


Execute = Callable[..., Result]


@pytest.fixture
def execute(
    folder: Path,
    monkeypatch: pytest.MonkeyPatch,
    capfdbinary: pytest.CaptureFixture[bytes],
) -> Execute:
    monkeypatch.chdir(folder)
    monkeypatch.setenv("SOLIDTEX_MODEL_PATH", f"{folder}:{REPOSITORY}/models")

    def execute(program: str, *arguments: str) -> Result:
        if program not in SCRIPTS:
            done = subprocess.run([BIN / program, *arguments], capture_output=True, check=False)
            return Result(done.returncode, done.stdout, done.stderr)
        module, _, function = SCRIPTS[program].partition(":")
        capfdbinary.readouterr()
        try:
            code = getattr(importlib.import_module(module), function)(list(arguments))
        except SystemExit as end:
            code = end.code
        return Result(code, *capfdbinary.readouterr())

    return execute


def arguments(program: str, out: str) -> list[str]:
    words = RUNS[program].arguments.replace("OUT", out).split()
    small = [word for key in SMALL["sampler"] for word in ("--set", key)]
    at = words.index("SMALL") if "SMALL" in words else len(words)
    return [*words[:at], *(small if at < len(words) else []), *words[at + 1 :]]


def prepare(program: str, execute: Execute, make_result: Any) -> None:
    """Make the inputs that are results of trainings."""
    if program == "solidtex-export" and not Path("result-sampler").exists():
        make_result("sampler").rename("result-sampler")
    if program == "solidtex-export-space":
        execute("solidtex-train-space", *arguments("solidtex-train-space", ""))


def lacks_onnxruntime(result: Result) -> bool:
    """Builds without ONNX Runtime encode nothing, and say so."""
    return result.code == 1 and b"ONNX Runtime" in result.err


def test_commands_load_without_the_packages_of_extras() -> None:
    commands = sorted((REPOSITORY / "python_export/solidtex_export/commands").glob("*.py"))
    code = f"""
import sys
from importlib import import_module
for name in ("jinja2", "matplotlib", "nrrd", "onnx", "onnxruntime", "tifffile", "wgpu"):
    sys.modules[name] = None
for command in {[path.stem for path in commands]}:
    import_module(f"solidtex_export.commands.{{command}}")
"""
    subprocess.run([sys.executable, "-c", code], check=True)


def test_every_program_is_in_the_list() -> None:
    built = {path.name for path in BIN.glob("solidtex-*")}
    assert set(RUNS) == built | set(SCRIPTS)


@pytest.mark.parametrize("program", RUNS)
def test_it_has_the_options_that_all_have(program: str, execute: Execute) -> None:
    text = execute(program, "--help").out.decode()
    assert all(option in text for option in OPTIONS)
    version = execute(program, "--version").out.decode()
    assert version == f"{program} {__version__}\n"
    wrong = execute(program, "--nonsense")
    assert wrong.code == 2 and wrong.out == b"" and wrong.err.startswith(program.encode())
    if program not in SCRIPTS:  # argparse names what is missing first
        assert b"found an unknown option --nonsense" in wrong.err


@pytest.mark.parametrize("program", RUNS)
def test_results_are_one_object(program: str, execute: Execute, make_result: Any) -> None:
    prepare(program, execute, make_result)
    out = RUNS[program].out
    options = arguments(program, out)
    result = execute(program, *options, *(["--json"] if "--json" not in options else []))
    if lacks_onnxruntime(result):
        pytest.skip("built without ONNX Runtime")
    assert result.code == 0, result.err.decode()
    document = json.loads(result.out)
    if program in OWN_DOCUMENTS:
        return
    assert document["program"] == program and document["version"] == __version__
    files = document.get("files", [])
    assert all(Path(file).is_file() for file in files)
    assert not out or out in files


@pytest.mark.parametrize("program", [name for name, run in RUNS.items() if run.pipe])
def test_the_file_goes_to_standard_output(program: str, execute: Execute, make_result: Any) -> None:
    run = RUNS[program]
    prepare(program, execute, make_result)
    if not Path(run.out).exists() and lacks_onnxruntime(
        execute(program, *arguments(program, run.out))
    ):
        pytest.skip("built without ONNX Runtime")
    expected = Path(run.out).read_bytes()
    Path(run.out).unlink()
    piped = execute(program, *arguments(program, run.pipe))
    assert piped.code == 0, piped.err.decode()
    assert piped.out == expected
    assert tempfile.gettempdir().encode() not in piped.err  # where the file was meanwhile
    both = execute(program, *arguments(program, run.pipe), "--json")
    assert both.code == 2 and both.out == b"" and b"both are for standard output" in both.err


@pytest.mark.skipif(not FULL.exists(), reason="the system has no /dev/full")
@pytest.mark.parametrize("options", ["-o -", "-o a.html", "-o b.html --json"])
def test_a_full_standard_output_is_named(options: str, tmp_path: Path) -> None:
    code = "import sys; from solidtex_export.commands.launch import view; sys.exit(view())"
    command = [sys.executable, "-c", code, "granite-grey", "--wasm", "none", *options.split()]
    buffered = {k: v for k, v in os.environ.items() if k != "PYTHONUNBUFFERED"}
    with FULL.open("wb") as full:
        done = subprocess.run(command, stdout=full, stderr=subprocess.PIPE, text=True, check=False,
                              cwd=tmp_path, env=buffered)  # fmt: skip
    assert done.returncode == 1
    last = "solidtex-view: standard output: cannot write: No space left on device"
    assert done.stderr.splitlines()[-1] == last


def test_several_files_do_not_go_to_standard_output(execute: Execute) -> None:
    for program, words in (
        ("solidtex-bake", "granite-grey --size 8 -o -.nhdr"),
        ("solidtex-export-shader", "model.solidtex -o -.glsl --weights texture"),
        ("solidtex-export-shader", "granite-grey -o -.wgsl"),
    ):
        refused = execute(program, *words.split())
        assert refused.code in (1, 2) and refused.out == b""
        assert b"found -" in refused.err and b"expected a file" in refused.err
