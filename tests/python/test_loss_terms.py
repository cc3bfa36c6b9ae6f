"""The papers' losses against their formulas, VGG-19's weights, histograms, and divergence."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
import torch
from safetensors.torch import save_file
from textures_2d import noise as maps
from torch import Tensor

from solidtex_export.discriminators.critic import (
    Critic,
    Penalties,
    critic_loss,
    field_of_view,
    style_loss,
)
from solidtex_export.export.verification.reference import cubic_convolution
from solidtex_export.generators.oblique import cubic_columns
from solidtex_export.images.exemplar import Exemplar
from solidtex_export.images.histograms import share_histograms
from solidtex_export.losses import pretrained, statistics
from solidtex_export.losses.descriptor.weights import DISTILLED, PROCEDURAL, load_weights
from solidtex_export.losses.descriptors import (
    DescriptorSource,
    PretrainedWeights,
    known_feature_names,
)
from solidtex_export.networks import WeightsError, load_network, vgg
from solidtex_export.networks.squeezenet import SqueezeNet
from solidtex_export.training.divergence import EXPLOSION, DivergenceWatch, TrainError

torch.set_num_threads(1)
MEAN, BASIS = torch.tensor([0.4, 0.5, 0.6]), torch.diag(torch.tensor([0.1, 0.2, 0.3]))


def test_gram_distance_is_equation_2() -> None:
    f, r = maps(1, 3, 4, 5), maps(1, 3, 4, 5, seed=1)
    sums = [x[0].flatten(1) @ x[0].flatten(1).T for x in (f, r)]  # equation 1
    expected = (sums[0] - sums[1]).square().sum() / (3 * 20)
    assert float(statistics.gram_distance(f, r)) == pytest.approx(float(expected), rel=1e-5)


@pytest.mark.parametrize("shape", [(3, 7), (1, 5), (5, 1)])
def test_second_moments_have_the_gradient_of_their_formula(shape: tuple[int, int]) -> None:
    rows = torch.randn(shape, dtype=torch.float64, requires_grad=True)
    weight = torch.randn(shape[0], shape[0])  # not symmetric
    (expected,) = torch.autograd.grad((rows @ rows.T / shape[1] * weight).sum(), rows)
    found = statistics.second_moments(rows)
    assert torch.allclose(found.double(), rows @ rows.T / shape[1])
    (gradient,) = torch.autograd.grad((found * weight).sum(), rows)
    assert torch.allclose(gradient, expected, rtol=1e-5, atol=1e-6)


@pytest.mark.parametrize("shape", [(1, 2, 6, 6), (1, 1, 5, 7), (1, 1, 4, 9)])
def test_autocorrelation_is_equation_6(shape: tuple[int, ...]) -> None:
    f = maps(*shape)
    rows, columns = shape[2:]
    found = statistics.autocorrelation(f)
    half = columns // 2
    assert found.shape == (shape[1], rows // 2 + 1, 2 * half + 1)
    for n in range(shape[1]):
        for i in range(rows // 2 + 1):
            for j in range(-half, half + 1):
                products = [
                    float(f[0, n, q, m] * f[0, n, q - i, m - j])
                    for q in range(i, rows)
                    for m in range(columns)
                    if 0 <= m - j < columns
                ]
                weight = 1 / ((rows - i) * (columns - abs(j)))
                assert float(found[n, i, j + half]) == pytest.approx(
                    weight * sum(products), abs=1e-5
                )


def test_autocorrelation_and_diversity_of_equal_maps_vanish_and_see_a_change() -> None:
    f, r = maps(2, 3, 8, 8), maps(2, 3, 8, 8, seed=1)
    for distance in (statistics.autocorrelation_distance, statistics.feature_distance):
        assert float(distance(f, f)) == 0 and float(distance(f, r)) > 0
    expected = (f - r).square().sum() / 2
    assert float(statistics.feature_distance(f, r)) == pytest.approx(float(expected))


def test_smoothness_is_equation_10() -> None:
    f, sigma = maps(1, 1, 4, 4), 0.7
    found = statistics.smoothness(f, sigma)
    assert found.shape == (1, 1, 2, 2)
    neighbors = [(i, j) for i in (-1, 0, 1) for j in (-1, 0, 1) if (i, j) != (0, 0)]
    for r in (1, 2):
        for c in (1, 2):
            terms = [
                math.exp(-sigma * float(f[0, 0, r, c] - f[0, 0, r + i, c + j]) ** 2)
                for i, j in neighbors
            ]
            expected = math.log(sum(terms)) / (2 * sigma)
            assert float(found[0, 0, r - 1, c - 1]) == pytest.approx(expected, rel=1e-5)


def test_feature_loss_takes_the_layers_that_there_are() -> None:
    pair = (maps(1, 2, 6, 6), maps(1, 2, 6, 6, seed=1))
    features = {"relu1_1": pair, "pool1": (pair[0], pair[0])}
    layers = ("relu1_1", "pool1", "relu5_1")
    found = statistics.feature_loss("near", "gram", layers, 1e-3, features)
    assert float(found) == pytest.approx(float(statistics.gram_distance(*pair)) / 2)
    with pytest.raises(
        statistics.LayerError, match="layers: found relu9_9, expected some of relu1_1"
    ):
        statistics.feature_loss("near", "gram", ("relu9_9",), 1e-3, features)


@torch.no_grad()
def test_style_loss_and_field_of_view() -> None:
    for layers in (1, 2, 4, 5):
        side = field_of_view(layers)
        critic = Critic(2, (3,) * layers)
        assert critic(maps(2, 2, side, side)).shape == (2,)
        with pytest.raises(RuntimeError):
            critic(maps(1, 2, side - 1, side - 1))
    critic = Critic(2, (3, 4), equalized=True)
    images = maps(1, 2, 20, 20)
    assert float(style_loss(critic, critic.features(images), images)) == 0
    assert float(style_loss(critic, critic.features(-images), images)) > 0


def test_gradient_penalty_of_a_linear_critic() -> None:
    """Equation 3 where all is known: D(x) = 3 x_0 has a slope of length 3 everywhere."""

    class Linear(Critic):
        def forward(self, images: Tensor) -> Tensor:
            return 3 * images[:, 0, 0, 0]

    fakes, reals = torch.full((2, 1, 2, 2), 5.0), torch.full((2, 1, 2, 2), 1.0)
    loss = critic_loss(Linear(), fakes, reals, Penalties(gradient=10, drift=0.5))
    assert float(loss.detach()) == pytest.approx(15 - 3 + 10 * (3 - 1) ** 2 + 0.5 * 9)
    loss = critic_loss(Linear(), fakes, reals, Penalties(gradient=10, drift=0, rms=True))
    assert float(loss.detach()) == pytest.approx((2 * (15 - 3) + 10 * (2 * 3 - 1) ** 2) / 2)


@pytest.fixture(scope="module")
def weights() -> dict[str, Tensor]:
    """A state dict with torchvision's keys, small values, and a layer too many."""
    state = {}
    channels = 3
    widths = [w for w, n in zip(vgg.WIDTHS, vgg.CONVOLUTIONS, strict=True) for _ in range(n)]
    for index, width in zip(vgg.TORCHVISION_INDICES, widths, strict=True):
        scale = (2 / (9 * channels)) ** 0.5
        state[f"features.{index}.weight"] = scale * maps(width, channels, 3, 3, seed=index)
        state[f"features.{index}.bias"] = 0.1 * maps(width, seed=index + 100)
        channels = width
    state["classifier.0.bias"] = torch.zeros(7)
    return state


def gatys(state: dict[str, Tensor]) -> dict[str, Tensor]:
    """The same network for inputs as Gatys et al. prepare them."""
    names = [f"conv{g}_{i}" for g, n in enumerate(vgg.CONVOLUTIONS, 1) for i in range(1, n + 1)]
    pairs = zip(vgg.TORCHVISION_INDICES, names, strict=True)
    return {
        f"{name}.{part}": state[f"features.{index}.{part}"]
        for index, name in pairs
        for part in ("weight", "bias")
    }


def test_vgg_reads_both_kinds_of_weights(weights: dict[str, Tensor], tmp_path: Path) -> None:
    torch.save(weights, tmp_path / "torchvision.pth")
    torch.save(gatys(weights), tmp_path / "gatys.pth")
    one = load_network(tmp_path / "torchvision.pth")
    other = load_network(tmp_path / "gatys.pth")
    assert len(one.layers) == 13 and one.preprocessing is vgg.TORCHVISION
    assert other.preprocessing is vgg.GATYS
    for (w, b), (w2, b2) in zip(one.layers, other.layers, strict=True):
        assert torch.equal(w, w2) and torch.equal(b, b2)
    rgb = torch.tensor([0.485, 0.456, 0.406]).view(1, 3, 1, 1)
    assert vgg.TORCHVISION(rgb).abs().max() < 1e-6
    blue = torch.tensor([0.0, 0.0, 1.0]).view(1, 3, 1, 1)
    assert vgg.GATYS(blue).flatten().tolist() == pytest.approx([151.061, -116.779, -123.68])


def test_vgg_sees_colors(weights: dict[str, Tensor], tmp_path: Path) -> None:
    """Features are those of the colors, whatever the whitening; layers and sizes are VGG-19's."""
    path = tmp_path / "vgg.pth"
    torch.save(weights, path)
    colors = maps(1, 3, 32, 32).mul(0.1).add(0.5)
    plain = pretrained.PretrainedDescriptor(load_network(path), torch.zeros(3), torch.eye(3))
    whitened = DescriptorSource(MEAN, BASIS, PretrainedWeights(load_network(path))).make("features")
    y = (colors - MEAN.view(1, 3, 1, 1)) / BASIS.diag().view(1, 3, 1, 1)
    features = whitened.features(y, y)
    for name, (fakes, _) in plain.features(colors, colors).items():
        assert torch.allclose(fakes, features[name][0], atol=1e-4), name
    assert features["relu5_1"][0].shape == (1, 512, 2, 2)
    assert set(pretrained.VGG_LAYERS) < set(features)
    y = y.requires_grad_()
    loss = whitened.distance(y, whitened.measure(-y.detach()))
    (gradient,) = torch.autograd.grad(loss, y)
    assert float(loss.detach()) > 0 and float(gradient.norm()) > 0


def test_names_of_features_are_known_beforehand(weights: dict[str, Tensor], tmp_path: Path) -> None:
    torch.save(weights, tmp_path / "vgg.pth")
    images = maps(1, 3, 96, 96)
    for network in (load_network(tmp_path / "vgg.pth"), SqueezeNet()):
        given = PretrainedWeights(network)
        found = DescriptorSource(MEAN, BASIS, given).make("features").features(images, images)
        assert list(found) == given.feature_names("features")
    for path in (PROCEDURAL, DISTILLED):
        given = PretrainedWeights(None, load_weights(path))
        source = DescriptorSource(MEAN, BASIS, given)
        for name in ("features", "learned"):
            found = source.make(name).features(images, images)
            assert list(found) == given.feature_names(name)
            assert set(found) <= set(known_feature_names())


def test_vgg_takes_the_first_three_of_five_channels(
    weights: dict[str, Tensor], tmp_path: Path
) -> None:
    path = tmp_path / "vgg.pth"
    torch.save(weights, path)
    descriptor = pretrained.PretrainedDescriptor(load_network(path), torch.zeros(5), torch.eye(5))
    images = maps(1, 5, 16, 16)
    changed = images.clone()
    changed[:, 3:] += 1
    assert float(descriptor.distance(images, descriptor.measure(changed))) == 0
    encoded = pretrained.srgb_encoded(torch.tensor([-0.1, 0.0, 0.002, 0.2140, 1.0]))
    assert encoded.tolist() == pytest.approx([-1.292, 0.0, 0.02584, 0.5, 1.0], abs=1e-4)
    network = load_network(path)
    linear = pretrained.PretrainedDescriptor(network, torch.zeros(3), torch.eye(3), linear=True)
    colors = images[:, :3].sigmoid()
    found = linear.features(colors, colors)["relu1_1"][0]
    plain = pretrained.PretrainedDescriptor(load_network(path), torch.zeros(3), torch.eye(3))
    assert torch.equal(found, plain.features(pretrained.srgb_encoded(colors), colors)["relu1_1"][0])
    gray = pretrained.PretrainedDescriptor(load_network(path), torch.zeros(1), torch.eye(1))
    assert gray.features(images[:, :1], images[:, :1])["pool1"][0].shape == (1, 64, 8, 8)


def test_squeezenet_is_recognized_and_compares_textures(tmp_path: Path) -> None:
    torch.manual_seed(0)
    save_file(SqueezeNet().state_dict(), tmp_path / "squeezenet.safetensors")
    weights = PretrainedWeights(load_network(tmp_path / "squeezenet.safetensors"))
    descriptor = DescriptorSource(MEAN, BASIS, weights).make("features")
    images = maps(2, 3, 64, 64)
    features = descriptor.features(images, images)
    assert features["relu1_1"][0].shape == (2, 96, 29, 29)
    assert features["half_relu2_1"][0].shape[1] == 128
    assert {"pool2", *(f"relu{group}_1" for group in (1, 2, 3))} < set(features)
    smallest = maps(1, 3, SqueezeNet.smallest, SqueezeNet.smallest)
    assert float(descriptor.distance(smallest, descriptor.measure(smallest))) < 1e-9
    with pytest.raises(WeightsError, match="expected at least 64 pixels"):
        descriptor.distance(smallest[..., 1:], descriptor.measure(smallest))
    leaf = images.clone().requires_grad_()
    moved, blurred = images.roll((7, -9), (2, 3)), torch.nn.functional.avg_pool2d(images, 3, 1, 1)
    loss = descriptor.distance(leaf, descriptor.measure(blurred))
    (gradient,) = torch.autograd.grad(loss, leaf)
    assert float(gradient.norm()) > 0
    assert float(loss.detach()) > 3 * float(descriptor.distance(images, descriptor.measure(moved)))


def test_wrong_weights_are_named(weights: dict[str, Tensor], tmp_path: Path) -> None:
    def message(state: object) -> str:
        path = tmp_path / "w.pth"
        torch.save(state, path)
        with pytest.raises(WeightsError) as error:
            load_network(path)
        assert str(path) in str(error.value)
        return str(error.value)

    wide = weights | {"features.5.weight": torch.zeros(64, 64, 3, 3)}
    assert (
        "features.5.weight: found shape (64, 64, 3, 3), expected shape (128, 64, 3, 3)"
        in message(wide)
    )
    lacking = {k: v for k, v in weights.items() if k != "features.28.bias"}
    assert "features.28.bias: found nothing, expected shape (512,)" in message(lacking)
    broken = weights | {"features.0.bias": torch.full((64,), math.nan)}
    assert "features.0.bias: found values that are not finite" in message(broken)
    assert "expected weights of VGG-19" in message({"layer1.weight": torch.zeros(1)})
    assert "found list, expected a state dict" in message([1])
    (tmp_path / "text.pth").write_text("no weights")
    with pytest.raises(WeightsError, match="no state dict that loads safely"):
        load_network(tmp_path / "text.pth")
    with pytest.raises(WeightsError, match="no such file"):
        load_network(tmp_path / "none.pth")


def exemplar(values: np.ndarray) -> Exemplar:
    image = torch.from_numpy(values.astype(np.float32)).unsqueeze(0)
    return Exemplar("photo", "0", image, ("height",), "data")


def test_photographs_share_one_histogram() -> None:
    """Of values u and 1 + 2 u (same order) the mean quantile function is 0.5 + 1.5 u."""
    u = np.random.default_rng(0).permutation(20 * 30).reshape(20, 30) / 599
    first, second = share_histograms([exemplar(u), exemplar(1 + 2 * u.T)])
    assert np.abs(first.image.numpy()[0] - (0.5 + 1.5 * u)).max() < 1e-6
    assert np.abs(second.image.numpy()[0] - (0.5 + 1.5 * u.T)).max() < 1e-6
    flat = np.full((20, 30), 0.25)
    (alone,) = share_histograms([exemplar(flat)])
    assert np.array_equal(alone.image.numpy()[0], flat.astype(np.float32))
    both = share_histograms([exemplar(flat), exemplar(flat)])
    assert np.abs(both[1].image.numpy() - 0.25).max() < 1e-6


def test_divergence_is_detected_and_ordinary_losses_are_not() -> None:
    watch = DivergenceWatch()
    for step in range(100):
        watch.check(step, {"style": 2.0 + step % 7, "critic": -30.0 * (step % 5), "late": math.nan})
    watch.check(100, {"style": 1e9, "critic": 0.0, "late": 1.0})  # one bad step is no alarm
    restored = DivergenceWatch()
    restored.restore(watch.state())
    with pytest.raises(TrainError, match=r"style: found a loss of .* where it started at"):
        for step in range(101, 120):
            restored.check(step, {"style": 10 * EXPLOSION, "critic": 0.0, "late": 1.0})
    assert step < 108


def test_oblique_planes_are_cubic_convolutions() -> None:
    torch.manual_seed(0)
    block = torch.randn(1, 2, 3, 8, 6)
    u = torch.tensor([1.0, 2.25, 5.5], dtype=torch.float64)
    v = torch.tensor([3.0, 1.5, 2.75], dtype=torch.float64)
    found = cubic_columns(block, u, v)
    assert found.shape == (1, 2, 3, 3)
    weights = [
        torch.from_numpy(cubic_convolution(np.arange(n)[None] - t.numpy()[:, None])).float()
        for t, n in ((u, 8), (v, 6))
    ]
    expected = torch.einsum("bcrij,ki,kj->bcrk", block, *weights)
    assert (found - expected).abs().max() < 1e-5
