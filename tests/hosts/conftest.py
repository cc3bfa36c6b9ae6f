"""Fixtures of several files."""

from pathlib import Path

import pytest


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with Blender's extension, as one command writes it."""
    from test_blender_extension import package

    package(tmp_path)
    return tmp_path
