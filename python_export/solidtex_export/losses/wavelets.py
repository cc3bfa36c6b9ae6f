"""Covariances of rectified wavelet responses: a texture loss without a trained network.

After "Generalized rectifier wavelet covariance models for texture synthesis" (Brochard, Zhang and
Mallat 2022): oriented band-pass filters on every octave, the positive and the negative half of each
response, and the covariances of all those maps within an octave and with every finer one.

A running average over recent slices of a view is compared with the whole exemplar; its window is
longer on coarse octaves. Random planes share one average with the same window on all octaves. Each
octave's distance is relative to that between parts of the photograph: docs/experiments/wavelets.md.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import torch
import torch.nn.functional as F
from torch import Tensor

from solidtex_export.losses.filled import filled_channels
from solidtex_export.losses.orientation_bias import CommonBias, orientation_bias
from solidtex_export.losses.statistics import second_moments

ORIENTATIONS = 4
SIDE = 7  # of a filter, in pixels
WAVELENGTH = 4.0
SPREAD = 1.6  # of the envelope across the wave; along it, 1 / 0.7 of that
FLATNESS = 0.7
SMALLEST = SIDE + 3  # side of the smallest image that is filtered
SD_FLOOR = 0.05
PARTS = 12  # of the photograph; their mean distance is the unit
PART_SIDE = 0.75  # of the photograph's shorter side, at most
UNIT_FLOOR = 1e-4
MEMORY = 4.0  # slices of a view that the average of the finest octave goes back

Statistics = list[tuple[Tensor, Tensor]]
"""Per octave: second moments [map, map] and means [map] of the rectified responses."""


@dataclass
class Average:
    """Running average over the slices of one view."""

    statistics: Statistics = field(default_factory=list)
    seen: int = 0

    def mixed_with(self, found: Statistics, deepens: bool) -> Statistics:
        """Blend the average with a slice's statistics octave by octave; octaves may be missing.

        `deepens` lengthens the window on coarse octaves.
        """
        known = min(len(self.statistics), len(found))
        mixed = []
        for octave, (old, new) in enumerate(zip(self.statistics, found, strict=False)):
            memory = MEMORY * 2**octave if deepens else MEMORY
            share = max(1 / memory, 1 / (self.seen + 1))
            mixed.append((torch.lerp(old[0], new[0], share), torch.lerp(old[1], new[1], share)))
        return mixed + found[known:]

    def remember(self, mixed: Statistics) -> None:
        rest = self.statistics[len(mixed) :]
        self.statistics = [(g.detach(), m.detach()) for g, m in mixed] + rest
        self.seen += 1


class WaveletLoss:
    """Compares slices with one exemplar [channel, rows, columns], both of whitened values."""

    def __init__(self, exemplar: Tensor, size: int, symmetry: str) -> None:
        self._filters = filter_bank().to(exemplar.device)
        self._symmetry = symmetry
        self._deviations: list[Tensor] = []
        # Two channels of a gray exemplar are empty, and any value is infinitely far from them.
        # Rounding errors must not be learned either (docs/experiments/wavelets.md).
        self._filled = filled_channels(exemplar)
        exemplar = exemplar[self._filled]
        self._measure_deviations(exemplar[None])
        copies = [self._moments(c[None]) for c in orientations(exemplar, symmetry)]
        self._target = _mean(copies)
        self._scale = [(m, (g.diagonal() - m * m).clamp_min(0).sqrt() + SD_FLOOR)
                       for g, m in self._target]  # fmt: skip
        self._units = self._measure_units(exemplar, size)
        self._averages: dict[str, Average] = {}
        self._biases: dict[str, CommonBias] = {}

    def __call__(self, slices: Tensor, view: str = "") -> Tensor:
        """Distance of `slices` [batch, channel, rows, columns], averaged with earlier slices of the
        view.

        The view is the slices' normal, or "" for random planes.
        """
        with torch.autocast(slices.device.type, enabled=False):
            average = self._averages.setdefault(view, Average())
            found = self._moments(slices.float()[:, self._filled])
            mixed = average.mixed_with(found, deepens=bool(view))
            average.remember(mixed)
            distances = [
                (d / unit + 1e-6).sqrt()
                for octave, statistics in enumerate(mixed)
                for d, unit in zip(self._distance(octave, statistics), self._units[octave],
                                   strict=True)
            ]  # fmt: skip
            total = torch.stack(distances).mean()
            if view and self._symmetry != "none":
                total = total + self._common_bias(found, view, self._symmetry)
            return total

    def orientation_bias(self, slices: Tensor, view: str) -> Tensor:
        """Bias that `slices` share with earlier slices of a view without a photograph. The view
        looks the same flipped and turned.
        """
        with torch.autocast(slices.device.type, enabled=False):
            found = self._moments(slices.float()[:, self._filled])
            return self._common_bias(found, view, "all")

    def _common_bias(self, found: Statistics, view: str, symmetry: str) -> Tensor:
        common = self._biases.setdefault(view, CommonBias())
        return common.loss(orientation_bias(self._energies(found), symmetry))

    def forget(self) -> None:
        """Discard the running averages."""
        self._averages = {}
        self._biases = {}

    def state(self) -> dict[str, Any]:
        averages = {
            view: {"average": [[g.cpu(), m.cpu()] for g, m in a.statistics], "seen": a.seen}
            for view, a in self._averages.items()
        }
        return {"averages": averages, "biases": {v: b.state() for v, b in self._biases.items()}}

    def restore(self, state: dict[str, Any]) -> None:
        device = self._filters.device
        self.forget()
        for view, saved in state["averages"].items():
            statistics = [(g.to(device), m.to(device)) for g, m in saved["average"]]
            self._averages[view] = Average(statistics, saved["seen"])
        for view, saved in state["biases"].items():
            self._biases[view] = CommonBias()
            self._biases[view].restore(saved, device)

    def _responses(self, image: Tensor) -> list[Tensor]:
        """Per octave, responses [batch, channel * filter, rows, columns]."""
        channels = image.shape[1]
        bank = self._filters.repeat(channels, 1, 1)[:, None]
        responses: list[Tensor] = []
        while min(image.shape[2:]) >= SMALLEST:
            weight = bank
            if len(self._deviations) > len(responses):
                weight = bank / self._deviations[len(responses)].view(-1, 1, 1, 1)
            responses.append(F.conv2d(image, weight, groups=channels))
            image = _halved(image)
        return responses

    def _measure_deviations(self, image: Tensor) -> None:
        self._deviations = [
            u.square().mean((0, 2, 3)).sqrt() + UNIT_FLOOR for u in self._responses(image)
        ]

    def _moments(self, image: Tensor) -> Statistics:
        """Second moments and means of each octave's maps and of the pooled finer ones."""
        statistics = []
        maps: list[Tensor] = []
        for response in self._responses(image):
            maps = [F.avg_pool2d(m, 2) for m in maps]
            maps.append(torch.cat([F.relu(response), F.relu(-response)], dim=1))
            if len(maps) == 1:
                maps[0] = torch.cat([maps[0], _center(image, *response.shape[2:])], dim=1)
            rows, columns = (min(m.shape[axis] for m in maps) for axis in (2, 3))
            joint = torch.cat([_center(m, rows, columns) for m in maps], dim=1)
            flat = joint.transpose(0, 1).flatten(1)
            statistics.append((second_moments(flat), flat.mean(1)))
        return statistics

    def _distance(self, octave: int, found: tuple[Tensor, Tensor]) -> tuple[Tensor, Tensor]:
        """Mean squared differences of covariances and of means, in units of the exemplar's
        deviations.
        """
        (second, mean), (target, center) = found, self._target[octave]
        deviation = self._scale[octave][1]
        shift = torch.outer(mean - center, center)
        covariance = second - target - shift - shift.T
        means = (mean - center) / deviation
        return (
            covariance / torch.outer(deviation, deviation)
        ).square().mean(), means.square().mean()

    def _energies(self, found: Statistics) -> Tensor:
        """Energy of the responses by orientation [octave, orientation]."""
        energies = []
        for octave, (second, _) in enumerate(found):
            count = len(self._deviations[octave])
            diagonal = second.diagonal()
            own = diagonal[: 2 * count] if octave == 0 else diagonal[-2 * count :]
            both = own.view(2, count).sum(0) * self._deviations[octave].square()
            waves = both.view(-1, len(self._filters))[:, : 2 * ORIENTATIONS]
            energies.append(waves.reshape(-1, ORIENTATIONS, 2).sum((0, 2)))
        return torch.stack(energies)

    def _measure_units(self, exemplar: Tensor, size: int) -> list[tuple[Tensor, Tensor]]:
        """Mean distance between slice-sized parts of the exemplar, per octave."""
        side = min(size, int(PART_SIDE * min(exemplar.shape[1:])))
        across = math.ceil(PARTS**0.5)
        places = squares(exemplar, max(side, SMALLEST), across, across)[:PARTS]
        parts = [self._moments(p[None]) for p in places]
        units = []
        for octave in range(len(parts[0])):
            pairs = [self._distance(octave, part[octave]) for part in parts]
            g, m = (torch.stack(d).mean() for d in zip(*pairs, strict=True))
            units.append((g * (side / size) ** 2 + UNIT_FLOOR, m * (side / size) ** 2 + UNIT_FLOOR))
        while len(units) < len(self._target):  # octaves that a part is too small for
            units.append((4 * units[-1][0], 4 * units[-1][1]))
        return units


def filter_bank() -> Tensor:
    """Unit filters [2 * ORIENTATIONS + 1, SIDE, SIDE]: even and odd waves, and an isotropic one."""
    at = torch.arange(SIDE, dtype=torch.float32) - SIDE // 2
    y, x = torch.meshgrid(at, at, indexing="ij")
    filters = []
    for step in range(ORIENTATIONS):
        angle = math.pi * step / ORIENTATIONS
        u, v = x * math.cos(angle) + y * math.sin(angle), y * math.cos(angle) - x * math.sin(angle)
        envelope = torch.exp(-(u * u + (FLATNESS * v) ** 2) / (2 * SPREAD * SPREAD))
        for phase in (0.0, math.pi / 2):
            wave = envelope * torch.cos(2 * math.pi * u / WAVELENGTH + phase)
            filters.append(wave - envelope * (wave.sum() / envelope.sum()))
    inner, outer = (torch.exp(-(x * x + y * y) / (2 * s * s)) for s in (0.9, 1.8))
    filters.append(inner / inner.sum() - outer / outer.sum())
    return torch.stack([f / f.norm() for f in filters])


def orientations(image: Tensor, symmetry: str) -> list[Tensor]:
    """The image in all orientations of `symmetry`: eight, four or itself."""
    copies = [image]
    if symmetry != "none":
        copies = [image, image.flip(1), image.flip(2), image.flip((1, 2))]
    return copies + [c.transpose(1, 2) for c in copies] if symmetry == "all" else copies


def squares(image: Tensor, side: int, down: int, across: int) -> list[Tensor]:
    """`down` x `across` squares of that side, evenly spaced; smaller where the image is smaller."""
    places = [
        [round(max(extent - side, 0) * i / max(count - 1, 1)) for i in range(count)]
        for extent, count in zip(image.shape[1:], (down, across), strict=True)
    ]
    return [image[:, r : r + side, c : c + side] for r in places[0] for c in places[1]]


def _halved(image: Tensor) -> Tensor:
    """Image after a binomial filter, reduced to every second pixel."""
    row = torch.tensor([1.0, 3.0, 3.0, 1.0], device=image.device) / 8
    kernel = torch.outer(row, row).expand(image.shape[1], 1, 4, 4)
    return F.conv2d(image, kernel, stride=2, groups=image.shape[1])


def _center(image: Tensor, rows: int, columns: int) -> Tensor:
    top, left = (image.shape[2] - rows) // 2, (image.shape[3] - columns) // 2
    return image[:, :, top : top + rows, left : left + columns]


def _mean(statistics: Sequence[Statistics]) -> Statistics:
    return [
        (torch.stack([s[i][0] for s in statistics]).mean(0),
         torch.stack([s[i][1] for s in statistics]).mean(0))
        for i in range(len(statistics[0]))
    ]  # fmt: skip
