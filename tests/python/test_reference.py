"""The float64 oracle against definitions written out, and against the trained torch modules."""

import itertools

import numpy as np
import pytest
import torch

from solidtex_export.export import random_models
from solidtex_export.export.file_format.model_file import ModelFile, validate
from solidtex_export.export.verification import noise
from solidtex_export.export.verification.reference import (
    evaluate_box,
    evaluate_points,
    octave_noise,
)

MODELS = {
    "operations": random_models.every_operation_model(),
    "lattice": random_models.lattice_model(levels=3, noise=2, step=3),
    "sampler": random_models.sampler_model(octaves=4, hidden=3, width=7),
}


@pytest.mark.parametrize("name", MODELS)
def test_models_are_valid(name: str) -> None:
    validate(MODELS[name])


@pytest.mark.parametrize("name", MODELS)
@pytest.mark.parametrize("origin", [(0, 0, 0), (-7, 3, -(2**30)), (2**30, 1, -1)])
def test_a_box_is_made_of_single_voxels(name: str, origin: tuple[int, int, int]) -> None:
    size = (3, 2, 4)
    whole = evaluate_box(MODELS[name], origin, size, seed=4)
    assert whole.shape == (*size, 3)
    for voxel in itertools.product(*map(range, size)):
        corner = [o + v for o, v in zip(origin, voxel, strict=True)]
        single = evaluate_box(MODELS[name], corner, (1, 1, 1), seed=4)
        np.testing.assert_allclose(single[0, 0, 0], whole[voxel], rtol=0, atol=1e-12)


@pytest.mark.parametrize("name", MODELS)
def test_points(name: str) -> None:
    origin = np.array([-4, 2, 7])
    box = evaluate_box(MODELS[name], origin, (2, 2, 2))
    centers = [origin + 0.5, origin + np.array([1.5, 0.5, 1.5])]
    found = evaluate_points(MODELS[name], np.array(centers))
    np.testing.assert_allclose(found, [box[0, 0, 0], box[1, 0, 1]], rtol=0, atol=1e-12)
    if name != "sampler":
        # Keys 1981, a = -3/4, by hand: half-way -3/32, 19/32, 19/32, -3/32; a quarter after a voxel
        # -27/256, 225/256, 67/256, -9/256.
        half, quarter = np.array([-3, 19, 19, -3]) / 32, np.array([-27, 225, 67, -9]) / 256
        around = evaluate_box(MODELS[name], origin - 1, (4, 4, 4))
        between = evaluate_points(MODELS[name], origin[None] + [1.0, 0.5, 0.75])
        expected = np.einsum("i,k,ikc->c", half, quarter, around[:, 1])
        np.testing.assert_allclose(between[0], expected, atol=1e-12)


def field_model(nodes: list[dict], tensors: dict[str, np.ndarray]) -> ModelFile:
    field = {"nodes": nodes, "output": nodes[-1]["name"]}
    model = ModelFile(random_models.document("field", field), tensors)
    model.document["channels"] = ["value"]
    validate(model)
    return model


@pytest.mark.parametrize(("kernel", "padding"), [(1, 0), (2, 0), (2, 1), (3, 1), (4, 1), (5, 4)])
def test_transposed_convolution_is_the_sum_of_its_definition(kernel: int, padding: int) -> None:
    rng = np.random.default_rng(kernel)
    weight = rng.normal(size=(1, 1, kernel, kernel, kernel)).astype(np.float32)
    transposed = {"kernel": kernel, "padding": padding, "out_channels": 1}
    model = field_model(
        [
            {"name": "z", "op": "noise", "level": 1, "channels": 1, "distribution": "normal"},
            {"name": "t", "op": "conv_transpose3d", "inputs": ["z"], **transposed},
        ],
        {"t.weight": weight, "t.bias": np.array([0.25], np.float32)},
    )
    origin, size = (-3, 2, -1), (4, 3, 4)
    found = evaluate_box(model, origin, size)
    z = noise.block("solidtex-1", "normal", 0, 1, 1, (-8, -8, -8), (8, 8, 8))[0]
    for voxel in itertools.product(*map(range, size)):
        o = [a + b for a, b in zip(origin, voxel, strict=True)]
        expected = 0.25
        for i in itertools.product(range(-6, 6), repeat=3):
            t = [o[axis] - 2 * i[axis] + padding for axis in range(3)]
            if all(0 <= tap < kernel for tap in t):
                expected += weight[0, 0][tuple(t)] * z[i[0] + 8, i[1] + 8, i[2] + 8]
        assert found[voxel][0] == pytest.approx(expected, abs=1e-12)


def test_convolution_is_centered_and_upsampling_floors() -> None:
    weight = np.random.default_rng(0).normal(size=(1, 1, 3, 3, 3)).astype(np.float32)
    model = field_model(
        [
            {"name": "z", "op": "noise", "level": 1, "channels": 1, "distribution": "uniform"},
            {"name": "up", "op": "upsample", "inputs": ["z"]},
            {"name": "c", "op": "conv3d", "inputs": ["up"], "out_channels": 1, "kernel": 3},
        ],
        {"c.weight": weight, "c.bias": np.array([-1], np.float32)},
    )
    found = evaluate_box(model, (-5, 0, 3), (1, 1, 1))[0, 0, 0, 0]
    expected = -1.0
    for t in itertools.product(range(3), repeat=3):
        i = [(o + tap - 1) // 2 for o, tap in zip((-5, 0, 3), t, strict=True)]
        value = noise.uniform("solidtex-1", 0, 1, 0, *map(np.int64, i)).item()
        expected += float(weight[0, 0][t]) * value
    assert found == pytest.approx(expected, abs=1e-12)


def test_sampler_is_the_trained_network() -> None:
    network = random_models.sampler(octaves=8, hidden=5, width=12, seed=3).double()
    model = random_models.sampler_model(octaves=8, hidden=5, width=12, seed=3)

    def lattice(cells: torch.Tensor) -> torch.Tensor:
        octaves = cells.long().numpy()
        values = [noise.normal("solidtex-1", 5, i, 0, *cell.T) for i, cell in enumerate(octaves)]
        return torch.from_numpy(np.stack(values))

    points = torch.rand(50, 3, dtype=torch.float64) * 20 - 10
    with torch.no_grad():
        expected = network.colors(network(points, lattice))
    found = evaluate_points(model, points.numpy(), seed=5)
    np.testing.assert_allclose(found, expected.numpy(), rtol=0, atol=2e-5)  # float32 weights


def test_octave_noise_interpolates_lattice_values() -> None:
    corners = np.array([[2.0, -3.0, 4.0], [3.0, -3.0, 4.0]])
    low, high = octave_noise("solidtex-1", 1, 2, corners)
    np.testing.assert_array_equal(low, noise.normal("solidtex-1", 1, 2, 0, 2, -3, 4))
    between = octave_noise("solidtex-1", 1, 2, np.array([[2.25, -3.0, 4.0]]))
    np.testing.assert_allclose(between, [0.75 * low + 0.25 * high], atol=1e-15)
