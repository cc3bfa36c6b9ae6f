"""Start of a training: weights that were learned from other photographs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol

from torch import Tensor, nn

from solidtex_export.generators.sampler import OctaveSampler
from solidtex_export.images.exemplar import Exemplar
from solidtex_export.settings import Array, Settings
from solidtex_export.training.recipe import FineTuning


class SpaceRecord(Settings):
    """Space that a training started from."""

    name: str
    sha256: str
    code: Array[float] = ()
    """Code z of the photograph; a learned start has none."""
    colors: Array[Array[float]] = ()
    """Basis and mean of the photograph's colors, where they are not the network's."""


@dataclass(frozen=True)
class Start:
    """Weights for one photograph. Normalizations have fixed statistics."""

    state: Mapping[str, Tensor]
    """State of the generator."""
    axes: tuple[Tensor, Tensor]
    """Mean and basis of the colors (analysis/grain.py)."""
    record: SpaceRecord
    critic: Mapping[str, Tensor] | None = None
    """Weights of a critic that was trained together with the generator."""


class StartSource(Protocol):
    """What a training may start from."""

    @property
    def label(self) -> str:
        """Option and file, for messages."""

    @property
    def reason(self) -> str:
        """Why solidtex chose this start; empty if the user did."""

    @property
    def preset(self) -> str:
        """Default preset."""

    @property
    def generator(self) -> Mapping[str, Any]:
        """Kind and sizes of the generator, without its channels."""

    @property
    def directions(self) -> str: ...

    @property
    def resolution(self) -> int: ...

    @property
    def critic(self) -> Mapping[str, Tensor] | None:
        """Weights of the critic that the generator was trained with, if they are known."""

    def start(self, exemplar: Exemplar, for_critic: bool) -> Start:
        """Weights for this photograph; `for_critic`: with colors as the space's critic saw them."""


def freeze(generator: nn.Module, settings: FineTuning | None) -> None:
    """Fix the weights that are not trained."""
    if settings is None or settings.weights == "all":
        return
    for name, parameter in generator.named_parameters():
        parameter.requires_grad_(_is_condition(generator, name))


def _is_condition(generator: nn.Module, name: str) -> bool:
    """GramGAN, section 3.3: T_i, gamma_l, delta_l, A_l. In a lattice, scale and shift."""
    if isinstance(generator, OctaveSampler):
        return name in ("linear", "gamma", "delta") or name.endswith(".noise")
    return ".bn" in name
