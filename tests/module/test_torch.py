"""PyTorch: a model as a module, and gradients through points."""

from pathlib import Path

import numpy as np
import pytest
import torch

import solidtex
from solidtex_export.export import random_models
from solidtex_export.export.file_format import model_file

REPOSITORY = Path(__file__).resolve().parents[2]
SHIPPED = ["granite-grey", "granite-speckled"]
RANDOM = {
    "operations": random_models.every_operation_model(),
    "lattice": random_models.lattice_model(levels=3, noise=2, step=3),
    "sampler": random_models.sampler_model(octaves=4, hidden=3, width=7),
}


@pytest.fixture(autouse=True)
def shipped_models(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SOLIDTEX_MODEL_PATH", str(REPOSITORY / "models"))


@pytest.mark.parametrize("name", [*SHIPPED, *RANDOM])
def test_a_module_has_the_values_of_the_engine(name: str, tmp_path: Path) -> None:
    model: str | Path = name
    if name in RANDOM:
        model = tmp_path / "random.solidtex"
        model_file.write(model, RANDOM[name])
    texture = solidtex.load(model, seed=9)
    module = texture.to_torch()
    origin, size = (-7, 5, 1000), (6, 5, 7)
    found = module(origin, size)
    expected = texture.eval_box(origin, size)
    assert found.dtype == torch.float32 and found.shape == expected.shape
    assert np.abs(found.detach().numpy() - expected).max() < 2e-4
    exact = module.double()(origin, size).detach().numpy()
    assert np.abs(exact - expected).max() < 5e-5 and expected.std() > 0.01


@pytest.mark.parametrize("name", SHIPPED)
def test_the_weights_keep_their_names_and_learn(name: str) -> None:
    texture = solidtex.load(name)
    module = texture.to_torch()
    tensors = model_file.read(name).tensors
    state = module.state_dict()
    assert state.keys() == tensors.keys()
    assert all((state[key].numpy() == tensors[key]).all() for key in tensors)
    assert sum(p.numel() for p in module.parameters()) == texture.parameter_count
    box = (0, 0, 0), (4, 4, 4)
    before = module(*box).mean()
    before.backward()
    learning = {k: p for k, p in module.named_parameters() if p.requires_grad}
    assert all(p.grad is not None and torch.isfinite(p.grad).all() for p in learning.values())
    torch.optim.SGD(learning.values(), lr=0.01).step()
    assert module(*box).mean() < before


def test_a_module_needs_a_file_and_no_period() -> None:
    data = (REPOSITORY / "models" / "granite-grey.solidtex").read_bytes()
    with pytest.raises(ValueError, match="found a texture without a file"):
        solidtex.Texture.from_bytes(data).to_torch()
    with pytest.raises(ValueError, match="found the period 64"):
        solidtex.load("granite-grey", period=64).to_torch()


@pytest.mark.parametrize("name", SHIPPED)
def test_a_module_refuses_boxes_that_are_none(name: str) -> None:
    module = solidtex.load(name).to_torch()
    with pytest.raises(ValueError, match=r"size: found \(0, 1, 1\), expected three whole numbers"):
        module((0, 0, 0), (0, 1, 1))
    with pytest.raises(ValueError, match=r"size: found \(2, 1\), expected three whole numbers"):
        module((0, 0, 0), (2, 1))
    with pytest.raises(ValueError, match=r"origin: found \(0, 0.5, 0\), expected three whole"):
        module((0, 0.5, 0), (1, 1, 1))
    edge = 2**30 + 2**16
    assert module((edge - 1, 0, -edge), (1, 1, 1)).isfinite().all()
    with pytest.raises(ValueError, match=r"expected voxels between -2\*\*30 - 2\*\*16 and"):
        module((edge, 0, 0), (1, 1, 1))


@pytest.mark.parametrize("name", SHIPPED)
@pytest.mark.parametrize("footprint", [None, "radii", "axes"])
def test_gradients_of_points_are_those_of_the_jacobians(name: str, footprint: str | None) -> None:
    texture = solidtex.load(name, seed=2)
    random = np.random.default_rng(1)
    numbers = random.uniform(0, 20, (2, 30, 3)).astype(np.float32)
    more = {None: {}, "radii": {"radii": 2.0}, "axes": {"axes": 2 * np.eye(3)}}[footprint]
    points = torch.from_numpy(numbers).requires_grad_()
    values = texture.eval_points(points, (5, 6, 7), **more)
    expected, jacobians = texture.eval_jacobian(numbers, (5, 6, 7), **more)
    assert isinstance(values, torch.Tensor) and (values.detach().numpy() == expected).all()
    weights = torch.from_numpy(random.normal(size=values.shape).astype(np.float32))
    (weights * values).sum().backward()
    assert points.grad is not None
    exact = np.einsum("...c,...cd->...d", weights.numpy(), jacobians)
    np.testing.assert_allclose(points.grad.numpy(), exact, rtol=1e-4, atol=1e-5)
    plain = texture.eval_points(torch.from_numpy(numbers), (5, 6, 7), **more)
    assert isinstance(plain, np.ndarray) and (plain == expected).all()


@pytest.mark.parametrize("name", SHIPPED)
def test_gradients_are_differences_of_values(name: str) -> None:
    """torch.autograd.gradcheck for float32: central differences, with steps that it can hold."""
    texture = solidtex.load(name)
    points = torch.rand(50, 3, generator=torch.Generator().manual_seed(3)) * 16
    points.requires_grad_()
    texture.eval_points(points).sum().backward()
    assert points.grad is not None
    step, corners = 1 / 512, points.detach().numpy()
    for axis in range(3):
        move = step * np.eye(3, dtype=np.float32)[axis]
        ahead, behind = texture.eval_points(corners + move), texture.eval_points(corners - move)
        slopes = (ahead - behind).sum(-1) / (2 * step)
        found = points.grad.numpy()[:, axis]
        assert np.corrcoef(slopes, found)[0, 1] > 0.99
        assert np.median(np.abs(slopes - found)) < 0.005 * found.std()


@pytest.mark.parametrize("power", [1, 2])
def test_second_derivatives_are_refused_for_linear_losses_too(power: int) -> None:
    points = torch.rand(4, 3, requires_grad=True)
    loss = (solidtex.load("granite-grey").eval_points(points) ** power).sum()
    (gradient,) = torch.autograd.grad(loss, points, create_graph=True)
    assert gradient.requires_grad and gradient.abs().sum() > 0
    with pytest.raises(ValueError, match="found a second derivative, expected first ones only"):
        gradient.square().sum().backward()


def test_points_in_double_precision_have_gradients_in_it() -> None:
    points = torch.rand(4, 3, dtype=torch.float64, requires_grad=True)
    values = solidtex.load("granite-grey").eval_points(points)
    assert values.dtype == torch.float64
    values.sum().backward()
    assert points.grad is not None and points.grad.dtype == torch.float64
