"""What a training is: everything that decides its result, saved as `config.json`."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

from solidtex_export.images.channels import groups
from solidtex_export.images.exemplar import Exemplar
from solidtex_export.training.preset import AnyCritic, Early, Loss, Method, Start


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
    """Constructor arguments of the generator, and its kind."""
    method_name: str
    method: Method
    vgg: dict[str, str] | None = None
    """File name and SHA-256 of the weights of VGG-19, where they are used."""
    descriptor: dict[str, str] | None = None
    """The same of the learned descriptor."""
    line_length: float = 0.0
    """Of the photographs' thin lines, in their widths (analysis/lines.py)."""

    @property
    def early(self) -> Early:
        return self.method.early if self.line_length >= self.method.early.line_length else Early()

    @property
    def start(self) -> Start:
        start = self.method.start
        lines = self.symmetry == "all" and self.line_length >= start.line_length
        return start if lines or start.line_length == 0 else Start()

    @property
    def losses(self) -> tuple[Loss, ...]:
        """The method's, but those for other lengths of lines, or for no maps."""
        maps = len(groups(self.channels)) > 1
        terms = (t for t in self.method.losses if t.with_maps or not maps)
        return tuple(t for t in terms if t.line_length <= self.line_length < t.line_length_below)

    @property
    def critics(self) -> dict[str, AnyCritic]:
        """Those that judge for its losses, by the names of their tables."""
        return self.method.critics(self.losses)

    def critics_on(self, progress: float) -> list[str]:
        """Those that judge when so much of the training is done."""
        return list(self.method.critics(t for t in self.losses if t.judges(progress)))

    def document(self) -> dict[str, Any]:
        return asdict(self)

    def exemplar_index(self, direction: str) -> int:
        """Which exemplar a direction is compared with."""
        return 0 if len(self.exemplars) == 1 else self.directions.index(direction)


def exemplar_records(exemplars: list[Exemplar]) -> list[dict[str, Any]]:
    """File names and hashes of the photographs, and of their maps where they have any."""
    return [e.record() for e in exemplars]
