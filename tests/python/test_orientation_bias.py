"""Orientations that slices share: what counts as a bias, and from when on."""

from pathlib import Path

import pytest
import torch
from small_trainings import assert_equal, make_trainer, save_photo
from torch import Tensor

from solidtex_export.losses.orientation_bias import WEIGHT, CommonBias, orientation_bias
from solidtex_export.losses.wavelets import WaveletLoss


def test_orientation_bias_is_what_the_symmetry_excludes() -> None:
    energies = torch.tensor([[4.0, 1.0, 2.0, 3.0], [1.0, 1.0, 1.0, 1.0]])
    assert orientation_bias(energies, "all").tolist() == [
        [pytest.approx(-0.2), pytest.approx(0.2)],
        [0, 0],
    ]
    assert orientation_bias(energies, "flips").tolist() == [[pytest.approx(-0.2)], [0]]


def test_alternating_biases_cancel() -> None:
    common = CommonBias()
    for step in range(100):
        values = common.loss(torch.tensor([[0.3 * (-1) ** step]]))
    assert values == 0


def test_a_common_bias_has_a_larger_loss_than_chance() -> None:
    """Slices vary by 0.2; what they have in common is nothing, then a third of that."""
    pulls = {}
    for shared in (0.0, 0.07):
        common = CommonBias()
        for _ in range(400):
            found = (shared + 0.2 * torch.randn(4, 1)).requires_grad_()
            (gradient,) = torch.autograd.grad(common.loss(found), found)
            pulls[shared] = pulls.get(shared, 0.0) + gradient.mean() / 400
    exact = WEIGHT / 4 * 0.07 / (0.2**2 + 0.07**2)
    assert abs(pulls[0.0]) < 0.05 * exact
    assert 0.3 * exact < pulls[0.07] < 1.2 * exact


def test_the_average_survives_a_restart() -> None:
    common, again = CommonBias(), CommonBias()
    for _ in range(5):
        common.loss(torch.randn(3, 2))
    again.restore(common.state(), torch.device("cpu"))
    found = torch.randn(3, 2)
    assert torch.equal(common.loss(found), again.loss(found))


def sheets(angle: float, phase: float) -> Tensor:
    """Waves of one direction [1, 1, row, column], in radians from columns, 8 pixels long."""
    rows, columns = torch.meshgrid(torch.arange(48.0), torch.arange(48.0), indexing="ij")
    along = torch.tensor(angle)
    return torch.sin(0.785 * (along.cos() * columns + along.sin() * rows) + phase)[None, None]


@pytest.mark.parametrize("angle", [0.0, 0.785, 1.571, 2.356])
def test_a_lasting_bias_of_a_free_direction_has_a_loss(angle: float) -> None:
    loss = WaveletLoss(torch.randn(1, 64, 64), 48, "flips")
    values = [float(loss.orientation_bias(sheets(angle, phase), "z")) for phase in range(8)]
    assert values[-1] > 0.1 * WEIGHT
    turned = sheets(angle + 1.571, 0.0)
    assert float(loss.orientation_bias(turned, "z")) < -0.1 * WEIGHT


def drawn(tmp_path: Path, *options: str) -> list[str]:
    """Directions of the first steps of a training."""
    photo = save_photo(tmp_path / "photo.png")
    trainer = make_trainer([photo], tmp_path / "result", "lattice", *options)
    found = []
    for step in range(12):
        trainer.step = step
        ((direction, _),) = trainer._passes()
        found.append(direction)
    return found


def test_a_quarter_of_the_steps_look_along_the_grain(tmp_path: Path) -> None:
    options = "--directions", "xy", "--symmetry", "flips"
    assert "".join(drawn(tmp_path, *options)) == "zxyxzyxyzxyx"


@pytest.mark.parametrize("options", [["--directions", "xy", "--symmetry", "none"], []])
def test_otherwise_all_steps_are_compared_with_the_photograph(
    options: list[str], tmp_path: Path
) -> None:
    directions = drawn(tmp_path, *options)
    assert directions == (["x", "y"] * 6 if options else ["x", "y", "z"] * 4)


def test_a_free_direction_is_trained_and_resumed(tmp_path: Path) -> None:
    photo = save_photo(tmp_path / "photo.png")
    networks = []
    for name, ends in (("whole", [6]), ("parts", [3, 6])):
        for end in ends:
            options = ["--directions", "xy", "--symmetry", "flips", "--steps", "6"]
            trainer = make_trainer([photo], tmp_path / name, "lattice", *options)
            trainer.run(stop=lambda t=trainer, e=end: t.step == e, report=lambda _: None)
        assert trainer.step == 6
        networks.append(trainer.generator.state_dict())
    assert_equal(*networks)
