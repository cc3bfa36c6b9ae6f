"""Distillation: the network learns what SqueezeNet sees in photographs and procedural textures.

Maps of 1 x 1 predict the features of each of the teacher's layers from those of the network's
layer at the same scale; a texture loss compares what they predict. Colors carry no information:
both networks see an image whose whitened channels are turned at random.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import NamedTuple

import torch
import torch.nn.functional as F
from torch import Tensor

from solidtex_export.losses.descriptor.heads import LAYERS, Heads, group_of
from solidtex_export.losses.descriptor.network import DescriptorNetwork
from solidtex_export.networks.squeezenet import SqueezeNet
from solidtex_export.research.descriptor.pairs import HELD_OUT_SEED, Pool
from solidtex_export.research.procedural import families
from solidtex_export.research.procedural.color import whitened

SIDE = 128  # pixels, of a crop
PHOTOGRAPHS, PROCEDURAL = 6, 2  # crops of a step
BATCH, KEPT_BATCHES = 8, 20  # procedural images generated together, and how many such batches
STEPS_PER_BATCH = 4
STATISTICS_STEPS = 24  # for means and deviations of the teacher's features
SILENT_SHARE = 0.1  # of a layer's mean deviation: the least that a feature is divided by
GRAY, CONTRAST = 0.45, 0.2  # colors that the teacher sees, of whitened values


class Grid(NamedTuple):
    """Where a layer's features are: the center of the first, in pixels, and their distance."""

    first: float
    stride: int


NETWORK_GRIDS = {"conv2_2": Grid(6.5, 2), "conv3_2": Grid(7.5, 4), "conv4_2": Grid(9.5, 8),
                 "conv5_2": Grid(13.5, 16)}  # fmt: skip
TEACHER_GRIDS = {"relu1": Grid(3, 2), "relu2": Grid(5, 4), "relu3": Grid(9, 8)}


def teacher_grid(group: str) -> Grid:
    if not group.startswith("half_"):
        return TEACHER_GRIDS[group]
    grid = TEACHER_GRIDS[group.removeprefix("half_")]
    return Grid(2 * grid.first + 0.5, 2 * grid.stride)


def resampled(features: Tensor, grid: Grid, wanted: Grid) -> Tensor:
    """Features at those places of the wanted grid that lie between theirs."""
    axes = []
    for size in features.shape[2:]:
        last = grid.first + grid.stride * (size - 1)
        first, end = _inside(grid, wanted, size)
        places = wanted.first + wanted.stride * torch.arange(first, end)
        axes.append(2 * (places - grid.first) / (last - grid.first) - 1)
    rows, columns = torch.meshgrid(*axes, indexing="ij")
    at = torch.stack((columns, rows), dim=-1).expand(len(features), -1, -1, -1)
    return F.grid_sample(features, at.to(features.dtype), align_corners=True)


def _inside(grid: Grid, wanted: Grid, size: int) -> tuple[int, int]:
    """Indices of the wanted grid between the first and the last of `size` features."""
    first = -(-(grid.first - wanted.first) // wanted.stride)
    last = (grid.first + grid.stride * (size - 1) - wanted.first) // wanted.stride
    return max(0, int(first)), int(last) + 1


class Distillation:
    """The task of predicting the teacher's features."""

    measured = "share of the teacher's features that is not predicted, by layer"

    def __init__(
        self, seed: int, network: DescriptorNetwork, teacher: SqueezeNet, images: Sequence[Tensor]
    ) -> None:
        """`images` are whitened photographs [3, row, column] of at least SIDE pixels."""
        self.data = f"features of SqueezeNet on {len(images)} photographs and procedural images"
        self._seed, self._network, self._teacher = seed, network, teacher
        self._images = images
        self._pool = Pool(seed, BATCH, KEPT_BATCHES)
        self.heads = Heads(network.widths)
        taught = [self._taught(step) for step in range(-STATISTICS_STEPS, 0)]
        self._statistics = {name: _statistics([t[name] for t in taught]) for name in taught[0]}

    def loss(self, step: int) -> Tensor:
        return torch.stack(list(self._errors(self._crops(step)).values())).mean()

    @torch.no_grad()
    def measures(self) -> dict[str, float]:
        """Share of the features' variance that is not predicted, by layer of the teacher."""
        found = self._errors(self.textures)
        return {name: round(error.item(), 4) for name, error in found.items()}

    @cached_property
    def textures(self) -> Tensor:
        """Crops of procedural images that no step sees, over which features are measured."""
        batches = [families.batch(HELD_OUT_SEED, i, 2, SIDE) for i in range(families.ROUND)]
        return whitened(torch.cat(batches))

    def _errors(self, crops: Tensor) -> dict[str, Tensor]:
        wanted = self._features(crops)
        errors = {}
        with torch.autocast("cpu", torch.bfloat16):
            features = self._network.features(crops)
        for name, of_teacher in wanted.items():
            group = group_of(name)
            layer, grid = features[LAYERS[group]], NETWORK_GRIDS[LAYERS[group]]
            with torch.autocast("cpu", torch.bfloat16):
                predicted = self.heads[name](resampled(layer, grid, teacher_grid(group)))
            rows, columns = (
                slice(*_inside(grid, teacher_grid(group), size)) for size in layer.shape[2:]
            )
            mean, deviation = self._statistics[name]
            normalized = (of_teacher[..., rows, columns] - mean) / deviation
            errors[name] = (predicted.float() - normalized).square().mean()
        return errors

    @torch.no_grad()
    def _features(self, crops: Tensor) -> dict[str, Tensor]:
        with torch.autocast("cpu", torch.bfloat16):
            found = self._teacher.named_features(GRAY + CONTRAST * crops)
        return {name: f.float() for name, f in found.items() if "relu" in name}

    def _taught(self, step: int) -> dict[str, Tensor]:
        return self._features(self._crops(step))

    def _crops(self, step: int) -> Tensor:
        """Crops [crop, 3, SIDE, SIDE], a function of the seed and the step."""
        generator = torch.Generator().manual_seed(
            self._seed * families.SEED_STRIDE + step + STATISTICS_STEPS
        )

        def any_of(items: Sequence[Tensor]) -> Tensor:
            return items[int(torch.randint(len(items), (), generator=generator))]

        procedural = self._procedural(step)
        crops = [_crop(any_of(self._images), generator) for _ in range(PHOTOGRAPHS)]
        crops += [_crop(any_of(procedural), generator) for _ in range(PROCEDURAL)]
        turns, _ = torch.linalg.qr(torch.randn(len(crops), 3, 3, generator=generator))
        return torch.einsum("bij,bjrc->birc", turns, torch.stack(crops))

    def _procedural(self, step: int) -> list[Tensor]:
        """The most recent procedural images."""
        batches = self._pool.before((step + STATISTICS_STEPS) // STEPS_PER_BATCH + 1)
        return [image for batch in batches.values() for image in batch]


def _statistics(batches: Sequence[Tensor]) -> tuple[Tensor, Tensor]:
    """Mean and deviation [1, channel, 1, 1] of features."""
    flat = torch.cat([b.transpose(0, 1).flatten(1) for b in batches], dim=1)
    mean, deviation = flat.mean(1), flat.std(1)
    deviation = deviation + SILENT_SHARE * deviation.mean()
    return mean.view(1, -1, 1, 1), deviation.view(1, -1, 1, 1)


def _crop(image: Tensor, generator: torch.Generator) -> Tensor:
    """A crop in one of eight orientations."""

    def random(high: int) -> int:
        return int(torch.randint(high, (), generator=generator))

    row, column = (random(size - SIDE + 1) for size in image.shape[1:])
    crop = image[:, row : row + SIDE, column : column + SIDE].float()
    crop = torch.rot90(crop, random(4), (1, 2))
    return crop.flip(2) if random(2) else crop
