"""The descriptor of `--descriptor`, with untrained weights: they go the whole way, and move slices.

What trained weights are worth no test here can tell.
"""

from __future__ import annotations

import hashlib
import json
from pathlib import Path

import pytest
import torch
from small_trainings import begin

from solidtex_export.commands import train as cli_train
from solidtex_export.losses.descriptor.network import DescriptorNetwork
from solidtex_export.losses.descriptor.weights import (
    DISTILLED,
    PROCEDURAL,
    feature_deviations,
    load_weights,
    save_weights,
)
from solidtex_export.losses.learned import LearnedDescriptor, random_axes


@pytest.fixture(scope="module")
def weights(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A file as solidtex-pretrain-descriptor writes it, of a network that is not trained."""
    torch.manual_seed(0)
    network = DescriptorNetwork()
    path = tmp_path_factory.mktemp("descriptor") / "weights.safetensors"
    deviations = feature_deviations(network, torch.randn(2, 3, 64, 64))
    save_weights(path, network, deviations, {"step": 0})
    return path


@pytest.fixture
def descriptor(weights: Path) -> LearnedDescriptor:
    torch.manual_seed(1)
    return LearnedDescriptor(load_weights(weights))


def arguments(photo: Path, result: Path, *more: str) -> list[str]:
    settings = ["generator.sizes.levels=3", "generator.sizes.step_channels=2", "slicing.passes=1"]
    settings += ["losses.descriptor.descriptor=learned"]
    sets = [part for setting in settings for part in ("--set", setting)]
    sizes = ["--size", "32", "--resolution", "48", "--device", "cpu", "--steps", "4"]
    return [str(photo), "-o", str(result), "--method", "gutierrez", *sets, *sizes, *more]


@torch.no_grad()
def test_images_have_no_distance_to_themselves(descriptor: LearnedDescriptor) -> None:
    images = torch.randn(1, 3, 64, 64)
    stripes = images.cumsum(2) / 8
    itself = descriptor.measure(images)
    assert float(descriptor.distance(images, itself)) == pytest.approx(0, abs=1e-6)
    assert float(descriptor.distance(images, descriptor.measure(stripes))) > 1e-3


@pytest.mark.parametrize("channels", [1, 2, 3, 5])
def test_every_channel_gets_a_gradient(descriptor: LearnedDescriptor, channels: int) -> None:
    fakes = torch.randn(1, channels, 64, 64, requires_grad=True)
    target = descriptor.measure(torch.randn(1, channels, 70, 70).cumsum(2))
    loss = descriptor.distance(fakes, target)
    (gradient,) = torch.autograd.grad(loss, fakes)
    assert gradient.isfinite().all()
    assert (gradient.abs().amax((0, 2, 3)) > 0).all()


def test_features_are_named_and_of_five_scales(descriptor: LearnedDescriptor) -> None:
    features = descriptor.features(torch.randn(1, 3, 96, 96), torch.randn(2, 3, 100, 90))
    sides = {name: pair[0].shape[2] for name, pair in features.items()}
    relus = {"relu1_1": 94, "relu1_2": 92, "relu2_1": 44, "relu2_2": 42, "relu3_1": 21}
    relus |= {"relu3_2": 21, "relu4_1": 10, "relu5_1": 5}
    pools = {"pool1": 46, "pool2": 21, "pool3": 10, "pool4": 5, "pool5": 2}
    assert sides == relus | pools
    centered = [name for name, (_, real) in features.items() if abs(real.mean()) < 1e-3]
    assert set(relus) <= set(centered)  # pooling drops the last of an odd number of rows


@pytest.mark.parametrize("channels", [1, 2, 3, 5])
def test_random_axes_are_orthonormal(channels: int) -> None:
    axes = random_axes(channels)
    small = axes @ axes.T if channels > 3 else axes.T @ axes
    assert torch.allclose(small, torch.eye(min(channels, 3)), atol=1e-5)


def test_training_resumes_to_the_same_bits(weights: Path, photo: Path, tmp_path: Path) -> None:
    whole, parts = tmp_path / "whole", tmp_path / "parts"
    options = ("--descriptor", str(weights))
    assert cli_train.main(arguments(photo, whole, *options)) == 0
    first = begin(*arguments(photo, parts, *options))
    first.run(lambda: first.step == 2, lambda _: None)
    assert cli_train.main(arguments(photo, parts, *options)) == 0
    one, other = (torch.load(r / "checkpoint.pt", weights_only=True) for r in (whole, parts))
    for key, value in one["generator"].items():
        assert torch.equal(value, other["generator"][key]), key
    record = json.loads((whole / "config.json").read_text())["descriptor"]
    sha256 = hashlib.sha256(weights.read_bytes()).hexdigest()
    assert record == {"file": "weights.safetensors", "sha256": sha256}


def test_without_a_file_the_shipped_weights_are_used(photo: Path, tmp_path: Path) -> None:
    assert cli_train.main(arguments(photo, tmp_path / "r")) == 0
    record = json.loads((tmp_path / "r" / "config.json").read_text())["descriptor"]
    assert record["sha256"] == hashlib.sha256(DISTILLED.read_bytes()).hexdigest()
    for shipped in (DISTILLED, PROCEDURAL):
        trained = load_weights(shipped).metadata
        assert trained["step"] == trained["steps"]


def test_a_file_is_refused_by_methods_that_do_not_use_it(
    weights: Path, photo: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    other = ["--set", "losses.descriptor.enabled=false", "--set", "losses.spectrum.weight=1"]
    other += ["--descriptor", str(weights)]
    with pytest.raises(SystemExit):
        cli_train.main(arguments(photo, tmp_path / "r", *other))
    assert "--descriptor: found a file for preset gutierrez" in capsys.readouterr().err


def test_a_file_that_does_not_fit_leaves_no_result(
    weights: Path, photo: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file, result = tmp_path / "w.safetensors", tmp_path / "r"

    def message() -> str:
        assert cli_train.main(arguments(photo, result, "--descriptor", str(file))) == 1
        assert not result.exists()
        error = capsys.readouterr().err
        assert str(file) in error
        return error

    assert "found no such file, expected weights" in message()
    file.write_bytes(weights.read_bytes()[:-100])
    assert "found no readable safetensors" in message()
    narrow = DescriptorNetwork(((4, 48), (96, 96), (128, 128), (128,), (128,)))
    save_weights(file, narrow, feature_deviations(narrow, torch.randn(2, 3, 64, 64)), {})
    assert "conv1_1.bias: found (4,), expected (48,)" in message()
    broken = load_weights(weights)
    broken.network.conv2_1.bias[3] = torch.nan
    save_weights(file, broken.network, broken.deviations, {})
    assert "conv2_1.bias: found a value that is not finite" in message()
