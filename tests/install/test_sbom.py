"""Licenses of what solidtex links and compiles in, and the bill of materials of this build."""

from __future__ import annotations

import copy
import importlib.util
import os
import sys
from pathlib import Path
from types import ModuleType

import pytest
from cyclonedx.schema import SchemaVersion
from cyclonedx.validation.json import JsonStrictValidator

REPOSITORY = Path(__file__).resolve().parents[2]
BUILD = Path(os.environ["SOLIDTEX_BUILD"])
PERMISSIVE = {
    "Apache-2.0",
    "Apache-2.0 OR BSD-3-Clause",
    "BSD-2-Clause",
    "BSD-3-Clause",
    "BSL-1.0",
    "MIT",
    "PSF-2.0",
    "libpng-2.0",
}
SYSTEM = {"glibc", "gcc", "linux"}  # of the C and C++ languages themselves
WEAK = {"MPL-2.0"}  # binds changes of the library itself only


def load_sbom() -> ModuleType:
    spec = importlib.util.spec_from_file_location("sbom", REPOSITORY / "setup" / "sbom.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules["sbom"] = module
    spec.loader.exec_module(module)
    return module


sbom = load_sbom()


def sources(files: set[str]) -> dict[str, str | None]:
    """Licenses by source package of these files, without those of the languages."""
    found = {p.source: sbom.license_of(p) for p in sbom.debian_packages(files)}
    return {name: license for name, license in found.items() if name not in SYSTEM}


def linked(binary: Path) -> set[str]:
    paths = sbom.loaded(binary)
    return {paths[name] for name in sbom.needed(binary) if name in paths}


def test_the_library_compiles_in_and_links_permissive_licenses_only() -> None:
    files = sbom.headers(BUILD, ("engine/",)) | linked(BUILD / "lib" / "libsolidtex.so")
    found = sources(files)
    assert {"onetbb", "highway", "nlohmann-json"} <= set(found)
    assert set(found.values()) <= PERMISSIVE, found


def test_all_the_library_loads_is_permissive() -> None:
    found = sources(set(sbom.loaded(BUILD / "lib" / "libsolidtex.so").values()))
    assert set(found.values()) <= PERMISSIVE, found


@pytest.mark.parametrize("part", ["tools/", "plugins/spaces", "plugins/python", "plugins/mesh/"])
def test_only_the_renderer_is_bound_by_strong_licenses(part: str) -> None:
    found = sources(sbom.headers(BUILD, (part,)))
    strong = {name for name, license in found.items() if license not in PERMISSIVE | WEAK}
    assert strong <= {"cgal", "gmp", "mpfr"} if part == "plugins/mesh/" else not strong, found


def test_every_direct_dependency_has_a_license() -> None:
    direct = sbom.direct_packages(BUILD)
    assert {"embree", "openimageio", "openvdb", "nanobind"} <= {p.source for p in direct}
    assert sbom.unlicensed(direct) == []


def test_a_package_without_a_license_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    known = copy.deepcopy(sbom.licenses())
    del known["debian"]["highway"]
    monkeypatch.setattr(sbom, "licenses", lambda: known)
    with pytest.raises(sbom.SbomError, match=r"licenses.toml: found no license of highway"):
        sbom.bill(BUILD)


def test_the_bill_follows_the_schema(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    target = tmp_path / "solidtex.cdx.json"
    assert sbom.main([str(BUILD), "-o", str(target)]) == 0
    text = target.read_text(encoding="utf-8")
    assert JsonStrictValidator(SchemaVersion.V1_6).validate_str(text) is None
    assert '"pkg:deb/debian/libembree' in text and '"pkg:pypi/torch@' in text
    capsys.readouterr()
    assert sbom.main([str(BUILD), "-o", str(target)]) == 1
    assert "exists; --force replaces it" in capsys.readouterr().err
    assert sbom.main([str(tmp_path), "-o", str(tmp_path / "none.json")]) == 1
    assert "expected a finished build" in capsys.readouterr().err
