"""Recipes of package managers: as far as they can be read here, where none can be built."""

import ast
import contextlib
import json
import os
import re
import runpy
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest

import solidtex

REPOSITORY = Path(__file__).resolve().parents[2]
BUILD = Path(os.environ["SOLIDTEX_BUILD"])
PACKAGING = REPOSITORY / "setup" / "packaging"
CONDA = PACKAGING / "conda" / "recipe.yaml"
PORT = PACKAGING / "vcpkg" / "solidtex"
SPACK = PACKAGING / "spack" / "packages" / "solidtex" / "package.py"
OPTIONS = set(
    re.findall(r"^option\((SOLIDTEX_\w+)", (REPOSITORY / "CMakeLists.txt").read_text(), re.M)
) | {"SOLIDTEX_VALIJSON_INCLUDE"}
# What CMake looks for, and its names in conda-forge, Spack and vcpkg. None: no dependency there.
NAMES: dict[str, tuple[str | None, str | None, str | None]] = {
    "CGAL": ("cgal-cpp", "cgal", None),
    "CLI11": ("cli11", "cli11", None),
    "Imath": ("imath", None, None),  # Spack: by way of openexr
    "OpenEXR": ("openexr", "openexr", None),
    "OpenImageIO": ("openimageio", "openimageio", None),
    "PNG": ("libpng", "libpng", None),
    "PkgConfig": ("pkg-config", "pkgconfig", None),
    "TBB": ("tbb-devel", "intel-oneapi-tbb", "tbb"),
    "Threads": (None, None, None),
    "benchmark": ("benchmark", "benchmark", None),
    "blosc": ("blosc", "c-blosc", None),
    "embree": ("embree", "embree", None),
    "fmt": ("fmt", "fmt", None),
    "glm": ("glm", "glm", None),
    "hwy": ("libhwy", "highway", "highway"),
    "isa-l/crc.h": ("isa-l", "isa-l", None),
    "isal": ("isa-l", "isa-l", None),
    "nanovdb/NanoVDB.h": (None, None, None),
    "nlohmann_json": ("nlohmann_json", "nlohmann-json", "nlohmann-json"),
    "onnxruntime": (None, None, None),
    "onnxruntime_cxx_api.h": (None, None, None),
    "openvdb": ("openvdb", "openvdb", None),
    "openvdb/openvdb.h": ("openvdb", "openvdb", None),
    "valijson/validator.hpp": (None, "valijson", None),  # conda: a source of the recipe
}
BUILDS = {
    "cmake",
    "ninja",
    "c",
    "cxx",
    "pkg-config",
    "pkgconfig",
    "vcpkg-cmake",
    "vcpkg-cmake-config",
}


def looked_for() -> set[str]:
    """By CMake for library, programs and renderer."""
    found: set[str] = set()
    for folder in (
        "engine",
        "cmake",
        "tools",
        "plugins/mesh",
        "plugins/spaces",
        "plugins/pathtracer",
    ):
        for file in (REPOSITORY / folder).rglob("*"):
            if file.suffix != ".cmake" and file.name != "CMakeLists.txt":
                continue
            if file.name == "openimageio_of_host.cmake":
                continue  # for the plugin of another OpenImageIO
            text = file.read_text()
            found |= set(re.findall(r"(?:find_package|pkg_check_modules)\((\w+)", text))
            found |= set(re.findall(r"find_(?:path|library)\(\w+ ([\w./-]+)", text))
    return found


def test_every_dependency_has_a_name() -> None:
    assert looked_for() == set(NAMES)


@pytest.mark.parametrize("recipe", [CONDA, PORT / "portfile.cmake", SPACK], ids=lambda p: p.name)
def test_options_are_those_of_cmake(recipe: Path) -> None:
    used = set(re.findall(r"SOLIDTEX_\w+", recipe.read_text()))
    assert used and used <= OPTIONS


def test_the_conda_recipe_renders() -> None:
    rattler = pytest.importorskip("rattler_build", reason="py-rattler-build is not installed")
    library = {"c_stdlib": ["sysroot"], "c_stdlib_version": ["2.28"]}
    recipe = rattler.Stage0Recipe.from_yaml(CONDA.read_text())
    (variant,) = recipe.render(rattler.VariantConfig(library))
    made = variant.recipe.to_dict()
    assert made["package"] == {"name": "solidtex", "version": solidtex.__version__}
    clone, valijson = made["source"]
    assert (CONDA.parent / clone["path"]).resolve() == REPOSITORY
    assert valijson["url"].endswith(".tar.gz") and re.fullmatch(r"[0-9a-f]{64}", valijson["sha256"])
    needed = {str(n) for part in ("build", "host") for n in made["requirements"][part]}
    needed = {n.split()[0] for n in needed if not n.startswith(("gcc_", "gxx_", "sysroot_"))}
    # FindPNG of CMake needs the headers of zlib.
    assert needed - BUILDS == {names[0] for names in NAMES.values() if names[0]} - BUILDS | {"zlib"}
    assert (REPOSITORY / made["about"]["license_file"][0]).is_file()
    (test,) = made["tests"]
    for line in test["script"]:
        assert (BUILD / "bin" / line.split()[0]).is_file()


def test_the_vcpkg_port_configures_this_repository(tmp_path: Path) -> None:
    """Its script runs with functions that print in place of vcpkg's."""
    manifest = json.loads((PORT / "vcpkg.json").read_text())
    assert manifest["name"] == PORT.name and manifest["version"] == solidtex.__version__
    names = [d if isinstance(d, str) else d["name"] for d in manifest["dependencies"]]
    assert names == sorted(names) and all(re.fullmatch(r"[a-z0-9-]+", name) for name in names)
    script = (PORT / "portfile.cmake").read_text()
    functions = sorted(set(re.findall(r"^(vcpkg_\w+)\(", script, re.M)))
    printing = [
        f'function({name})\nmessage("{name} ${{ARGV}}")\nendfunction()' for name in functions
    ]
    play = [*printing, f"include({PORT / 'portfile.cmake'})"]
    (tmp_path / "play.cmake").write_text("\n".join(play))
    command = [
        "cmake",
        f"-DCURRENT_PACKAGES_DIR={tmp_path}",
        "-P",
        str(tmp_path / "play.cmake"),
    ]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert f"vcpkg_cmake_configure SOURCE_PATH;{REPOSITORY};OPTIONS" in done.stderr
    # The library needs what the port names, and the port what the library needs.
    assert set(names) - BUILDS == {n[2] for n in NAMES.values() if n[2]}


def test_the_spack_package_imports_what_it_uses(monkeypatch: pytest.MonkeyPatch) -> None:
    """It runs with functions that do nothing in place of Spack's, in the modules that have them."""
    modules = {
        "spack.package": ["depends_on", "license", "variant", "version"],
        "spack_repo.builtin.build_systems.cmake": ["generator"],
    }
    for path, functions in modules.items():
        parts = path.split(".")
        for length in range(1, len(parts) + 1):
            name = ".".join(parts[:length])
            monkeypatch.setitem(sys.modules, name, ModuleType(name))
        for function in functions:
            setattr(sys.modules[path], function, lambda *_, **__: None)
    sys.modules["spack.package"].when = lambda _: contextlib.nullcontext()  # type: ignore[attr-defined]
    base = {name: lambda *words: words[1] for name in ("define", "define_from_variant")}
    cmake = sys.modules["spack_repo.builtin.build_systems.cmake"]
    cmake.CMakePackage = type("CMakePackage", (), base)  # type: ignore[attr-defined]
    package = runpy.run_path(str(SPACK))["Solidtex"]
    assert set(package().cmake_args()) <= OPTIONS


def test_the_spack_package_uses_its_variants() -> None:
    (package,) = [n for n in ast.parse(SPACK.read_text()).body if isinstance(n, ast.ClassDef)]
    calls = [n for n in ast.walk(package) if isinstance(n, ast.Call)]

    def texts(function: str, index: int) -> list[str]:
        return [
            ast.literal_eval(c.args[index])
            for c in calls
            if ast.unparse(c.func).removeprefix("self.") == function
        ]

    variants = set(texts("variant", 0))
    assert variants == set(texts("define_from_variant", 1))
    conditions = [ast.literal_eval(k.value) for c in calls for k in c.keywords if k.arg == "when"]
    conditions += texts("when", 0)
    assert set(re.findall(r"[+~](\w+)", " ".join(conditions))) == variants
    needed = {re.split("[@+~]", name)[0] for name in texts("depends_on", 0)}
    assert needed - BUILDS == {names[1] for names in NAMES.values() if names[1]} - BUILDS


@pytest.mark.parametrize("renderer", ["ON", "OFF"])
@pytest.mark.parametrize("tools", ["ON", "OFF"])
def test_the_options_of_programs_are_independent(tools: str, renderer: str, tmp_path: Path) -> None:
    """Spack's variants `tools` and `renderer`."""
    on = {"TOOLS": tools, "RENDERER": renderer}
    off = dict.fromkeys(("OPENIMAGEIO", "PYTHON", "TESTS"), "OFF")
    options = [f"-DSOLIDTEX_BUILD_{name}={value}" for name, value in {**on, **off}.items()]
    command = ["cmake", "-S", REPOSITORY, "-B", tmp_path, "-G", "Ninja", *options]
    subprocess.run(command, capture_output=True, check=True)
    made = set(
        re.findall(r"^build bin/solidtex-(\w+):", (tmp_path / "build.ninja").read_text(), re.M)
    )
    expected = {"bake", "bench", "detect", "encode", "info", "mix"} if tools == "ON" else set()
    assert made == expected | ({"render"} if renderer == "ON" else set())
