"""From a code to a model: the engine agrees with numpy, and with itself through file and memory."""

import hashlib
from pathlib import Path

import numpy as np
import pytest
from safetensors.numpy import load_file
from space_files import KINDS, axes, decode, write

import solidtex
from solidtex_export.spaces.random_space import random_space


@pytest.mark.parametrize("kind", KINDS)
def test_model_has_the_tensors_that_numpy_computes(kind: str, tmp_path: Path) -> None:
    made = random_space(KINDS[kind], seed=3)
    space = solidtex.Space(write(tmp_path, kind, made))
    material = space.photograph(2)
    space.write_model(material, tmp_path / "m.solidtex")
    found = load_file(tmp_path / "m.solidtex")
    expected = decode(made, material.code.astype(np.float64), material.colors)
    assert set(found) == set(expected)
    for name, values in expected.items():
        assert found[name].shape == values.shape, name
        scale = np.abs(values).max()
        assert np.abs(found[name] - values).max() <= 1e-6 * scale, name


@pytest.mark.parametrize("kind", KINDS)
def test_texture_and_written_file_have_the_same_bits(kind: str, tmp_path: Path) -> None:
    space = solidtex.Space(write(tmp_path, kind))
    material = space.blend([space.photograph(0), space.photograph(3)], [0.3, 0.7])
    details = {"name": "mine", "license": "MIT", "exemplar": {"file": "a.jpg"}}
    for name in ("a", "b"):
        space.write_model(material, tmp_path / f"{name}.solidtex", details)
    assert (tmp_path / "a.solidtex").read_bytes() == (tmp_path / "b.solidtex").read_bytes()
    written = solidtex.Texture(tmp_path / "a.solidtex", seed=5)
    opened = space.texture(material, seed=5, details=details)
    box = ((-7, 3, 1 << 20), (5, 6, 7))
    assert written.eval_box(*box).tobytes() == opened.eval_box(*box).tobytes()
    assert written.eval_box(*box).std() > 1e-3
    assert written.metadata == opened.metadata
    assert written.metadata["license"] == "MIT" and written.name == "mine"
    assert "license" not in written.metadata["training"]["space"]


def test_a_model_records_where_it_is_from(tmp_path: Path) -> None:
    path = write(tmp_path, "bounded")
    space = solidtex.Space(path)
    material = space.photograph(1)
    training = space.texture(material, details={"training": {"patches": "medoid"}}).metadata[
        "training"
    ]
    assert training["patches"] == "medoid"
    record = training["space"]
    assert record["name"] == "bounded"
    assert record["sha256"] == hashlib.sha256(path.read_bytes()).hexdigest() == space.sha256
    assert np.array_equal(np.float32(record["code"]), material.code)
    assert np.array_equal(np.float32(record["colors"]), material.colors)
    assert space.texture(material).metadata["license"] == record["license"] == "CC0-1.0"


def test_facts(tmp_path: Path) -> None:
    space = solidtex.Space(write(tmp_path, "linear"))
    assert (space.name, space.family, space.code_size) == ("linear", "sampler", 4)
    assert not space.has_colors and space.photograph(0).colors is None
    assert (space.patch_size, space.resolution) == (32, 64)
    assert space.photographs == tuple(f"stone-{i}" for i in range(5))
    assert space.metadata["photographs"][1]["license"] == "CC0-1.0"
    assert "linear" in repr(space)
    assert solidtex.Space(write(tmp_path, "lattice")).family == "lattice"


def test_blend_of_one_material_keeps_its_colors(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    space = solidtex.Space(write(tmp_path, "lattice"))
    image = rng.uniform(0, 1, (40, 50, 3)) * [1, 0.5, 0.2] + 0.1
    material = solidtex.Material(np.float32([1, -2, 0, 0.5]), axes(image).astype(np.float32))
    same = space.blend([material], [2])
    assert material.colors is not None and same.colors is not None
    assert np.array_equal(same.code, material.code)
    assert np.abs(same.colors - material.colors).max() < 1e-6


def test_blend_of_two_has_the_mean_of_means_and_covariances(tmp_path: Path) -> None:
    space = solidtex.Space(write(tmp_path, "lattice"))
    parts = [space.photograph(i) for i in range(2)]
    blended = space.blend(parts, [1, 1])
    assert blended.colors is not None
    mean = np.mean([p.colors[:, 3] for p in parts], axis=0)  # type: ignore[index]
    assert np.abs(blended.colors[:, 3] - mean).max() < 1e-6
    covariance = np.mean([p.colors[:, :3] @ p.colors[:, :3].T for p in parts], axis=0)  # type: ignore[index]
    assert np.abs(blended.colors[:, :3] @ blended.colors[:, :3].T - covariance).max() < 1e-6
    basis = blended.colors[:, :3]
    assert np.abs(basis.T @ basis - np.diag(np.diag(basis.T @ basis))).max() < 1e-6


def test_wrong_arguments_are_refused(tmp_path: Path) -> None:
    space = solidtex.Space(write(tmp_path, "lattice"))
    good = space.photograph(0)
    with pytest.raises(solidtex.InvalidArgument, match=r"code: found shape \(3,\)"):
        space.texture(solidtex.Material(np.zeros(3, np.float32), good.colors))
    with pytest.raises(solidtex.InvalidArgument, match="colors: found None"):
        space.texture(solidtex.Material(good.code))
    with pytest.raises(solidtex.InvalidArgument, match=r"code\[0\] is nan"):
        space.texture(solidtex.Material(np.full(4, np.nan, np.float32), good.colors))
    with pytest.raises(solidtex.InvalidArgument, match="sum of weights"):
        space.blend([good, good], [1, -1])
    with pytest.raises(solidtex.InvalidArgument, match="index: found 5"):
        space.photograph(5)
    with pytest.raises(solidtex.ModelError, match="license"):
        space.write_model(good, tmp_path / "m.solidtex", {"license": 3})
    assert not (tmp_path / "m.solidtex").exists()


def test_a_model_is_no_space_and_a_space_no_model(tmp_path: Path) -> None:
    path = write(tmp_path, "lattice")
    space = solidtex.Space(path)
    space.write_model(space.photograph(0), tmp_path / "m.solidtex")
    with pytest.raises(solidtex.ModelError, match="this is a model, expected a texture space"):
        solidtex.Space(tmp_path / "m.solidtex")
    with pytest.raises(solidtex.ModelError, match="this is a texture space, expected a model"):
        solidtex.Texture(path)


def test_names_are_found_in_the_model_folders(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write(tmp_path, "lattice")
    monkeypatch.setenv("SOLIDTEX_MODEL_PATH", str(tmp_path))
    assert Path(solidtex.Space("lattice").path) == tmp_path / "lattice.solidtex-space"
    with pytest.raises(solidtex.FileError, match=r'space is named "x" \(.*there are: .*lattice'):
        solidtex.Space("x")
    with pytest.raises(solidtex.FileError, match=r'named "Lattice", but one "lattice" \(a path'):
        solidtex.Space("Lattice")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("SOLIDTEX_MODEL_PATH", "")
    told = r'named "lattice"; lattice.solidtex-space is a file: name it so$'
    with pytest.raises(solidtex.FileError, match=told):
        solidtex.Space("lattice")
