"""Writing model files, and what solidtex-info says about them."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from solidtex_export.export import random_models
from solidtex_export.export.file_format.model_file import (
    ModelFile,
    ModelFileError,
    read,
    serialize,
    write,
)
from solidtex_export.export.verification.model_output import OutputError, check_output

REPOSITORY = Path(__file__).resolve().parents[2]
INFO = Path(os.environ.get("SOLIDTEX_BUILD", REPOSITORY / "build")) / "bin" / "solidtex-info"


def small_model() -> ModelFile:
    return random_models.sampler_model(octaves=4, hidden=3, width=8)


def run_info(*arguments: object) -> subprocess.CompletedProcess[str]:
    return subprocess.run([INFO, *map(str, arguments)], capture_output=True, text=True, timeout=60)


def test_what_is_written_is_read(tmp_path: Path) -> None:
    model, path = small_model(), tmp_path / "m.solidtex"
    write(path, model)
    found = read(path)
    assert found.document == model.document
    assert found.tensors.keys() == model.tensors.keys()
    for name, values in model.tensors.items():
        np.testing.assert_array_equal(found.tensors[name], values)
    assert serialize(found) == path.read_bytes()


def test_values_in_any_memory_order_are_written_right(tmp_path: Path) -> None:
    model = small_model()
    name = "hidden.0.weight"
    expected = model.tensors[name].copy()
    model.tensors[name] = np.asfortranarray(expected)
    write(tmp_path / "m.solidtex", model)
    np.testing.assert_array_equal(read(tmp_path / "m.solidtex").tensors[name], expected)


def test_refused_model_leaves_the_old_file(tmp_path: Path) -> None:
    path = tmp_path / "m.solidtex"
    write(path, small_model())
    before = path.read_bytes()
    broken = small_model()
    broken.tensors["constant"][0] = np.nan
    with pytest.raises(ModelFileError, match=r'm\.solidtex: tensor "constant".*nan at element 0'):
        write(path, broken)
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]


def test_doubles_are_refused() -> None:
    model = small_model()
    model.tensors["constant"] = model.tensors["constant"].astype(np.float64)
    with pytest.raises(ModelFileError, match='"constant": found type float64, expected float32'):
        serialize(model)


@pytest.mark.parametrize("value", [float("nan"), Path("x"), {1, 2}, "\ud800"])
def test_a_document_that_is_not_json_is_refused(value: object) -> None:
    model = small_model()
    model.document["training"] = {"value": value}
    with pytest.raises(ModelFileError, match="JSON"):
        serialize(model)


def test_info_describes_the_generator_of_the_paper(tmp_path: Path) -> None:
    path = tmp_path / "lattice.solidtex"
    write(path, random_models.lattice_model())
    report = json.loads(run_info(path, "--json").stdout)
    assert report["verified"] is True
    assert report["file"] == str(path)
    assert report["family"] == "field"
    assert report["parameters"] == sum(v.size for v in read(path).tensors.values())
    noise = {n["level"]: n for n in report["nodes"] if n["op"] == "noise"}
    sizes = [noise[level]["voxel_region"] for level in range(6)]
    # Gutierrez et al. 2020, for a single voxel: 9 380 noise values per channel.
    assert [high - low + 1 for low, high in sizes] == [9, 11, 13, 13, 13, 9]
    assert report["nodes"][-1]["channels"] == len(report["voxel"]["values"]) == 3


def test_info_prints_text(tmp_path: Path) -> None:
    path = tmp_path / "m.solidtex"
    model = small_model()
    model.document["license"] = "CC0-1.0"
    model.document["training"] = {"note": "\x1b[31mred"}
    write(path, model)
    text = run_info(path).stdout
    for expected in (
        str(path),
        "sampler",
        "octaves: 4",
        "CC0-1.0",
        "The structure is valid",
        "\\u001b[31mred",
    ):
        assert expected in text
    assert "\x1b" not in text


def test_info_prints_one_screen_and_more_when_asked() -> None:
    text, more = run_info("granite-grey").stdout, run_info("granite-grey", "--verbose").stdout
    assert len(text.splitlines()) <= 24 and all(len(line) <= 100 for line in text.splitlines())
    old = REPOSITORY / "tests" / "golden" / "models" / "marble.solidtex"  # of an older trainer
    assert "preset lattice, step 1900" in run_info(old).stdout
    assert "preset lattice, step 1500" in text and "leaky_relu" not in text
    assert "noise_channels" in more and "leaky_relu" in more
    assert run_info("granite-grey", "--quiet").stdout == text


def test_info_accepts_paths_that_are_not_utf8(tmp_path: Path) -> None:
    path = os.fsencode(tmp_path) + b"/\xff.solidtex"
    Path(os.fsdecode(path)).write_bytes(serialize(small_model()))
    for arguments in ([path], [path, "--json"]):
        result = subprocess.run([INFO, *arguments], capture_output=True, timeout=60)
        assert result.returncode == 0, result.stderr
        assert "\N{REPLACEMENT CHARACTER}.solidtex" in result.stdout.decode()


def test_info_exit_codes(tmp_path: Path) -> None:
    assert run_info("--help").returncode == 0
    assert re.fullmatch(r"solidtex-info \d+\.\d+\.\d+\n", run_info("--version").stdout)
    assert run_info().returncode == 2
    assert run_info("a.solidtex", "--color").returncode == 2
    assert run_info(tmp_path / "absent.solidtex").returncode == 1


def test_example_of_the_documentation_runs(tmp_path: Path) -> None:
    text = (REPOSITORY / "docs" / "file-format.md").read_text()
    (example,) = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    (tmp_path / "example.py").write_text(example)
    subprocess.run([sys.executable, "example.py"], cwd=tmp_path, check=True, timeout=60)
    result = run_info(tmp_path / "grey-noise.solidtex", "--json")
    assert result.returncode == 0, result.stderr
    report = json.loads(result.stdout)
    (printed,) = re.findall(r"voxel \(0, 0, 0\) is (0\.\d+)", text)
    assert report["voxel"]["values"] == pytest.approx([float(printed)], abs=1e-6)


def test_output_names_in_capitals_are_accepted(tmp_path: Path) -> None:
    check_output(tmp_path / "M.SOLIDTEX", force=False)
    with pytest.raises(OutputError, match=r"found extension '\.npy', expected \.solidtex"):
        check_output(tmp_path / "m.npy", force=False)


def test_a_folder_of_the_same_name_hides_no_model(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "granite-grey").mkdir()
    assert read("granite-grey").document["name"] == "granite-grey"


def test_a_bare_name_is_that_of_an_installed_model() -> None:
    path = REPOSITORY / "models" / "marble.solidtex"
    assert read("marble").document == read(path).document
    with pytest.raises(ModelFileError, match=r'no model is named "marzipan" .*; there are: '):
        read("marzipan")
