"""There is one version number: CMake's."""

import re
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import pytest

import solidtex_export

REPOSITORY = Path(__file__).resolve().parents[2]


def test_package_has_the_version_of_the_cmake_project() -> None:
    text = (REPOSITORY / "CMakeLists.txt").read_text()
    match = re.search(r"project\(solidtex VERSION (\S+)", text)
    assert match and solidtex_export.__version__ == match[1]


def test_installed_package_has_the_same_version() -> None:
    try:
        installed = version("solidtex-export")
    except PackageNotFoundError:
        pytest.skip("the package is not installed, only on PYTHONPATH")
    assert installed == solidtex_export.__version__
