"""The procedural textures, and the training of the descriptor on them."""

from pathlib import Path

import pytest
import torch

from solidtex_export.commands import pretrain_descriptor
from solidtex_export.losses.descriptor.network import DescriptorNetwork
from solidtex_export.losses.descriptor.weights import (
    WeightsError,
    feature_deviations,
    load_weights,
    save_weights,
)
from solidtex_export.research.descriptor import pairs, variants
from solidtex_export.research.descriptor.pretrain import PretrainConfig, Pretrainer
from solidtex_export.research.procedural import families
from solidtex_export.research.procedural.color import whitened
from solidtex_export.training.result import ResultFolder


@pytest.mark.parametrize("index", range(families.ROUND))
def test_families(index: int) -> None:
    images = families.batch(seed=3, index=index, count=3, size=48)
    assert images.shape == (3, 3, 48, 48)
    assert images.isfinite().all() and images.min() >= 0 and images.max() <= 1
    assert torch.equal(images, families.batch(3, index, 3, 48))
    assert (images.std((2, 3)).amax(1) > 0.003).all(), "an image shows nothing"
    others = families.batch(4, index, 3, 48)
    assert (images - others).abs().mean() > 0.02
    assert (images[0] - images[1]).abs().mean() > 0.02


def test_whitening_gives_unit_variance_and_uncorrelated_channels() -> None:
    flat = whitened(torch.rand(4, 3, 32, 32)).flatten(2)
    covariance = flat @ flat.transpose(1, 2) / flat.shape[2]
    assert torch.allclose(covariance, torch.eye(3).expand(4, 3, 3), atol=1e-3)


def test_scrambled_keeps_the_spectrum() -> None:
    images = whitened(families.batch(0, 5, 2, 64))
    scrambled = variants.scrambled(images, torch.Generator().manual_seed(1))
    before, after = torch.fft.rfft2(images).abs(), torch.fft.rfft2(scrambled).abs()
    inner = (slice(None), slice(None), slice(1, 32), slice(1, 32))  # no self-conjugate frequency
    assert torch.allclose(before[inner], after[inner], rtol=1e-2, atol=0.1)
    assert (images - scrambled).abs().mean() > 0.3


@pytest.fixture
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    """Pretraining of a few textures only."""
    monkeypatch.setattr(families, "ROUND", 2)
    sizes = {"IMAGE": 96, "CROP": 48, "BATCH": 4, "KEPT_BATCHES": 3, "TEXTURES": 4, "VARIANTS": 4}
    for name, value in sizes.items():
        monkeypatch.setattr(pairs, name, value)


def command(folder: Path, steps: int = 3) -> list[str]:
    return ["--steps", str(steps), "--seed", "5", "-o", str(folder)]


def test_pairs_are_a_function_of_seed_and_step(small: None) -> None:
    wanted = pairs.training_pairs(pairs.Pool(1), 1, 3)
    pool = pairs.Pool(1)
    for step in range(4):
        found = pairs.training_pairs(pool, 1, step)
    assert found.shape == (16, 3, pairs.CROP, pairs.CROP)
    assert torch.equal(found, wanted)
    assert not torch.equal(found, pairs.training_pairs(pairs.Pool(2), 2, 3))


def test_resumed_pretraining_equals_an_uninterrupted_one(small: None, tmp_path: Path) -> None:
    assert pretrain_descriptor.main(command(tmp_path / "whole")) == 0

    folder = ResultFolder(tmp_path / "parts", "test")
    config = PretrainConfig(steps=3, seed=5)
    folder.open(config, [])
    first = Pretrainer(config, folder)
    first.run(stop=lambda: first.step == 2, report=lambda _: None)
    assert pretrain_descriptor.main(command(tmp_path / "parts")) == 0
    one, other = (tmp_path / p / "weights.safetensors" for p in ("whole", "parts"))
    assert one.read_bytes() == other.read_bytes()
    assert load_weights(one).metadata["step"] == 3


def test_a_folder_of_another_pretraining_is_refused(
    small: None, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert pretrain_descriptor.main(command(tmp_path / "a", steps=1)) == 0
    assert pretrain_descriptor.main(command(tmp_path / "a", steps=2)) == 1
    assert "steps: found 1, expected 2" in capsys.readouterr().err


def test_weights_file_names_the_wrong_tensor(tmp_path: Path) -> None:
    network = DescriptorNetwork()
    deviations = feature_deviations(network, torch.randn(2, 3, 64, 64))
    path = tmp_path / "w.safetensors"
    save_weights(path, network, deviations | {"conv9_9": torch.ones(2)}, {})
    with pytest.raises(WeightsError, match=r"conv9_9.deviation: found \(2,\), expected nothing"):
        load_weights(path)
    path.write_bytes(b"nonsense")
    with pytest.raises(WeightsError, match=str(path)):
        load_weights(path)
