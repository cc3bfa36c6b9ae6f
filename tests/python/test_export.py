"""solidtex-export: what it writes, and above all what it refuses to write."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

from solidtex import Texture
from solidtex_export.commands import export
from solidtex_export.export import fold
from solidtex_export.export.file_format import model_file
from solidtex_export.export.training_result import read_result
from solidtex_export.export.verification import verify
from solidtex_export.export.verification.networks import lattice_network

FAMILIES = ["field", "sampler"]


@pytest.mark.parametrize("family", FAMILIES)
def test_exported_model_is_the_network(family: str, make_result: Any, tmp_path: Path) -> None:
    result, output = make_result(family), tmp_path / "stone.solidtex"
    assert export.main([str(result), "-o", str(output), "--license", "Apache-2.0"]) == 0
    model = model_file.read(output)
    document = model.document
    assert document["name"] == "stone"
    assert document["family"] == family
    assert document["license"] == "Apache-2.0"
    exemplar = {"file": "0.png", "sha256": "0" * 63 + "1", "license": "CC0-1.0", "source": "a test"}
    assert document["exemplar"] == exemplar
    assert document["training"]["step"] == 12
    assert document["training"]["size"] == 128
    network = export.unfolded_network(read_result(result))
    with Texture(output, seed=9) as texture:
        found = texture.eval_box((-5, 100, 3), (4, 3, 5))
    expected = network((-5, 100, 3), (4, 3, 5), 9)
    assert verify.distance(found, expected) <= verify.BOUND
    assert [path.name for path in tmp_path.glob("*.solidtex*")] == ["stone.solidtex"]


def test_several_photographs_are_all_named(make_result: Any, tmp_path: Path) -> None:
    output = tmp_path / "cube.solidtex"
    assert export.main([str(make_result("field", 3)), "-o", str(output), "--name", "Cube"]) == 0
    document = model_file.read(output).document
    assert [e["file"] for e in document["exemplar"]] == ["0.png", "1.png", "2.png"]
    assert document["name"] == "Cube" and "license" not in document


def corrupted_norm(folder: Any, name: str) -> tuple[torch.Tensor, torch.Tensor]:
    """A batch normalization with another epsilon: close, and wrong."""
    gamma, beta = folder.parameters(name)
    mean, variance = (folder.state[f"{name}.running_{what}"] for what in ("mean", "var"))
    scale = gamma / torch.sqrt(variance + 1e-3)
    return scale, beta - mean * scale


def test_a_wrong_fold_is_refused(
    make_result: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Any
) -> None:
    result, output = make_result("field"), tmp_path / "stone.solidtex"
    monkeypatch.setattr(fold._Folder, "norm", corrupted_norm)
    assert export.main([str(result), "-o", str(output)]) == 1
    message = capsys.readouterr().err
    assert f"expected at most {verify.BOUND:g}; nothing was written" in message
    assert "away from the float64 network" in message
    assert not list(tmp_path.glob("*.solidtex*")) and not list(tmp_path.glob(".*.solidtex*"))


@pytest.mark.parametrize("family", FAMILIES)
def test_one_changed_weight_is_refused_and_the_old_file_stays(
    family: str, make_result: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Any
) -> None:
    result, output = make_result(family), tmp_path / "stone.solidtex"
    output.write_bytes(b"old")
    kind = type(read_result(result).generator)
    whole = export._FOLDERS[kind]

    def corrupted(generator: Any) -> Any:
        architecture, tensors = whole(generator)
        name = next(name for name in tensors if name.endswith("weight"))
        tensors[name] = tensors[name].copy()
        tensors[name].flat[0] += 0.05
        return architecture, tensors

    monkeypatch.setitem(export._FOLDERS, kind, corrupted)
    assert export.main([str(result), "-o", str(output), "--force"]) == 1
    assert "nothing was written" in capsys.readouterr().err
    assert output.read_bytes() == b"old"
    assert not list(tmp_path.glob(".*.solidtex*"))


def test_an_engine_that_differs_is_refused(
    make_result: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Not a number is no small difference."""
    evaluate = Texture.eval_box
    monkeypatch.setattr(Texture, "eval_box", lambda *args: evaluate(*args) * np.float32(np.nan))
    output = tmp_path / "stone.solidtex"
    assert export.main([str(make_result("sampler")), "-o", str(output)]) == 1
    assert not output.exists()


def test_networks_differ_if_parameters_do(make_result: Any) -> None:
    """What the export compares with does depend on the trained network."""
    generator = read_result(make_result("field")).generator
    before = lattice_network(generator, "solidtex-1")((0, 0, 0), (2, 2, 2), 0)
    with torch.no_grad():
        generator.get_submodule("up1.bn").bias += 0.1
    after = lattice_network(generator, "solidtex-1")((0, 0, 0), (2, 2, 2), 0)
    assert verify.distance(before, after) > verify.BOUND


def edit_config(folder: Path, key: str, value: Any) -> None:
    path = folder / "config.json"
    config = json.loads(path.read_text())
    config[key] = value
    path.write_text(json.dumps(config))


@pytest.mark.parametrize(
    ("break_it", "message"),
    [
        (lambda f: (f / "config.json").unlink(), "config.json: found no such file"),
        (lambda f: (f / "checkpoint.pt").unlink(), "checkpoint.pt: found no such file"),
        (lambda f: (f / "config.json").write_text("["), "config.json: file: found text"),
        (lambda f: (f / "checkpoint.pt").write_bytes(b"x"), "no checkpoint that loads safely"),
        (
            lambda f: torch.save({"generator": Path("x")}, f / "checkpoint.pt"),
            "(it is damaged, or holds more than tensors, which could run code)",
        ),
        (lambda f: torch.save([1], f / "checkpoint.pt"), "generator: found no state dict"),
        (lambda f: torch.save({"generator": {}}, f / "checkpoint.pt"), "cb1_1.conv1.weight: found"),
        (lambda f: edit_config(f, "family", "mesh"), 'config.json: family: found "mesh"'),
        (lambda f: edit_config(f, "exemplars", []), "config.json: exemplars: found 0 entries"),
        (lambda f: edit_config(f, "generator", {"levels": 2}), "does not fit config.json"),
        (lambda f: edit_config(f, "generator", {"depth": 2}), "does not fit config.json"),
    ],
)
def test_broken_results_are_named(
    break_it: Any, message: str, make_result: Any, tmp_path: Path, capsys: Any
) -> None:
    result = make_result("field")
    break_it(result)
    assert export.main([str(result), "-o", str(tmp_path / "m.solidtex")]) == 1
    assert message in capsys.readouterr().err
    assert not list(tmp_path.glob("*.solidtex"))


def test_outputs_are_not_replaced_without_force(
    make_result: Any, tmp_path: Path, capsys: Any
) -> None:
    result, output = make_result("field"), tmp_path / "m.solidtex"
    output.write_bytes(b"old")
    assert export.main([str(result), "-o", str(output)]) == 1
    assert "--force" in capsys.readouterr().err
    assert output.read_bytes() == b"old"
    assert export.main([str(result), "-o", str(tmp_path / "m.png")]) == 1
    assert "expected .solidtex" in capsys.readouterr().err
    assert export.main([str(result), "-o", str(tmp_path / "no" / "m.solidtex")]) == 1
    assert "found no folder" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "code", "text"),
    [(["--help"], 0, "examples:"), (["--version"], 0, "0."), ([], 2, "See solidtex-export --help")],
)
def test_usage(arguments: list[str], code: int, text: str, capsys: Any) -> None:
    with pytest.raises(SystemExit) as exit_info:
        export.main(arguments)
    assert exit_info.value.code == code
    printed = capsys.readouterr()
    assert text in printed.out + printed.err
