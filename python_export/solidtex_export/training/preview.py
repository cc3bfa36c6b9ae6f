"""Preview sheet: exemplars beside three axis slices and a 45 degree slice of one solid."""

from __future__ import annotations

from collections.abc import Sequence

import torch
from torch import Tensor, nn

from solidtex_export.generators.fixed_noise import FixedNoise
from solidtex_export.generators.lattice import BaseLattice, Box
from solidtex_export.generators.oblique import AFTER, BEFORE, cubic_columns
from solidtex_export.generators.sampler import HashedLattice, OctaveSampler
from solidtex_export.generators.slices import SLICE_AXES, axis_frame, plane_points
from solidtex_export.images.exemplar import Exemplar
from solidtex_export.images.sheet import sheet_of

BLOCK = 32
DIAGONAL = (torch.tensor([0.5**0.5, 0.5**0.5, 0.0]), torch.tensor([0.0, 0.0, -1.0]))


def preview_sheet(generator: nn.Module, exemplars: Sequence[Exemplar], size: int) -> Tensor:
    """Colors [3, rows, columns]: exemplars, slices normal to x, y and z, the 45 degree slice."""
    return sheet_of([s.cpu() for s in solid_slices(generator, size)], exemplars, size)


@torch.no_grad()
def solid_slices(generator: nn.Module, size: int) -> list[Tensor]:
    """Channels [channel, row, column] of slices normal to x, y and z, and of the 45 degree one."""
    was_training = generator.training
    generator.eval()
    if isinstance(generator, BaseLattice):
        slices = _lattice_slices(generator, size)
    else:
        assert isinstance(generator, OctaveSampler)
        slices = _sampler_slices(generator, size)
    generator.train(was_training)
    return slices


def _lattice_slices(generator: BaseLattice, size: int) -> list[Tensor]:
    solid = FixedNoise(generator)
    slices = []
    for direction, (columns, rows) in SLICE_AXES.items():
        axis = "xyz".index(direction)
        lo, hi = [0, 0, 0], [size, size, size]
        lo[axis], hi[axis] = size // 2, size // 2 + 1
        image = solid.colors(Box(tuple(lo), tuple(hi)), (axis, rows, columns))
        slices.append(image.squeeze(1).flip(1))
    return [*slices, _diagonal(solid, size)]


def _diagonal(solid: FixedNoise, size: int) -> Tensor:
    """Vertical plane through the diagonal of x and y, interpolated between voxels as the engine
    does.
    """
    parts = []
    for left in range(0, size, BLOCK):
        steps = torch.arange(left, min(left + BLOCK, size), dtype=torch.float64)
        along = float(DIAGONAL[0][0]) * steps
        lo = int(along[0]) - BEFORE
        hi = int(along[-1]) + AFTER
        block = solid.colors(Box((lo, lo, 0), (hi, hi, size)), (2, 0, 1))
        parts.append(cubic_columns(block[None], along - lo, along - lo)[0])
    return torch.cat(parts, dim=2).flip(1)


def _sampler_slices(generator: OctaveSampler, size: int) -> list[Tensor]:
    device = generator.color_mean.device
    lattice = HashedLattice(generator.octaves, device)
    slices = []
    for right, down in [*(axis_frame(d) for d in SLICE_AXES), DIAGONAL]:
        origin = torch.full((3,), size / 2) - (right + down) * size / 2
        points = plane_points(origin, right, down, size, size).to(device)
        y = generator(points, lattice).T.view(1, -1, size, size)
        slices.append(generator.colors(y)[0])
    return slices
