"""What solidtex-train starts from: a texture space, or a start learned with Reptile."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import torch
from torch import Tensor

from solidtex_export.analysis.grain import whiten
from solidtex_export.images.channels import COLOR
from solidtex_export.images.exemplar import Exemplar
from solidtex_export.images.file_kinds import ExemplarError
from solidtex_export.spaces.colors import color_axes
from solidtex_export.spaces.decode import decode, generator_arguments
from solidtex_export.spaces.opening import open_space, open_start
from solidtex_export.spaces.photographs import NETWORK_MEAN, NETWORK_SCALE, patches
from solidtex_export.spaces.space_reader import OpenSpace
from solidtex_export.spaces.start_file import LearnedStart
from solidtex_export.training.start import SpaceRecord, Start

PATCHES = 6  # of the photograph, whose codes are averaged, as in training


@dataclass(frozen=True)
class SpaceStart:
    """Start from the code of the photograph in a texture space."""

    space: OpenSpace
    reason: str = ""

    @property
    def label(self) -> str:
        return f"--space {self.space.path}"

    @property
    def preset(self) -> str:
        return f"space-{self.space.document.family}"

    @property
    def generator(self) -> Mapping[str, Any]:
        return generator_arguments(self.space)

    @property
    def directions(self) -> str:
        return self.space.document.directions

    @property
    def resolution(self) -> int:
        return self.space.document.resolution

    @property
    def smallest(self) -> int:
        return self.space.document.patch

    @property
    def critic(self) -> Mapping[str, Tensor] | None:
        return self.space.critic

    def start(self, exemplar: Exemplar, for_critic: bool) -> Start:
        check_photograph(exemplar, self.label, self.smallest)
        mean, basis = color_axes(exemplar.image)
        code = self.encode(exemplar, mean, basis)
        colors: tuple[tuple[float, ...], ...] = ()
        if self.space.document.colors == "photograph":
            colors = tuple(map(tuple, torch.cat([basis, mean[:, None]], dim=1).tolist()))
        elif for_critic:
            mean, basis = torch.full((3,), NETWORK_MEAN), NETWORK_SCALE * torch.eye(3)
        record = SpaceRecord(
            name=self.space.document.name,
            sha256=self.space.sha256,
            code=tuple(code.tolist()),
            colors=colors,
        )
        state = decode(self.space, code.double().numpy(), mean, basis)
        return Start(state, (mean, basis), record, self.critic)

    def encode(self, exemplar: Exemplar, mean: Tensor, basis: Tensor) -> Tensor:
        """Mean code of patches that cover the photograph."""
        image = exemplar.image
        if self.space.document.colors == "photograph":
            image = whiten(image, mean, basis)
        elif self.space.path.is_dir():  # the torch encoder sees the network's values
            image = (image - NETWORK_MEAN) / NETWORK_SCALE
        return self.space.encode(patches(image, self.smallest, PATCHES)).mean(0)


@dataclass(frozen=True)
class ReptileStart:
    """Start from weights that were learned for being adapted."""

    learned: LearnedStart
    reason = ""

    @property
    def label(self) -> str:
        return f"--start {self.learned.path}"

    @property
    def preset(self) -> str:
        return f"start-{self.learned.document.generator['kind']}"

    @property
    def generator(self) -> Mapping[str, Any]:
        return self.learned.document.generator

    @property
    def directions(self) -> str:
        return self.learned.document.directions

    @property
    def resolution(self) -> int:
        return self.learned.document.resolution

    smallest = 1
    critic = None

    def start(self, exemplar: Exemplar, for_critic: bool) -> Start:
        check_photograph(exemplar, self.label, self.smallest)
        mean, basis = color_axes(exemplar.image)
        state = dict(self.learned.state) | {"color_mean": mean, "color_basis": basis}
        record = SpaceRecord(name=self.learned.document.name, sha256=self.learned.sha256)
        return Start(state, (mean, basis), record)


def check_photograph(exemplar: Exemplar, label: str, smallest: int) -> None:
    if exemplar.channels != COLOR or exemplar.color_space != "srgb":
        names = ", ".join(exemplar.channels)
        raise ExemplarError(
            f"{exemplar.name}: found the channels {names} ({exemplar.color_space}), expected"
            f" {', '.join(COLOR)} (srgb): {label} has colors only"
        )
    rows, columns = exemplar.image.shape[1:]
    if min(rows, columns) < smallest:
        raise ExemplarError(
            f"{exemplar.name}: found {columns} x {rows} pixels, expected at least"
            f" {smallest} x {smallest}, a patch of {label}: use a larger photograph, or"
            " solidtex-train without --space"
        )


def space_start(path: Path) -> SpaceStart:
    return SpaceStart(open_space(path))


def learned_start(path: Path) -> ReptileStart:
    return ReptileStart(open_start(path))
