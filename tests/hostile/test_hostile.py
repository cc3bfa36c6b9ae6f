"""Every hostile file is refused by both readers, with an error that says what is wrong."""

import os
import subprocess
from pathlib import Path

import pytest
from base_files import valid_files
from make_hostile import HostileFile, hostile_files

from solidtex_export.export.file_format.model_file import ModelFileError, read

REPOSITORY = Path(__file__).resolve().parents[2]
BUILD = Path(os.environ.get("SOLIDTEX_BUILD", REPOSITORY / "build"))
HOSTILE = list(hostile_files())
VALID = valid_files()


def run_info(path: Path) -> subprocess.CompletedProcess[str]:
    """The engine's reader, through the program that is made of it."""
    program = BUILD / "bin" / "solidtex-info"
    return subprocess.run([program, path], capture_output=True, text=True, timeout=60)


def check_message(message: str, path: Path, expected: tuple[str, ...]) -> None:
    missing = [word for word in (str(path), *expected) if word not in message]
    assert not missing, f"no {missing} in: {message}"
    assert len(message.strip().splitlines()) == 1
    assert len(message) < 1000


def test_list_is_long_and_names_are_unique() -> None:
    assert len(HOSTILE) >= 40
    assert len({file.name for file in HOSTILE}) == len(HOSTILE)


@pytest.mark.parametrize("file", HOSTILE, ids=lambda file: file.name)
def test_python_refuses(file: HostileFile, tmp_path: Path) -> None:
    path = file.write(tmp_path)
    with pytest.raises(ModelFileError) as caught:
        read(path)
    check_message(str(caught.value), path, file.expected)


@pytest.mark.parametrize("file", HOSTILE, ids=lambda file: file.name)
def test_engine_refuses(file: HostileFile, tmp_path: Path) -> None:
    path = file.write(tmp_path)
    result = run_info(path)
    assert result.returncode == 1  # a signal is negative
    assert result.stdout == ""
    check_message(result.stderr, path, file.expected)


@pytest.mark.parametrize("name", VALID)
def test_both_accept_what_is_valid(name: str, tmp_path: Path) -> None:
    path = tmp_path / f"{name}.solidtex"
    path.write_bytes(VALID[name])
    assert read(path).document["name"].startswith("tiny-")
    result = run_info(path)
    assert (result.returncode, result.stderr) == (0, "")
    assert "The structure is valid" in result.stdout


def test_both_name_what_cannot_be_read(tmp_path: Path) -> None:
    for path in (tmp_path / "absent.solidtex", tmp_path):
        with pytest.raises(ModelFileError, match="cannot read"):
            read(path)
    result = run_info(tmp_path / "absent.solidtex")
    assert result.returncode == 1
    assert "absent.solidtex: cannot read: No such file" in result.stderr
