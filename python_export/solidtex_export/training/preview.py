"""The preview sheet: exemplars beside three axis slices and a 45 degree slice of one solid."""

from __future__ import annotations

import torch
import torch.nn.functional as F
from torch import Tensor, nn

from solidtex_export.generators.lattice import XYZ, Axes, Box, LatticeGenerator
from solidtex_export.generators.sampler import HashedLattice, OctaveSampler
from solidtex_export.training.slices import SLICE_AXES, axis_frame, plane_points

GAP = 4
BLOCK = 32
DIAGONAL = (torch.tensor([0.5**0.5, 0.5**0.5, 0.0]), torch.tensor([0.0, 0.0, -1.0]))


@torch.no_grad()
def preview_sheet(generator: nn.Module, exemplars: list[Tensor], size: int) -> Tensor:
    """Colours [3, rows, columns]: exemplars, slices normal to x, y and z, the 45 degree slice."""
    was_training = generator.training
    generator.eval()
    if isinstance(generator, LatticeGenerator):
        slices = _lattice_slices(generator, size)
    else:
        assert isinstance(generator, OctaveSampler)
        slices = _sampler_slices(generator, size)
    generator.train(was_training)
    images = [e[:, :size, :size] for e in exemplars] + [s.cpu() for s in slices]
    height = max(i.shape[1] for i in images)
    images = [F.pad(i, (0, GAP, 0, height - i.shape[1]), value=1.0) for i in images]
    return torch.cat(images, dim=2)[:, :, :-GAP]


def evaluate(
    generator: LatticeGenerator, noise: list[Tensor], whole: Box, box: Box, axes: Axes = XYZ
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


def _lattice_slices(generator: LatticeGenerator, size: int) -> list[Tensor]:
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


def _diagonal(generator: LatticeGenerator, noise: list[Tensor], whole: Box) -> Tensor:
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
