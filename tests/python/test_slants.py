"""Slants that slices share: what counts as one, and from when on."""

import pytest
import torch

from solidtex_export.losses.slants import WEIGHT, CommonSlants, slants


def test_slants_are_what_the_symmetry_forbids() -> None:
    energies = torch.tensor([[4.0, 1.0, 2.0, 3.0], [1.0, 1.0, 1.0, 1.0]])
    assert slants(energies, "all").tolist() == [[pytest.approx(-0.2), pytest.approx(0.2)], [0, 0]]
    assert slants(energies, "flips").tolist() == [[pytest.approx(-0.2)], [0]]


def test_slants_of_either_kind_in_turn_are_none() -> None:
    common = CommonSlants()
    for step in range(100):
        values = common.loss(torch.tensor([[0.3 * (-1) ** step]]))
    assert values == 0


def test_chance_asks_for_little_and_a_common_slant_for_much() -> None:
    """Slices vary by 0.2; what they have in common is nothing, then a third of that."""
    pulls = {}
    for shared in (0.0, 0.07):
        common = CommonSlants()
        for _ in range(400):
            found = (shared + 0.2 * torch.randn(4, 1)).requires_grad_()
            (gradient,) = torch.autograd.grad(common.loss(found), found)
            pulls[shared] = pulls.get(shared, 0.0) + gradient.mean() / 400
    exact = WEIGHT / 4 * 0.07 / (0.2**2 + 0.07**2)
    assert abs(pulls[0.0]) < 0.05 * exact
    assert 0.3 * exact < pulls[0.07] < 1.2 * exact


def test_a_restart_remembers() -> None:
    common, again = CommonSlants(), CommonSlants()
    for _ in range(5):
        common.loss(torch.randn(3, 2))
    again.restore(common.state(), torch.device("cpu"))
    found = torch.randn(3, 2)
    assert torch.equal(common.loss(found), again.loss(found))
