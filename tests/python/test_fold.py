"""Folding a trained lattice generator, and what is said about state dicts that are not one."""

import numpy as np
import pytest
import torch
import torch.nn.functional as F

from solidtex_export.export import random_models
from solidtex_export.export.file_format.model_file import ModelFile
from solidtex_export.export.fold import fold_lattice, norm_into_next, norm_into_previous
from solidtex_export.export.lattice_state import StateError, check_lattice_state
from solidtex_export.export.verification import noise
from solidtex_export.export.verification.reference import evaluate_box
from solidtex_export.generators.lattice import Box

NEGATIVE_SLOPE = random_models.NEGATIVE_SLOPE


def random(*shape: int) -> torch.Tensor:
    return torch.randn(shape, dtype=torch.float64)


def test_norm_into_previous_is_exact() -> None:
    torch.manual_seed(0)
    x, weight, bias = random(1, 3, 5, 5, 5), random(4, 3, 3, 3, 3), random(4)
    scale, shift = random(4), random(4)
    expected = F.conv3d(x, weight, bias) * scale.view(-1, 1, 1, 1) + shift.view(-1, 1, 1, 1)
    found = F.conv3d(x, *norm_into_previous(weight, bias, scale, shift))
    torch.testing.assert_close(found, expected, rtol=0, atol=1e-12)


def test_norm_into_next_is_exact_and_leaves_other_channels_alone() -> None:
    torch.manual_seed(1)
    x, weight, bias = random(1, 5, 5, 5, 5), random(4, 5, 3, 3, 3), random(4)
    scale, shift = random(2), random(2)
    normed = x[:, :2] * scale.view(-1, 1, 1, 1) + shift.view(-1, 1, 1, 1)
    expected = F.conv3d(torch.cat([normed, x[:, 2:]], dim=1), weight, bias)
    found = F.conv3d(x, *norm_into_next(weight, bias, scale, shift))
    torch.testing.assert_close(found, expected, rtol=0, atol=1e-12)


@pytest.mark.parametrize("sizes", [(6, 3, 4), (1, 1, 1), (2, 5, 3), (4, 2, 2)])
def test_folded_model_is_the_trained_network(sizes: tuple[int, int, int]) -> None:
    state = random_models.lattice_state(*sizes, seed=2)
    shape = check_lattice_state(state)
    assert (shape.levels, shape.noise_channels, shape.step_channels) == sizes
    generator = shape.generator(NEGATIVE_SLOPE).double().eval()
    generator.load_state_dict(state)
    field, tensors = fold_lattice(state, NEGATIVE_SLOPE)
    model = ModelFile(random_models.document("field", field), tensors)
    for origin, size in [((0, 0, 0), (4, 4, 4)), ((-3, 5, -9), (3, 2, 1))]:
        box = Box(origin, tuple(o + s for o, s in zip(origin, size, strict=True)))
        z = [
            torch.from_numpy(noise.block("solidtex-1", "uniform", 7, level, sizes[1], b.lo, b.hi))
            for level, b in enumerate(generator.noise_boxes(box))
        ]
        with torch.no_grad():
            expected = generator.colors(generator([values[None] for values in z], box))
        found = evaluate_box(model, origin, size, seed=7)
        np.testing.assert_allclose(
            found, expected[0].permute(1, 2, 3, 0).numpy(), rtol=0, atol=5e-6
        )


def test_the_papers_parameter_count() -> None:
    """84 963 with batch normalization; folding leaves the convolutions' weights and biases."""
    state = random_models.lattice_state(6, 3, 4)
    parts = (".weight", ".bias")
    assert sum(v.numel() for k, v in state.items() if k.endswith(parts)) == 84963
    _, tensors = fold_lattice(state, NEGATIVE_SLOPE)
    convolutions = {k for k in state if k.endswith(parts) and "bn" not in k}
    assert set(tensors) == convolutions


def broken(key: str, value: torch.Tensor | None) -> dict[str, torch.Tensor]:
    state = random_models.lattice_state(3, 2, 3)
    if value is None:
        del state[key]
    else:
        state[key] = value
    return state


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("cb2_1.conv1.weight", None, "cb2_1.conv1.weight: found nothing"),
        ("cb1_1.conv1.weight", None, "cb1_1.conv1.weight: found nothing"),
        ("up1.bn.running_mean", None, "up1.bn.running_mean: found nothing"),
        ("last_conv.bias", torch.zeros(4), r"last_conv.bias: found shape \(4,\), expected \(3,\)"),
        ("cb2_2.bn1.weight", torch.zeros(5), r"found shape \(5,\), expected \(6,\)"),
        ("cb1_1.conv1.weight", torch.zeros(3, 2), r"found shape \(3, 2\), expected \[out, in"),
        ("cb9_3.conv1.weight", torch.zeros(1), "cb9_3.conv1.weight: found an unexpected key"),
        ("cb99_1.conv1.weight", torch.zeros(1), "found 99 levels, expected at most 21"),
        ("cb1_1.bn1.bias", torch.full((3,), torch.nan), "cb1_1.bn1.bias: found .*non-finite"),
        ("cb1_1.bn1.running_var", -torch.ones(3), "running_var: found a negative variance"),
        ("cb1_1.bn1.bias", torch.zeros(3, dtype=torch.int64), "int64"),
    ],
)
def test_wrong_state_dicts_are_named(key: str, value: torch.Tensor | None, message: str) -> None:
    with pytest.raises(StateError, match=message):
        fold_lattice(broken(key, value), NEGATIVE_SLOPE)
