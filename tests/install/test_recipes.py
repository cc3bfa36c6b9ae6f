"""Recipes of package managers: as far as they can be read here, where none can be built."""

import ast
import json
import os
import re
import subprocess
from pathlib import Path

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
)


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
    assert [(CONDA.parent / s["path"]).resolve() for s in made["source"]] == [REPOSITORY]
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
    needed = (REPOSITORY / "engine" / "CMakeLists.txt").read_text()
    packages = {"TBB": "tbb", "hwy": "highway", "nlohmann_json": "nlohmann-json"}
    found = re.findall(r"^find_package\((\w+) REQUIRED", needed, re.M)
    assert {packages[n] for n in found if n != "Threads"} == {n for n in names if "cmake" not in n}


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
    assert set(re.findall(r"\+(\w+)", " ".join(conditions))) == variants
