"""What a training is: everything that decides its result, saved as `config.json`."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from typing import Any

from solidtex_export.training.exemplar import Exemplar


@dataclass(frozen=True)
class Recipe:
    """Optimisation settings; the two families differ in these, in generator and in slicing."""

    learning_rate: float
    final_rate: float  # fraction of learning_rate at the end of the cosine
    batch: int
    critic_start: float  # fraction of the training after which the critic joins
    descriptor_weight: float = 1.0  # weights of unit gradients, once both are on
    style_weight: float = 0.5
    adversarial_weight: float = 0.2
    critic_rate: float = 1e-3
    warmup_steps: int = 20


RECIPES = {
    "field": Recipe(0.006, 0.03, batch=1, critic_start=0.4),
    "sampler": Recipe(4e-3, 0.03, batch=1, critic_start=0.3),
}


@dataclass(frozen=True)
class Config:
    """A training; `minutes` or `steps` decides when it ends."""

    family: str
    size: int
    resolution: int
    crop: tuple[int, ...] | None
    directions: str
    symmetry: str
    seed: int
    minutes: float | None
    steps: int | None
    exemplars: list[dict[str, Any]]
    channels: tuple[str, ...]
    color_space: str
    license: str
    source: str
    generator: dict[str, Any]
    recipe: Recipe = field(default_factory=lambda: RECIPES["field"])

    def document(self) -> dict[str, Any]:
        return asdict(self)

    def exemplar_index(self, direction: str) -> int:
        """Which exemplar a direction is compared with."""
        return 0 if len(self.exemplars) == 1 else self.directions.index(direction)


def exemplar_records(exemplars: list[Exemplar]) -> list[dict[str, Any]]:
    """File names and hashes of the photographs, and of their maps where they have any."""
    return [
        {"file": e.name, "sha256": e.sha256, **({"maps": e.maps} if e.maps else {})}
        for e in exemplars
    ]
