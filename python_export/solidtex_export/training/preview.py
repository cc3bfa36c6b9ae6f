"""The preview sheet: exemplars beside three axis slices and a 45 degree slice of one solid.

One row for the colour, and one below it for each further channel.
"""

from __future__ import annotations

from collections.abc import Sequence

import torch
import torch.nn.functional as F
from torch import Tensor, nn

from solidtex_export.generators.lattice import XYZ, Axes, Box, FieldGenerator
from solidtex_export.generators.sampler import HashedLattice, OctaveSampler
from solidtex_export.training.display import Display
from solidtex_export.training.exemplar import Exemplar
from solidtex_export.training.slices import SLICE_AXES, axis_frame, plane_points

GAP = 4
BLOCK = 32
DIAGONAL = (torch.tensor([0.5**0.5, 0.5**0.5, 0.0]), torch.tensor([0.0, 0.0, -1.0]))


def preview_sheet(generator: nn.Module, exemplars: Sequence[Exemplar], size: int) -> Tensor:
    """Colours [3, rows, columns]: exemplars, slices normal to x, y and z, the 45 degree slice."""
    display = Display(exemplars)
    slices = [s.cpu() for s in solid_slices(generator, size)]
    columns = [display.images(i) for i in [*(e.image[:, :size, :size] for e in exemplars), *slices]]
    return _stacked([_stacked(list(row), 2) for row in zip(*columns, strict=True)], 1)


@torch.no_grad()
def solid_slices(generator: nn.Module, size: int) -> list[Tensor]:
    """Channels [channel, row, column] of slices normal to x, y and z, and of the 45 degree one."""
    was_training = generator.training
    generator.eval()
    if isinstance(generator, FieldGenerator):
        slices = _lattice_slices(generator, size)
    else:
        assert isinstance(generator, OctaveSampler)
        slices = _sampler_slices(generator, size)
    generator.train(was_training)
    return slices


def _stacked(images: list[Tensor], dim: int) -> Tensor:
    """Images [3, row, column] one after another along `dim`, white between and beside them."""
    height, width = (max(i.shape[d] for i in images) for d in (1, 2))
    padded = []
    for image in images:
        right = GAP if dim == 2 else width - image.shape[2]
        below = GAP if dim == 1 else height - image.shape[1]
        padded.append(F.pad(image, (0, right, 0, below), value=1.0))
    return torch.cat(padded, dim=dim).narrow(dim, 0, sum(p.shape[dim] for p in padded) - GAP)


def evaluate(
    generator: FieldGenerator, noise: list[Tensor], whole: Box, box: Box, axes: Axes = XYZ
) -> Tensor:
    """Whitened values of `box`, from the noise of the larger box `whole`."""
    parts = []
    boxes = zip(noise, generator.noise_boxes(whole), generator.noise_boxes(box), strict=True)
    for values, available, needed in boxes:
        for axis in range(3):
            start = needed.lo[axis] - available.lo[axis]
            values = values.narrow(axis + 2, start, needed.size[axis])
        parts.append(values)
    return generator(parts, box, axes)


def _lattice_slices(generator: FieldGenerator, size: int) -> list[Tensor]:
    whole = Box((0, 0, 0), (size, size, size))
    noise = generator.draw_noise(whole)
    slices = []
    for direction in SLICE_AXES:
        axis = "xyz".index(direction)
        lo, hi = [0, 0, 0], [size, size, size]
        lo[axis], hi[axis] = size // 2, size // 2 + 1
        y = evaluate(generator, noise, whole, Box(tuple(lo), tuple(hi)))
        image = generator.colors(y)[0].squeeze(axis + 1)  # [channel, columns, rows]
        slices.append(image.transpose(1, 2).flip(1))
    slices.append(_diagonal(generator, noise, whole))
    return slices


def _diagonal(generator: FieldGenerator, noise: list[Tensor], whole: Box) -> Tensor:
    """The vertical plane through the diagonal of x and y, trilinear between voxel centres."""
    size = whole.size[2]
    width = min(size, int(size / DIAGONAL[0][0]) - 1)
    side = int(width * DIAGONAL[0][0]) + 2
    image = []
    for top in range(0, size, BLOCK):
        box = Box((0, 0, top), (side, side, min(top + BLOCK, size)))
        solid = generator.colors(evaluate(generator, noise, whole, box))
        column = torch.arange(width, device=solid.device) * DIAGONAL[0][0]
        at = 2 * column / (side - 1) - 1
        rows = torch.arange(solid.shape[4], device=solid.device)
        z = 2 * rows / max(solid.shape[4] - 1, 1) - 1
        # grid_sample's coordinates run backwards through the axes: (z, y, x)
        grid = torch.stack(
            [z[:, None].expand(-1, width), at.expand(len(z), -1), at.expand(len(z), -1)], dim=-1
        )
        image.append(F.grid_sample(solid, grid[None, None], align_corners=True)[0, :, 0])
    return torch.cat(image, dim=1).flip(1)


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
