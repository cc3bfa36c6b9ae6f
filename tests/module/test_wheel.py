"""`pip wheel .`: a wheel that carries library and models, and gives the values of the build."""

import os
import re
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

import solidtex

REPOSITORY = Path(__file__).resolve().parents[2]
BUILD = Path(os.environ["SOLIDTEX_BUILD"])
PROGRAM = """
import solidtex
assert solidtex.__file__.startswith({site!r}), solidtex.__file__
texture = solidtex.Texture("granite-grey", seed=2)
assert texture.path.startswith({site!r}), texture.path
print(texture.eval_box((5, -6, 7), (2, 3, 4)).tobytes().hex())
"""


def run(*command: object, **options: object) -> str:
    done = subprocess.run(list(map(str, command)), capture_output=True, text=True, **options)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def check_hardening(file: Path, *wanted: str) -> None:
    """SOLIDTEX_HARDENED, as the ELF file tells it."""
    sections = ("-l", "-d", "--dyn-syms")
    segments, flags, symbols = (run("readelf", "-W", section, file) for section in sections)
    assert "GNU_RELRO" in segments, file
    assert re.search(r"FLAGS_1.* NOW", flags), f"{file}: RELRO leaves out the functions"
    assert re.search(r"GNU_STACK.* RW ", segments), f"{file}: the stack can be executed"
    for symbol in ("__stack_chk_fail", *wanted):
        assert symbol in symbols, f"{file}: {symbol}"


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Without isolation, so that nothing is downloaded; objects are kept for the next time.

    For the oldest instruction set alone, hardly optimized and without the programs: the same bits,
    and much less to compile.
    """
    pytest.importorskip("scikit_build_core", reason="scikit-build-core is not installed")
    folder = tmp_path_factory.mktemp("wheel")
    options = ["--no-index", "--no-deps", "--no-build-isolation"]
    kept = ["--config-settings", f"build-dir={BUILD / 'wheel'}"]
    quick = ["--config-settings", "cmake.define.CMAKE_CXX_FLAGS=-DHWY_COMPILE_ONLY_STATIC"]
    quick += ["--config-settings", "cmake.define.CMAKE_CXX_FLAGS_RELEASE=-O1 -DNDEBUG"]
    for part in ("TOOLS", "RENDERER"):
        quick += ["--config-settings", f"cmake.define.SOLIDTEX_BUILD_{part}=OFF"]
    run(sys.executable, "-m", "pip", "wheel", REPOSITORY, "-w", folder, *options, *kept, *quick)
    (file,) = folder.iterdir()
    return file


def test_content(wheel: Path) -> None:
    version = solidtex.__version__
    assert wheel.name.startswith(f"solidtex-{version}-cp")
    with zipfile.ZipFile(wheel) as archive:
        names = set(archive.namelist())
        metadata = archive.read(f"solidtex-{version}.dist-info/METADATA").decode()
    for name in ("__init__.py", "texture.py", "mitsuba.py", "py.typed", "_engine.pyi"):
        assert f"solidtex/{name}" in names
    models = {f"solidtex/share/solidtex/{p.relative_to(REPOSITORY)}"
              for p in (REPOSITORY / "models").glob("*.solidtex")}  # fmt: skip
    assert models and models <= names
    libraries = {f"solidtex/lib/libsolidtex.so.{'.'.join(version.split('.')[:2])}"}
    if "SOLIDTEX_ONNXRUNTIME_FILE:INTERNAL=/" in (BUILD / "CMakeCache.txt").read_text():
        libraries.add("solidtex/lib/solidtex/libonnxruntime.so.1")  # which the linker does not know
    assert {n for n in names if n.startswith("solidtex/lib/")} == libraries
    assert any(n.endswith("licenses/LICENSE") for n in names)
    extra = {n for n in names if not n.startswith(("solidtex/", f"solidtex-{version}.dist-info/"))}
    assert not extra
    assert "Requires-Dist: numpy" in metadata and "License-Expression: Apache-2.0" in metadata


def test_installed_it_is_hardened_and_gives_the_values_of_the_build(
    wheel: Path, tmp_path: Path
) -> None:
    site = tmp_path / "site"
    run(sys.executable, "-m", "pip", "install", wheel, "--target", site, "--no-index", "--no-deps")
    (library,) = (site / "solidtex" / "lib").glob("libsolidtex.so*")
    check_hardening(library, "_chk@", "glibcxx_assert_fail")
    environment = {**os.environ, "PYTHONPATH": str(site)}
    environment.pop("SOLIDTEX_MODEL_PATH", None)
    program = PROGRAM.format(site=str(site))
    found = run(sys.executable, "-B", "-c", program, env=environment, cwd=tmp_path)
    texture = solidtex.Texture("granite-grey", seed=2)
    assert found.strip() == texture.eval_box((5, -6, 7), (2, 3, 4)).tobytes().hex()
    command = [site / "bin" / "solidtex-info", "granite-grey"]
    lacking = subprocess.run(command, capture_output=True, text=True, env=environment)
    assert lacking.returncode == 1 and "solidtex-info: found no such program" in lacking.stderr


@pytest.mark.skipif(not os.environ.get("SOLIDTEX_LONG_TESTS"), reason="compiles everything")
def test_a_wheel_with_all_programs_runs_in_a_new_environment(tmp_path: Path) -> None:
    """With the libraries of this system in it, as setup/wheel.sh makes it."""
    pytest.importorskip("auditwheel", reason="auditwheel is not installed")
    run(REPOSITORY / "setup" / "wheel.sh", tmp_path / "wheels", sys.executable)
    (wheel,) = (tmp_path / "wheels").iterdir()
    assert "manylinux" in wheel.name
    run(sys.executable, "-m", "venv", tmp_path / "new")
    bin = tmp_path / "new" / "bin"
    run(bin / "pip", "install", wheel)
    environment = {k: v for k, v in os.environ.items() if not k.startswith(("SOLIDTEX", "PYTHON"))}
    shown = run(bin / "python", "-c", "import solidtex; print(solidtex.models())", env=environment)
    assert "granite-grey" in shown
    for name in ("render", "bake", "info", "bench", "encode", "mix", "detect"):
        run(bin / f"solidtex-{name}", "--version", env=environment, cwd=tmp_path)
    site = next((tmp_path / "new").glob("lib/python*/site-packages/solidtex"))
    for program in (site / "bin").iterdir():
        check_hardening(program, "_chk@", "glibcxx_assert_fail")
        assert "PIE" in run("readelf", "-W", "-d", program), "a fixed address"
    run(bin / "solidtex-bake", "marble", "--size", 8, "-o", "a.npy", env=environment, cwd=tmp_path)
    photograph = REPOSITORY / "docs" / "images" / "granite-grey.png"
    options = ["--space", "stones", "-o", "a.solidtex"]
    run(bin / "solidtex-encode", photograph, *options, env=environment, cwd=tmp_path)
    mesh = REPOSITORY / "scenes" / "meshes" / "ball-cut.ply"
    options = ["--model", "marble", "--size", "8,6", "--spp", 1, "-o", "a.png"]
    run(bin / "solidtex-render", mesh, *options, env=environment, cwd=tmp_path)
    assert (tmp_path / "a.npy").is_file() and (tmp_path / "a.png").is_file()
