"""The wavelet loss: what it must tell apart, and what it must not."""

import math

import numpy as np
import pytest
import torch
from torch import Tensor

from solidtex_export.losses.orientation_bias import WEIGHT
from solidtex_export.losses.wavelets import WaveletLoss, filter_bank, orientations

SIDE = 128
SLICE = 64


def blobs(seed: int) -> Tensor:
    """Two phases with round borders: anything but Gaussian. [3, SIDE, SIDE]"""
    rng = np.random.default_rng(seed)
    frequency = np.hypot(np.fft.fftfreq(SIDE)[:, None], np.fft.fftfreq(SIDE)[None])
    spectrum = np.fft.fft2(rng.standard_normal((3, SIDE, SIDE))) * np.exp(
        -((frequency / 0.08) ** 2)
    )
    fields = np.sign(np.fft.ifft2(spectrum).real)
    return torch.from_numpy(fields).float()


def scrambled(image: Tensor) -> Tensor:
    """The same spectrum with random phases."""
    noise = torch.fft.fft2(torch.randn(SIDE, SIDE, generator=torch.Generator().manual_seed(0)))
    return torch.fft.ifft2(torch.fft.fft2(image) * noise / noise.abs()).real


def crop(image: Tensor) -> Tensor:
    return image[None, :, :SLICE, :SLICE]


def fresh_distance(exemplar: Tensor, slices: Tensor) -> float:
    return float(WaveletLoss(exemplar, SLICE, "all")(slices))


def test_another_part_of_the_texture_is_nearer_than_anything_else() -> None:
    exemplar = blobs(1)
    same = fresh_distance(exemplar, crop(blobs(2)))
    assert fresh_distance(exemplar, crop(scrambled(exemplar))) > 1.4 * same
    noise = torch.randn(1, 3, SLICE, SLICE, generator=torch.Generator().manual_seed(4))
    assert fresh_distance(exemplar, noise) > 3 * same
    squeezed = torch.nn.functional.interpolate(blobs(2)[None], size=(SIDE // 2, SIDE))
    assert fresh_distance(exemplar, squeezed[:, :, :, :SLICE]) > 2 * same


def test_a_slice_is_compared_in_every_orientation_of_the_symmetry() -> None:
    exemplar = blobs(1)
    image = crop(blobs(3))
    upright = fresh_distance(exemplar, image)
    assert fresh_distance(exemplar, image.transpose(2, 3)) == pytest.approx(upright, rel=0.05)


@pytest.mark.parametrize(("symmetry", "count"), [("all", 8), ("flips", 4), ("none", 1)])
def test_orientations_are_all_different(symmetry: str, count: int) -> None:
    copies = orientations(torch.arange(12.0).view(1, 3, 4), symmetry)
    assert len({(c.shape, tuple(c.flatten().tolist())) for c in copies}) == count


def test_filters_ignore_a_constant_and_have_unit_length() -> None:
    bank = filter_bank()
    torch.testing.assert_close(bank.sum((1, 2)), torch.zeros(len(bank)), atol=1e-5, rtol=0)
    torch.testing.assert_close(bank.flatten(1).norm(dim=1), torch.ones(len(bank)))


@pytest.mark.parametrize("channels", [1, 2, 5])
def test_any_number_of_channels_and_a_gradient(channels: int) -> None:
    loss = WaveletLoss(torch.randn(channels, 70, 90), 48, "flips")
    slices = torch.randn(2, channels, 48, 48).requires_grad_()
    (gradient,) = torch.autograd.grad(loss(slices), slices)
    assert gradient.isfinite().all() and gradient.norm() > 0


def test_earlier_slices_count_and_survive_a_restart() -> None:
    exemplar = blobs(1)
    first, second = torch.randn(2, 1, 3, SLICE, SLICE)
    loss = WaveletLoss(exemplar, SLICE, "all")
    loss(first)
    resumed = WaveletLoss(exemplar, SLICE, "all")
    resumed.restore(loss.state())
    expected = loss(second)
    assert torch.equal(resumed(second), expected)
    assert not torch.equal(WaveletLoss(exemplar, SLICE, "all")(second), expected)


def test_smaller_slices_leave_the_average_of_coarse_octaves_alone() -> None:
    loss = WaveletLoss(blobs(1), SLICE, "all")
    loss(crop(blobs(2)))
    before = loss.state()["averages"][""]["average"][-1][0]
    loss(blobs(2)[None, :, :24, :24])
    assert torch.equal(loss.state()["averages"][""]["average"][-1][0], before)


def slanted(angle: float) -> Tensor:
    """Crests along one direction, degrees: [1, 3, SLICE, SLICE]."""
    row, column = np.mgrid[:SLICE, :SLICE]
    across = column * math.sin(math.radians(angle)) + row * math.cos(math.radians(angle))
    return torch.from_numpy(np.sign(np.sin(across / 3))).float().expand(1, 3, SLICE, SLICE)


def test_biases_of_different_directions_do_not_cancel() -> None:
    loss = WaveletLoss(blobs(1), SLICE, "all")
    for _ in range(3):
        apart = [float(loss(slanted(angle), view)) for angle, view in ((45, "x"), (-45, "y"))]
        mixed = [float(loss(slanted(angle))) for angle in (45, -45)]
    assert min(apart) > 1.1 * max(mixed)


@pytest.mark.parametrize(
    ("view", "memory"), [("x", [4, 8, 16, 32]), ("", [4, 4, 4, 4])], ids=["axis", "random planes"]
)
def test_the_average_of_a_coarse_octave_is_longer_along_an_axis(
    view: str, memory: list[int]
) -> None:
    loss = WaveletLoss(blobs(1), SLICE, "all")
    seen = torch.randn(80, 1, 3, SLICE, SLICE, generator=torch.Generator().manual_seed(2))
    for slices in seen:
        loss(slices, view)
    before = loss.state()["averages"][view]["average"]
    loss(crop(blobs(2)), view)
    after = loss.state()["averages"][view]["average"]
    found = WaveletLoss(blobs(1), SLICE, "all")
    found(crop(blobs(2)))
    alone = found.state()["averages"][""]["average"]
    shares = [
        float(((new[1] - old[1]) @ (one[1] - old[1])) / (one[1] - old[1]).square().sum())
        for old, new, one in zip(before, after, alone, strict=True)
    ]
    assert shares == pytest.approx([1 / m for m in memory][: len(shares)], rel=1e-3)


def test_empty_channels_do_not_count() -> None:
    gray = blobs(1) * torch.tensor([1.0, 0, 0]).view(3, 1, 1)
    slices = crop(blobs(2)) * torch.tensor([1.0, 0, 0]).view(1, 3, 1, 1)
    tinted = slices + 0.01 * torch.randn(slices.shape, generator=torch.Generator().manual_seed(1))
    assert fresh_distance(gray, tinted) == pytest.approx(fresh_distance(gray, slices), rel=0.1)
    assert fresh_distance(torch.zeros(3, SIDE, SIDE), slices) > 0


def test_rounding_is_not_learned() -> None:
    generator = torch.Generator().manual_seed(1)
    rounding = 0.05 * torch.randn(3, SIDE, SIDE, generator=generator)
    only_first = torch.tensor([1.0, 0, 0]).view(3, 1, 1)
    gray = blobs(1) * only_first
    exemplar = gray + rounding * (1 - only_first)
    slices = crop(blobs(2) * only_first)
    assert fresh_distance(exemplar, slices) == pytest.approx(fresh_distance(gray, slices))


@pytest.mark.parametrize(
    ("symmetry", "angle", "forbidden"),
    [("all", 45, True), ("all", 0, True), ("flips", 45, True), ("flips", 0, False),
     ("none", 45, False)],
)  # fmt: skip
def test_a_common_orientation_bias_has_a_loss(
    symmetry: str, angle: int, forbidden: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    distances = []
    for weight in (0.0, WEIGHT):
        monkeypatch.setattr("solidtex_export.losses.orientation_bias.WEIGHT", weight)
        loss = WaveletLoss(blobs(1), SLICE, symmetry)
        distances.append([float(loss(slanted(angle), "x")) for _ in range(8)][-1])
    assert (distances[1] > distances[0] + 0.05) == forbidden
