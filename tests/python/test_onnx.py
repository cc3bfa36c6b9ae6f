"""solidtex-export-onnx: ONNX Runtime computes what the engine and the float64 reference compute."""

import json
import re
import shlex
import sys
from pathlib import Path
from typing import Any

import numpy as np
import onnx
import onnxruntime
import pytest

from solidtex import Texture
from solidtex_export.commands import export_onnx
from solidtex_export.export import random_models
from solidtex_export.export.file_format import model_file
from solidtex_export.export.file_format.model_file import ModelFile
from solidtex_export.export.onnx import inputs as onnx_inputs
from solidtex_export.export.verification import reference, verify

REPOSITORY = Path(__file__).resolve().parents[2]
SHIPPED = [model_file.read(path) for path in sorted((REPOSITORY / "models").glob("*.solidtex"))]
FAMILIES = {
    family: [model for model in SHIPPED if model.document["family"] == family]
    for family in ("field", "sampler")
}
BOXES = [
    ((0, 0, 0), (9, 8, 7)),
    ((-37, 5, -3), (8, 9, 10)),
    ((31, -33, 64), (1, 1, 1)),
    ((2**30 - 3, -(2**30), 12345), (3, 2, 5)),
]
FAR = (1000.0, -2000.0, 0.5)


def published_noise_model() -> ModelFile:
    model = random_models.lattice_model(3, 2, 3)
    model.document["noise"]["scheme"] = "solidtexturenets"
    return model


def reserved_names_model() -> ModelFile:
    """Nodes are called what the graph would call its own."""
    nodes = [
        {"name": "values", "op": "noise", "level": 1, "channels": 2, "distribution": "normal"},
        {"name": "c.weight", "op": "tanh", "inputs": ["values"]},
        {"name": "scales", "op": "upsample", "inputs": ["c.weight"]},
        {"name": "c", "op": "conv3d", "inputs": ["scales"], "out_channels": 3, "kernel": 3},
    ]
    rng = np.random.default_rng(0)
    shapes = {"c.weight": (3, 2, 3, 3, 3), "c.bias": (3,)}
    tensors = {name: rng.normal(size=shape).astype(np.float32) for name, shape in shapes.items()}
    return ModelFile(random_models.document("field", {"nodes": nodes, "output": "c"}), tensors)


def bare_noise_model() -> ModelFile:
    nodes = [{"name": "z", "op": "noise", "level": 0, "channels": 3, "distribution": "uniform"}]
    return ModelFile(random_models.document("field", {"nodes": nodes, "output": "z"}), {})


def phase_model() -> ModelFile:
    model = bare_noise_model()
    model.document["field"]["nodes"].append({"name": "p", "op": "softmax", "inputs": ["z"]})
    model.document["field"]["output"] = "p"
    return model


def with_maps(model: ModelFile, last: str) -> ModelFile:
    """The model with two channels more, from a wider last layer."""
    for key in (f"{last}.weight", f"{last}.bias"):
        values = model.tensors[key]
        model.tensors[key] = np.concatenate([values, 0.5 * values[:2]])
    model.document["channels"] += ["roughness", "height"]
    if model.document["family"] == "field":
        model.document["field"]["nodes"][-1]["out_channels"] = 5
    return model


FIELDS = {
    **{model.document["name"]: model for model in FAMILIES["field"]},
    "every operation": random_models.every_operation_model(),
    "K=3 M_i=1 M_s=13": random_models.lattice_model(4, 1, 13),
    "published noise": published_noise_model(),
    "reserved names": reserved_names_model(),
    "bare noise": bare_noise_model(),
    "phases": phase_model(),
    "five channels": with_maps(random_models.lattice_model(3, 2, 3), "last_conv"),
}
SAMPLERS = {
    **{model.document["name"]: model for model in FAMILIES["sampler"]},
    "n=1 L=2 m=1": random_models.sampler_model(1, 2, 1),
    "n=9 L=4 m=33": random_models.sampler_model(9, 4, 33),
    "five channels": with_maps(random_models.sampler_model(4, 3, 8), "output"),
}


class Exported:
    """A model written to files, and a session of its ONNX export."""

    def __init__(self, folder: Path, model: ModelFile, *options: str) -> None:
        self.solidtex, self.onnx = folder / "m.solidtex", folder / "m.onnx"
        model_file.write(self.solidtex, model)
        assert export_onnx.main([str(self.solidtex), *options, "-o", str(self.onnx)]) == 0
        providers = ["CPUExecutionProvider"]
        self.session = onnxruntime.InferenceSession(self.onnx, providers=providers)
        self.metadata = self.session.get_modelmeta().custom_metadata_map

    def box(self, origin: tuple[int, ...], seed: int) -> np.ndarray:
        """[x, y, z, channel]"""
        inputs = onnx_inputs.block_inputs(self.metadata, origin, seed)
        return self.session.run(["values"], inputs)[0][0].transpose(1, 2, 3, 0)

    def points(self, positions: np.ndarray, seed: int) -> np.ndarray:
        inputs = onnx_inputs.point_inputs(self.metadata, positions, seed)
        return self.session.run(["values"], inputs)[0]


def triple(values: tuple[int, ...]) -> str:
    return ",".join(map(str, values))


@pytest.mark.parametrize("name", FIELDS)
@pytest.mark.parametrize(("origin", "size"), BOXES)
def test_blocks(name: str, origin: Any, size: Any, tmp_path: Path) -> None:
    model = FIELDS[name]
    options = (f"--origin={triple(origin)}", f"--size={triple(size)}")
    found = Exported(tmp_path, model, *options).box(origin, seed=3)
    assert found.shape == (*size, len(model.document["channels"]))
    assert verify.distance(found, reference.evaluate_box(model, origin, size, 3)) <= verify.BOUND
    with Texture(tmp_path / "m.solidtex", seed=3) as texture:
        assert verify.distance(found, texture.eval_box(origin, size)) <= verify.BOUND


def test_one_graph_serves_all_aligned_origins(tmp_path: Path) -> None:
    model = FAMILIES["field"][0]
    exported = Exported(tmp_path, model, "--origin=-5,0,7", "--size=6,3,4")
    origin = (-5 - 3 * 32, 32, 7 + 2**25)
    expected = reference.evaluate_box(model, origin, (6, 3, 4), 8)
    assert verify.distance(exported.box(origin, 8), expected) <= verify.BOUND
    with pytest.raises(onnx_inputs.InputError, match=r"expected \[-5, 0, 7\] plus multiples of 32"):
        exported.box((-5, 16, 7), 8)


@pytest.mark.parametrize("name", SAMPLERS)
def test_points(name: str, tmp_path: Path) -> None:
    exported = Exported(tmp_path, SAMPLERS[name])
    for count in (1, 37):
        near = np.random.default_rng(count).uniform(-9, 9, (count, 3)).astype(np.float32)
        positions = near.astype(np.float64) + np.array(FAR)
        found = exported.points(positions, seed=3)
        expected = reference.evaluate_points(SAMPLERS[name], positions, 3)
        assert verify.distance(found, expected) <= verify.BOUND
        with Texture(exported.solidtex, seed=3) as texture:
            evaluated = texture.eval_points(near, FAR)
        assert verify.distance(found, evaluated) <= verify.BOUND


def test_metadata_says_what_the_inputs_are(tmp_path: Path) -> None:
    model = FAMILIES["field"][0]
    exported = Exported(tmp_path, model, "--size=64")
    document = json.loads(exported.metadata["solidtex"])
    for key in ("name", "channels", "color_space", "noise", "license", "exemplar"):
        assert document[key] == model.document[key]
    assert document["box"] == {"lo": [0, 0, 0], "hi": [64, 64, 64]}
    assert document["alignment"] == 32
    coarsest, *_, finest = document["inputs"]
    assert coarsest["level"] == 5 and finest["level"] == 0
    assert finest["lo"] == [-4, -4, -4] and finest["hi"] == [68, 68, 68]
    shapes = {value.name: value.shape for value in exported.session.get_inputs()}
    assert shapes == {
        node["name"]: [1, node["channels"], *np.subtract(node["hi"], node["lo"])]
        for node in document["inputs"]
    }
    onnx.checker.check_model(onnx.load(exported.onnx), full_check=True)


def test_inputs_of_the_wrong_family_are_refused(tmp_path: Path) -> None:
    exported = Exported(tmp_path, SAMPLERS["n=1 L=2 m=1"])
    with pytest.raises(onnx_inputs.InputError, match="sampler family, expected the lattice family"):
        exported.box((0, 0, 0), 0)
    with pytest.raises(onnx_inputs.InputError, match=r"found shape \(3,\)"):
        exported.points(np.zeros(3), 0)
    for place in (np.nan, 2.0**31):
        with pytest.raises(ValueError, match="in row 0, expected finite coordinates"):
            exported.points(np.full((1, 3), place), 0)
    with pytest.raises(ValueError, match="seed: found -1, expected a whole number from 0"):
        exported.points(np.zeros((1, 3)), -1)
    with pytest.raises(onnx_inputs.InputError, match="found no key 'solidtex'"):
        onnx_inputs.point_inputs({}, np.zeros((1, 3)))
    later = {"solidtex": json.dumps({"version": 2})}
    with pytest.raises(onnx_inputs.InputError, match="found version 2, expected 1"):
        onnx_inputs.point_inputs(later, np.zeros((1, 3)))


def test_outputs_are_not_replaced_without_force(tmp_path: Path, capsys: Any) -> None:
    Exported(tmp_path, SAMPLERS["n=1 L=2 m=1"])
    model, output = tmp_path / "m.solidtex", tmp_path / "m.onnx"
    output.write_bytes(b"old")
    assert export_onnx.main([str(model), "-o", str(output)]) == 1
    assert f"{output}: found an existing file" in capsys.readouterr().err
    assert output.read_bytes() == b"old"
    assert export_onnx.main([str(model), "-o", str(output), "--force"]) == 0
    assert output.read_bytes() != b"old"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["m.onnx", "m.solidtex"]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["MODEL", "-o", "m.png"], "found extension '.png', expected .onnx"),
        (["MODEL", "-o", "no/m.onnx"], "found no folder"),
        (["absent.solidtex", "-o", "m.onnx"], "absent.solidtex: cannot read"),
        (["MODEL", "--size", "8", "-o", "m.onnx"], "--size: found it with"),
        (["MODEL", "--origin", "0,0,0", "-o", "m.onnx"], "--origin: found it with"),
    ],
)
def test_what_cannot_be_exported_is_named(
    arguments: list[str], message: str, tmp_path: Path, capsys: Any, monkeypatch: Any
) -> None:
    monkeypatch.chdir(tmp_path)
    model_file.write("MODEL", SAMPLERS["n=1 L=2 m=1"])
    assert export_onnx.main(arguments) == 1
    assert message in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["MODEL"]


def test_a_missing_onnx_package_is_named(tmp_path: Path, capsys: Any, monkeypatch: Any) -> None:
    for module in ("model", "field", "sampler", "graph"):
        monkeypatch.delitem(sys.modules, f"solidtex_export.export.onnx.{module}", raising=False)
    monkeypatch.setitem(sys.modules, "onnx", None)
    model_file.write(tmp_path / "m.solidtex", SAMPLERS["n=1 L=2 m=1"])
    assert export_onnx.main([str(tmp_path / "m.solidtex"), "-o", str(tmp_path / "m.onnx")]) == 1
    message = capsys.readouterr().err
    assert "found no Python package 'onnx'" in message and "pip install onnx" in message


@pytest.mark.parametrize(
    ("arguments", "code", "text"),
    [
        (["--help"], 0, "examples:"),
        (["--version"], 0, "0."),
        ([], 2, "--help for all options"),
        (["m", "-o", "m.onnx", "--size", "0"], 2, "expected 1 to 4096 along each axis"),
        (["m", "-o", "m.onnx", "--size", "1,2"], 2, "expected integers X,Y,Z"),
    ],
)
def test_usage(arguments: list[str], code: int, text: str, capsys: Any) -> None:
    with pytest.raises(SystemExit) as exit_info:
        export_onnx.main(arguments)
    assert exit_info.value.code == code
    printed = capsys.readouterr()
    assert text in printed.out + printed.err


def test_the_page_runs(tmp_path: Path, monkeypatch: Any, capsys: Any) -> None:
    page = (REPOSITORY / "docs" / "onnx.md").read_text()
    monkeypatch.chdir(tmp_path)
    (tmp_path / "models").symlink_to(REPOSITORY / "models")
    for command in re.findall(r"^\.venv/bin/solidtex-export-onnx (.*)", page, re.MULTILINE):
        assert export_onnx.main(shlex.split(command)) == 0
    capsys.readouterr()
    programs = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    exec("".join(programs), {})
    assert capsys.readouterr().out.splitlines() == re.findall(r"# (\([\d, ]+\))", page)
    assert (tmp_path / "granite.png").stat().st_size > 1000
