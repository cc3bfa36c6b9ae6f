"""Distances of SqueezeNet features and likelihoods of patches: definitions and purposes."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import torch
import torch.nn.functional as F
from PIL import Image
from safetensors.torch import load_file, save_file
from scipy.stats import multivariate_normal
from textures_2d import blobs, blurred, shuffled

from solidtex_export.commands import evaluate as command
from solidtex_export.evaluation.comparison import Reference, Settings
from solidtex_export.evaluation.metrics import standard_metrics
from solidtex_export.evaluation.metrics.frechet import frechet_distance, shrunk_moments
from solidtex_export.evaluation.metrics.parzen import (
    KERNELS,
    SAMPLES,
    ParzenWindows,
    random_patches,
)
from solidtex_export.networks.squeezenet import (
    FIRES,
    SqueezeNet,
    WeightsError,
    load_squeezenet,
)

REPOSITORY = Path(__file__).resolve().parents[2]
TRAINED = REPOSITORY / "shared" / "features" / "squeezenet-v1.0.safetensors"
FEATURE_METRICS = ("feature_distance", "feature_sifid")


@pytest.fixture
def weights(tmp_path: Path) -> Path:
    """A file of random weights, stored as the published ones are: convolutions in float16."""
    path = tmp_path / "squeezenet.safetensors"
    state = SqueezeNet().state_dict()
    save_file({k: v.half() if k.endswith("weight") else v for k, v in state.items()}, path)
    return path


def distances(weights: Path, exemplar: np.ndarray, other: np.ndarray) -> dict[str, float]:
    settings = Settings(side=80, symmetry="all", features=weights)
    found = Reference(exemplar, settings).distances([other])
    return {name: found[name].multiple or 0.0 for name in FEATURE_METRICS}


def test_feature_distances_tell_textures_apart(weights: Path) -> None:
    same = distances(weights, blobs(1), blobs(2))
    for other in (
        shuffled(blobs(2)),
        blobs(2)[..., ::-1].copy(),
        blobs(2, sigma=(9, 9)),
    ):
        found = distances(weights, blobs(1), other)
        for name in FEATURE_METRICS:
            assert found[name] > 2 * same[name] and same[name] < 3, name


def test_equal_crops_have_no_feature_distance(weights: Path) -> None:
    crops = np.stack([blobs(s, 64, 64) for s in range(3)])
    metrics = standard_metrics(blobs(1), features=weights)
    assert [metric.name for metric in metrics[-2:]] == list(FEATURE_METRICS)
    for metric in metrics[-2:]:
        features = metric.features(crops)
        assert metric.distance(features, features) == pytest.approx(0, abs=1e-9)


def test_maps_of_one_channel_have_no_feature_distance(weights: Path) -> None:
    names = {metric.name for metric in standard_metrics(blobs(1)[..., :1], features=weights)}
    assert not names & set(FEATURE_METRICS)


def test_the_network_is_the_published_one(weights: Path) -> None:
    """Against the same layers, written out."""
    state = {key: value.float() for key, value in load_file(weights).items()}
    network = load_squeezenet(weights)
    images = torch.rand(2, 3, 65, 70)

    def convolution(x: torch.Tensor, name: str, **options: int) -> torch.Tensor:
        return F.conv2d(x, state[f"{name}.weight"], state[f"{name}.bias"], **options).relu()

    blue_first = torch.stack([images[:, 2], images[:, 1], images[:, 0]], 1) * 255
    x = convolution(blue_first - torch.tensor([104.0, 117.0, 123.0])[:, None, None], "conv1",
                    stride=2)  # fmt: skip
    found = network.features(images)
    assert torch.allclose(found["conv1"], x, rtol=1e-4, atol=1e-3)
    for name in FIRES:
        if name in ("fire2", "fire5", "fire9"):
            x = F.max_pool2d(x, 3, 2, ceil_mode=True)
        x = convolution(x, f"{name}.squeeze1x1")
        x = torch.cat(
            [convolution(x, f"{name}.expand1x1"),
             convolution(x, f"{name}.expand3x3", padding=1)], 1)  # fmt: skip
        assert torch.allclose(found[name], x, rtol=1e-4, atol=1e-3), name
    assert torch.allclose(network(images).sum(1), torch.ones(2))


@pytest.mark.skipif(not TRAINED.exists(), reason="no trained weights of SqueezeNet at hand")
def test_the_trained_network_knows_a_cat_and_photographs() -> None:
    from skimage.data import chelsea, coffee, gravel
    from skimage.transform import resize

    network = load_squeezenet(TRAINED)
    for photograph, index in ((chelsea(), 285), (coffee(), 967)):
        middle = resize(photograph, (256, 256), anti_aliasing=True)[14:241, 14:241]
        image = torch.from_numpy(middle.transpose(2, 0, 1)).float()
        assert network(image[None]).argmax() == index
    stones = np.repeat(gravel()[..., None] / 255, 3, axis=2).astype(np.float32)
    settings = Settings(side=96, features=TRAINED)
    reference = Reference(stones[:, :256], settings)
    near, far = (
        reference.distances([picture]) for picture in (stones[:, 256:], blurred(stones[:, 256:], 1))
    )
    for name in FEATURE_METRICS:
        assert near[name].multiple < 2 and far[name].value > 2 * near[name].value, name


def test_the_command_reports_distances_of_features(
    weights: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for name, picture in (("stone", blobs(1, 100, 100)), ("other", blobs(2, 100, 100))):
        Image.fromarray(np.rint(picture * 255).astype(np.uint8)).save(tmp_path / f"{name}.png")
    arguments = [str(tmp_path / "stone.png"), f"--slices={tmp_path / 'other.png'}", "--crops=2",
                 "--size=40"]  # fmt: skip
    figures, report = tmp_path / "report.json", tmp_path / "report.html"
    files = [f"--json={figures}", "-o", str(report)]
    assert command.main([*arguments, *files, f"--features={weights}"]) == 0
    distances = json.loads(figures.read_text())["distances"]["albedo"]
    for name in FEATURE_METRICS:
        assert distances["overall"][name]["value"] > 0
        assert distances["titles"][name] in report.read_text()
    assert len(distances["likelihood"]["views"]["slices"]) == 3
    assert "average log-likelihood" in report.read_text()
    assert command.main([*arguments, f"--features={tmp_path / 'stone.png'}"]) == 1
    assert "stone.png: found no state dict that loads safely" in capsys.readouterr().err


def test_wrong_weights_are_refused(weights: Path, tmp_path: Path) -> None:
    for damage, message in (
        (
            {"fire3.expand1x1.bias": torch.zeros(3)},
            r"fire3.expand1x1.bias: found shape \(3,\)",
        ),
        (
            {"conv1.bias": torch.full((96,), torch.nan)},
            "conv1.bias: found values that are not",
        ),
    ):
        path = tmp_path / "damaged.safetensors"
        save_file(load_file(weights) | damage, path)
        with pytest.raises(WeightsError, match=message):
            load_squeezenet(path)
    path.write_bytes(b"nothing")
    with pytest.raises(WeightsError, match="found no state dict"):
        load_squeezenet(path)
    with pytest.raises(WeightsError, match="found no such file"):
        load_squeezenet(tmp_path / "nowhere.safetensors")


def test_moments_of_many_samples_are_the_plain_ones() -> None:
    rng = np.random.default_rng(0)
    factor = rng.standard_normal((6, 6))
    vectors = rng.standard_normal((100_000, 6)) @ factor.T + 3
    found = shrunk_moments(vectors)
    assert np.allclose(found.mean, 3, atol=0.05)
    assert np.allclose(found.covariance, np.cov(vectors.T), rtol=1e-3, atol=1e-3)


def test_few_samples_of_one_distribution_are_nearer_with_shrinkage() -> None:
    rng = np.random.default_rng(0)
    first, second = rng.standard_normal((2, 20, 64))
    plain = [(v.mean(0), np.cov(v.T)) for v in (first, second)]
    shrunk = [shrunk_moments(v) for v in (first, second)]
    assert frechet_distance(*shrunk[0], *shrunk[1]) < 0.5 * frechet_distance(*plain[0], *plain[1])
    assert np.linalg.eigvalsh(shrunk[0].covariance).min() > 0.1
    constant = shrunk_moments(np.ones((20, 64)))
    assert frechet_distance(*constant, *constant) == 0


def test_parzen_windows_are_the_mean_of_gaussians() -> None:
    crops = [blobs(seed, 12, 12)[None] for seed in range(3)]
    windows = ParzenWindows(crops[0], crops[1], side=4)
    truth = random_patches(crops[0], 4, KERNELS)
    samples = random_patches(crops[2], 4, SAMPLES)
    density = multivariate_normal(np.zeros(48), windows.bandwidth**2)
    expected = [np.log(density.pdf(truth - sample).mean()) for sample in samples]
    found = windows.average_log_likelihood(crops[2])
    assert found == pytest.approx(np.mean(expected), rel=1e-6)


def test_artifacts_are_unlikely() -> None:
    reference = Reference(blobs(1), Settings(side=80, symmetry="all"))
    own, same = reference.own_likelihoods, reference.likelihoods([blobs(2)])
    noise = reference.likelihoods([shuffled(blobs(2))])
    for mine, other, wrong in zip(own, same, noise, strict=True):
        assert abs(other - mine) < 0.2 * abs(mine - wrong) and wrong < other
