"""Generators: sizes, slices and blocks, noise, and what a sampler computes."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import torch
from small_trainings import make_trainer, save_photo, save_specks

from solidtex_export.analysis.grain import grain_ratio
from solidtex_export.export.verification.reference import cubic_convolution
from solidtex_export.generators.fixed_noise import FixedNoise
from solidtex_export.generators.lattice import Box, LatticeGenerator
from solidtex_export.generators.pyramid import PyramidGenerator
from solidtex_export.generators.sampler import HashedLattice, OctaveSampler, trilinear
from solidtex_export.generators.slices import LatticeSlices, SamplerSlices
from solidtex_export.images.exemplar import load_exemplar
from solidtex_export.training import preview

torch.set_num_threads(1)


def test_lattice_generator_has_the_papers_size() -> None:
    generator = LatticeGenerator()
    assert sum(p.numel() for p in generator.parameters()) == 84963


def test_one_voxel_needs_at_most_the_papers_noise() -> None:
    generator = LatticeGenerator()
    bound = (9, 11, 13, 13, 13, 9)
    for x in range(-40, 40):
        boxes = generator.noise_boxes(Box((x, x, x), (x + 1, x + 1, x + 1)))
        assert all(b.size[0] <= most for b, most in zip(boxes, bound, strict=True))


GENERATORS = {
    "lattice": LatticeGenerator(levels=4),
    "pyramid": PyramidGenerator(levels=3, noise_channels=2, width=4),
}


@pytest.mark.parametrize("kind", GENERATORS)
@pytest.mark.parametrize("axes", [(0, 1, 2), (1, 2, 0), (2, 1, 0)])
def test_slice_equals_the_same_region_of_a_block(kind: str, axes: tuple[int, int, int]) -> None:
    torch.manual_seed(2)
    solid = FixedNoise(GENERATORS[kind].double().eval())
    block = solid.colors(Box((-7, 3, 20), (6, 14, 33)))[:, 5:6, 2:9, 1:10]
    part = solid.colors(Box((-2, 5, 21), (-1, 12, 30)), axes)
    assert (part - block.permute(0, *(a + 1 for a in axes))).abs().max() < 1e-12


def test_fixed_noise_has_the_generators_distribution() -> None:
    for generator in GENERATORS.values():
        solid = FixedNoise(generator)
        box = Box((-9, 0, 5), (31, 40, 45))
        drawn = zip(solid.draw(box, (0, 1, 2)), generator.draw_noise(box), strict=True)
        for fixed, fresh in drawn:
            assert fixed.shape == fresh.shape and fixed.dtype == fresh.dtype
            assert abs(float(fixed.mean() - fresh.mean())) < 0.05
            assert abs(float(fixed.std() - fresh.std())) < 0.05
            assert abs(float(fixed.max() - fresh.max())) < 1.5


def test_diagonal_of_the_preview_is_a_cubic_convolution() -> None:
    """Of the 4 x 4 voxels around each point: whatever the network is."""
    generator = LatticeGenerator(levels=4).double().eval()
    torch.manual_seed(4)
    with torch.no_grad():
        image = preview._diagonal(FixedNoise(generator), 40)
    torch.manual_seed(4)
    with torch.no_grad():
        voxels = FixedNoise(generator).colors(Box((-1, -1, 0), (40, 40, 1)))[:, :, :, 0]
    assert image.shape == (3, 40, 40)
    for column in range(40):  # the same x and y, that of the voxel center (0, 0) being 0
        place = column / math.sqrt(2)
        weights = torch.from_numpy(cubic_convolution(np.arange(-1, 40) - place))
        expected = torch.einsum("cxy,x,y->c", voxels, weights, weights)
        assert (image[:, -1, column] - expected).abs().max() < 1e-6  # computed in float32


def test_slices_show_the_documented_axes(monkeypatch: pytest.MonkeyPatch) -> None:
    generator = LatticeGenerator().eval()
    captured: list[tuple[int, ...]] = []

    def forward(noise: list[torch.Tensor], box: Box, axes: tuple[int, ...]) -> torch.Tensor:
        captured.append(axes)
        rows = torch.arange(box.size[1], dtype=torch.float32)
        return rows.view(1, 1, 1, -1, 1).expand(1, 3, 1, -1, box.size[2])

    monkeypatch.setattr(generator, "forward", forward)
    images = [LatticeSlices(generator).draw(d, 8, 1) for d in "xyz"]
    assert captured == [(0, 2, 1), (1, 2, 0), (2, 1, 0)]  # normal, rows, columns
    assert all(i[0, 0, 0, 0] == 7 and i[0, 0, 7, 0] == 0 for i in images)  # rows run downwards


@pytest.mark.parametrize(("planes", "views"), [("axes", "xyz"), ("any", ""), ("about-z", "")])
def test_only_axis_slices_are_averaged_by_direction(planes: str, views: str) -> None:
    slices = SamplerSlices(OctaveSampler(octaves=8, hidden_layers=3, width=16), planes)
    assert "".join(slices.view(d) for d in "xyz") == views


@pytest.mark.parametrize(("save", "is_long"), [(save_photo, True), (save_specks, False)])
def test_a_sampler_of_wood_starts_with_longer_grain_than_measured(
    save: Callable[[Path], Path], is_long: bool, tmp_path: Path
) -> None:
    """Grain shorter along z than across is stretched along x and y, as measured."""
    photo = save(tmp_path / "photo.png")
    scales = []
    for directions in ("xyz", "xy"):
        result = tmp_path / directions
        generator = make_trainer([photo], result, "gramgan", "--directions", directions).generator
        assert isinstance(generator, OctaveSampler)
        scales.append(generator.scales)
    measured = grain_ratio(load_exemplar(photo, 48, 32, None, {}, "srgb"))
    assert (measured > 8) == is_long
    stretch = scales[0] / scales[1]
    across, along = stretch[..., :2], stretch[..., 2:]
    kept, stretched = (across, along) if measured >= 1 else (along, across)
    assert torch.equal(kept, torch.ones_like(kept))
    expected = min(2 * measured, 128.0) if measured >= 1 else 1 / measured
    assert torch.allclose(stretched, torch.tensor(expected))


def test_effective_tensors_are_what_the_sampler_computes() -> None:
    torch.manual_seed(3)
    sampler = OctaveSampler(octaves=8, hidden_layers=3, width=16)
    sampler.color_mean.uniform_()
    sampler.color_basis.normal_()
    points = torch.rand(50, 3) * 100 - 50
    lattice = HashedLattice(8, points.device)
    colors = sampler.colors(sampler(points, lattice).T[None])[0].T
    t = sampler.effective_tensors()
    eta = trilinear(
        lattice, torch.einsum("nij,pj->npi", t["transforms"], points.double())
    ).T.double()
    x = t["constant"]
    for i in range(3):
        x = x @ t[f"hidden.{i}.weight"].T + t[f"hidden.{i}.bias"]
        if i < 2:
            x = x + eta[:, 4 * i : 4 * i + 4] @ t[f"hidden.{i}.noise"].T
        x = torch.where(x > 0, x, 0.2 * x)
    expected = x @ t["output.weight"].T + t["output.bias"]
    assert (colors - expected).abs().max() < 1e-3


def test_hashed_lattice_is_white_and_normal() -> None:
    grid = torch.stack(torch.meshgrid(*[torch.arange(-32, 32)] * 3, indexing="ij"), -1)
    values = HashedLattice(2, torch.device("cpu"))(grid.view(1, -1, 3).expand(2, -1, -1))
    assert abs(float(values.mean())) < 0.01 and abs(float(values.std()) - 1) < 0.01
    cube = values.view(2, 64, 64, 64)
    for axis in (0, 1, 2, 3):
        assert abs(float((cube * cube.roll(1, axis)).mean())) < 0.01


def test_corners_are_the_values_at_the_corners() -> None:
    lattice = HashedLattice(4, torch.device("cpu"))
    cells = torch.randint(-9000, 9000, (4, 50, 3))
    corners = lattice.corners(cells)
    for x, y, z in itertools.product((0, 1), repeat=3):
        assert torch.equal(corners[x, y, z], lattice(cells + torch.tensor([x, y, z])))
