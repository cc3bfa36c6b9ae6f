"""Metrics: the same texture is near, others are far; and each against its definition."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import torch
from scipy.linalg import sqrtm
from textures_2d import blobs, blurred, random_phase, shuffled

from solidtex_export.evaluation.comparison import Distance, Reference, Settings, channel_groups
from solidtex_export.evaluation.metrics import standard_metrics
from solidtex_export.evaluation.metrics.autocorrelation import correlation, covariance_by_lag
from solidtex_export.evaluation.metrics.fourier import FourierMagnitudes
from solidtex_export.evaluation.metrics.frechet import frechet_distance
from solidtex_export.evaluation.metrics.inception import LAYERS, SingleImageFrechet, WeightsError
from solidtex_export.evaluation.metrics.lbp import PATTERNS, RADII, LbpDistance
from solidtex_export.evaluation.metrics.patches import SlicedWasserstein
from solidtex_export.evaluation.metrics.spectrum import PowerSpectrum
from solidtex_export.evaluation.pictures import crop_side, halvings, oriented
from solidtex_export.losses.spectrum import BANDS

SETTINGS = Settings(side=80, symmetry="all")
NAMES = [metric.name for metric in standard_metrics(blobs(0))]


@pytest.fixture(scope="module")
def reference() -> Reference:
    return Reference(blobs(1), SETTINGS)


@pytest.mark.parametrize("name", NAMES)
def test_another_piece_of_the_same_texture_is_as_near_as_the_exemplar(
    name: str, reference: Reference
) -> None:
    assert reference.distances([blobs(2)])[name].multiple < 2


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize(
    "other",
    [shuffled(blobs(2)), blobs(2, sigma=(2, 2)), blobs(2, sigma=(9, 9))],
    ids=["white noise", "finer", "coarser"],
)
def test_other_textures_are_far(name: str, other: np.ndarray, reference: Reference) -> None:
    same = reference.distances([blobs(2)])[name].value
    assert reference.distances([other])[name].value > 2 * same


@pytest.mark.parametrize("name", ["binary_patterns", "fdmse", "sliced_wasserstein", "spectrum"])
def test_blur_is_detected(name: str, reference: Reference) -> None:
    same = reference.distances([blobs(2)])[name].value
    assert reference.distances([blurred(blobs(2))])[name].value > 2 * same


def test_random_phase_noise_has_the_spectrum_but_not_the_shapes(reference: Reference) -> None:
    found = reference.distances([random_phase(blobs(1))])
    assert found["fdmse"].multiple < 2
    assert found["autocorrelation"].multiple < 2
    assert found["spectrum"].multiple < 2
    assert found["binary_patterns"].multiple > 5


def test_orientation_counts_unless_the_material_has_none() -> None:
    grain, across = blobs(1, sigma=(12, 2)), blobs(2, 256, 160, sigma=(2, 12))
    strict = Reference(grain, Settings(side=80, symmetry="flips")).distances([across])
    loose = Reference(grain, Settings(side=80, symmetry="all")).distances([across])
    for name in NAMES:
        assert strict[name].multiple > 1.5 * loose[name].multiple, name


def test_colors_count() -> None:
    exemplar = blobs(1)
    found = Reference(exemplar, SETTINGS).distances([blobs(2)[..., ::-1]])
    assert found["sliced_wasserstein"].multiple > 3


def test_an_image_has_distance_zero_to_itself() -> None:
    crops = np.stack([blobs(s, 64, 64) for s in range(3)])
    for metric in standard_metrics(blobs(1)):
        features = metric.features(crops)
        assert metric.distance(features, features) == 0


def test_fourier_magnitudes_of_a_wave() -> None:
    columns = np.arange(64)
    wave = 0.5 + 0.25 * np.cos(2 * np.pi * 5 * columns / 64)
    crops = np.broadcast_to(wave[None, None, :, None], (2, 64, 64, 1))
    magnitudes = FourierMagnitudes().features(crops)[..., 0]
    # Orthonormal: half the amplitude times the side, in the frequencies 5 and -5 of the columns.
    assert magnitudes[0, 5] == pytest.approx(0.125 * 64) and magnitudes[0, -5] == magnitudes[0, 5]
    assert magnitudes.sum() == pytest.approx(0.25 * 64)
    none = np.zeros_like(magnitudes)
    assert FourierMagnitudes().distance(magnitudes, none) == pytest.approx(2 * 8**2 / 64**2)


def test_a_faint_weave_shows_in_the_spectrum_but_not_in_correlations(
    reference: Reference,
) -> None:
    other = blobs(2)
    weave = (-1.0) ** np.arange(other.shape[1])[None, :, None]
    plain, woven = (reference.distances([p]) for p in (other, other + 0.015 * weave))
    assert woven["spectrum"].value > 1.5 * plain["spectrum"].value
    for name in ("autocorrelation", "fdmse"):
        assert woven[name].value < 1.1 * plain[name].value, name


def test_spectrum_is_the_power_of_noise_in_decibels() -> None:
    noise = np.random.default_rng(0).standard_normal((64, 128, 128, 1)).astype(np.float32)
    metric = PowerSpectrum()
    quiet, loud = (metric.features(a * noise) for a in (0.05, 0.1))
    assert quiet.shape == (1, 2 * BANDS, BANDS)
    assert np.allclose(quiet, 20 * np.log10(0.05), atol=0.5)
    assert metric.distance(quiet, loud) == pytest.approx(20 * np.log10(2), abs=0.01)


def test_autocorrelation_is_the_direct_sum() -> None:
    values = np.random.default_rng(1).standard_normal((7, 9))
    found, count = covariance_by_lag(values, values, (3, 4))
    for row in range(-3, 4):
        for column in range(-4, 5):
            first = values[max(0, -row) : 7 - max(0, row), max(0, -column) : 9 - max(0, column)]
            second = values[max(0, row) : 7 + min(0, row), max(0, column) : 9 + min(0, column)]
            assert found[row + 3, column + 4] == pytest.approx((first * second).mean())
            assert count[row + 3, column + 4] == first.size


def test_correlation_of_a_wave_is_the_wave() -> None:
    wave = np.cos(2 * np.pi * np.arange(64) / 16)
    crops = np.broadcast_to(wave[None, None, :, None], (1, 64, 64, 1))
    rho = correlation(crops, 16)[16, 16:, 0]
    assert rho[[0, 8, 16]] == pytest.approx([1, -1, 1], abs=1e-6)


def test_lbp_of_a_flat_and_a_checkered_image() -> None:
    metric = LbpDistance()
    flat = metric.features(np.full((1, 40, 40, 1), 0.5))
    assert flat.shape == (1, len(RADII), PATTERNS)
    assert np.allclose(flat.max(-1), 1)  # ties count as brighter: one pattern everywhere
    checkered = np.indices((40, 40)).sum(0)[None, ..., None] % 2
    assert metric.distance(flat, metric.features(checkered)) > 0.5


def test_wasserstein_distance_of_a_shift_of_brightness() -> None:
    exemplar = blobs(1)
    crops = np.stack([exemplar[:80, :80], exemplar[80:, 80:160]])
    metric = SlicedWasserstein(exemplar)
    pairs = zip(metric.features(crops), metric.features(crops + 0.1), strict=True)
    moved = [float(np.abs(a - b).mean()) for a, b in pairs]
    assert max(moved[:-1]) < 1e-4 < moved[-1]  # only the last level holds the mean


def test_self_distance_compares_halves_that_share_no_pixel() -> None:
    exemplar = blobs(1, 100, 256)
    assert crop_side(exemplar, 96) == 96 and crop_side(exemplar, 300) == 100
    assert crop_side(blobs(1, 130, 130), 96) == 65
    assert len(halvings(exemplar, 96)) == 1 and len(halvings(exemplar, 50)) == 2
    left, right = halvings(exemplar, 96)[0]
    assert np.array_equal(np.concatenate([left, right], axis=1), exemplar)


def test_constant_exemplars_have_no_relative_distance() -> None:
    flat = np.full((80, 160, 3), 0.5, dtype=np.float32)
    found = Reference(flat, SETTINGS).distances([flat])
    assert found == {name: Distance(0.0, None) for name in NAMES}


def test_orientations_are_those_of_a_square() -> None:
    crop = np.arange(4, dtype=np.float32).reshape(2, 2, 1)
    for symmetry, count in (("all", 8), ("flips", 4), ("none", 1)):
        turned = oriented(np.stack([crop] * 16), symmetry)
        assert len({c.tobytes() for c in turned}) == count


def test_channels_are_compared_in_groups() -> None:
    assert channel_groups(("albedo.r", "albedo.g", "albedo.b")) == {"albedo": [0, 1, 2]}
    groups = channel_groups(("albedo.r", "albedo.g", "albedo.b", "roughness"))
    assert groups == {"albedo": [0, 1, 2], "roughness": [3], "all channels": [0, 1, 2, 3]}


@pytest.fixture
def inception(tmp_path: Path) -> Path:
    """A file with random weights in the layers that SIFID uses."""
    torch.manual_seed(0)
    state = {}
    for name, outputs, inputs, kernel, *_ in LAYERS:
        state[f"{name}.conv.weight"] = 0.2 * torch.randn(outputs, inputs, kernel, kernel)
        for key in ("bias", "running_mean"):
            state[f"{name}.bn.{key}"] = 0.1 * torch.randn(outputs)
        for key in ("weight", "running_var"):
            state[f"{name}.bn.{key}"] = 1 + torch.rand(outputs)
    path = tmp_path / "inception.pth"
    torch.save(state, path)
    return path


def test_sifid_tells_textures_apart(inception: Path) -> None:
    reference = Reference(blobs(1), Settings(side=80, symmetry="all", inception=inception))
    assert reference.distances([blobs(2)])["sifid"].multiple < 3
    assert reference.distances([shuffled(blobs(2))])["sifid"].multiple > 10


def test_sifid_layers_are_convolution_normalization_and_pooling(inception: Path) -> None:
    crops = blobs(1, 64, 64)[None]
    state = torch.load(inception, weights_only=True)
    x = torch.from_numpy(crops).permute(0, 3, 1, 2) * 2 - 1
    for name, outputs, inputs, kernel, stride, padding, pooled in LAYERS:
        conv = torch.nn.Conv2d(inputs, outputs, kernel, stride, padding, bias=False)
        norm = torch.nn.BatchNorm2d(outputs, eps=1e-3).eval()
        conv.load_state_dict({"weight": state[f"{name}.conv.weight"]})
        keys = ("weight", "bias", "running_mean", "running_var")
        norm.load_state_dict({k: state[f"{name}.bn.{k}"] for k in keys}, strict=False)
        x = norm(conv(x)).relu()
        x = torch.nn.functional.max_pool2d(x, 3, 2) if pooled else x
    mean, _ = SingleImageFrechet(inception).features(crops)
    assert np.allclose(mean, x.mean((0, 2, 3)).detach().numpy(), rtol=1e-4)


def test_frechet_distance_is_the_formula() -> None:
    rng = np.random.default_rng(0)
    a, b = (np.cov(rng.standard_normal((6, 40))) for _ in range(2))
    expected = np.trace(a + b - 2 * np.real(sqrtm(a @ b))) + 6 * 0.25
    assert frechet_distance(np.zeros(6), a, np.full(6, 0.5), b) == pytest.approx(expected)


def test_wrong_weights_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "other.pth"
    torch.save({"features.0.weight": torch.zeros(3)}, path)
    with pytest.raises(WeightsError, match=r"other.pth: Conv2d_1a_3x3.conv.weight: found nothing"):
        SingleImageFrechet(path)
    path.write_bytes(b"nothing")
    with pytest.raises(WeightsError, match="no readable weights"):
        SingleImageFrechet(path)
