"""A recipe: everything in a training that does not depend on the photographs.

Presets are recipes in TOML files (training/presets.py). Every field below is a key of such a file,
with its default where a file may leave it out.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Annotated, Any, Literal

from pydantic import Field, field_validator, model_validator

from solidtex_export.discriminators.settings import (
    AnyDiscriminator,
    Beta,
    CriticSettings,
    ProjectedCriticSettings,
)
from solidtex_export.settings import Array, Pair, Settings, expected, within, wrong

Share = Annotated[float, within(0, 1)]
Rate = Annotated[float, within(1e-9, 10)]
Steps = Annotated[int, within(0, 1_000_000)]

FEATURE_LOSSES = ("gram", "autocorrelation", "diversity", "smoothness")
DESCRIPTOR_LOSSES = ("descriptor", *FEATURE_LOSSES)
DISCRIMINATOR_OF = {"style": "critic", "adversarial": "critic", "projected": "projected_critic"}
"""The table whose discriminators judge for a loss."""
LossKind = Literal[
    "descriptor",
    "gram",
    "autocorrelation",
    "diversity",
    "smoothness",
    "wavelets",
    "color_distribution",
    "style",
    "adversarial",
    "patches",
    "projected",
    "spectrum",
]
KINDS: tuple[str, ...] = LossKind.__args__  # type: ignore[attr-defined]


class GeneratorSettings(Settings):
    """The network: its kind and its constructor's arguments."""

    kind: Literal["lattice", "pyramid", "sampler"]
    sizes: dict[str, Any] = Field(default_factory=dict)
    statistics: Literal["measured", "trained"] = "measured"
    """Batch normalization: measured once, then fixed; or by each slice, measured at the end."""


class Init(Settings):
    """Initial weights of a lattice generator; the defaults leave the paper's."""

    smoothing: Share = 0.0
    """Share, in their variance, of weights that smooth what comes from a coarser level."""
    fine_noise: Annotated[float, within(1e-3, 1)] = 1.0
    """Gain of the noise of finer levels, relative to the coarsest's."""


class Grain(Settings):
    """Initial octaves of a sampler for one photograph with grain along z."""

    short_octaves: Annotated[int, within(0, 255)] = 0
    """Octaves that are not as long as the grain, and silent at first."""
    elongation: Annotated[float, within(1, 1000)] | None = None
    """How much the other octaves are stretched along z; left out, it follows the photograph's
    grain where `slicing.planes` is auto and one photograph serves x and y."""


class Slicing(Settings):
    """Which slices of the solid are compared with a photograph."""

    planes: Literal["auto", "axes", "any", "about-z"] = "axes"
    """auto: of one photograph any plane, with directions xy about z, else along the axes."""
    batch: Annotated[int, within(1, 256)] = 1
    """Slices in one pass through the generator."""
    passes: Annotated[int, within(1, 256)] = 1
    """Passes per direction whose gradients are added before a step."""
    every_direction: bool = False
    """All directions in each step, instead of one after another."""
    oblique_share: Share = 0.0
    """Fraction of steps that take an oblique slice of the lattice family."""
    oblique_size: Annotated[float, within(0.1, 1)] = 0.6
    """Side of an oblique slice, as a fraction of the others'."""
    free_share: Annotated[float, within(0, 0.5)] = 0.0
    """Fraction of steps of the lattice family that judge the orientation bias of slices normal to
    z, where one photograph serves x and y; needs a loss of wavelets."""
    symmetry: Literal["auto", "all", "flips", "none"] = "auto"
    """Orientations in which slices and photographs are shown to the losses."""


class Loss(Settings):
    """A term of the generator's loss; its kind is the name of its table where it says none."""

    kind: LossKind
    weight: Annotated[float, within(-1e12, 1e12)] = 1.0
    start: Share = 0.0
    """Fraction of the training after which it joins."""
    end: Share = 1.0
    """Fraction of the training after which it leaves."""
    descriptor: Literal["vgg", "learned", "random"] = "random"
    layers: Array[str] = ()
    """Of the descriptor, for the losses that compare features."""
    groups: Array[Array[int]] = ()
    """Widths of the random descriptor's convolutions."""
    sigma: Annotated[float, within(1e-9, 1e9)] = 1e-3
    """Of the smoothness loss."""
    relative: bool = False
    """Style: distances of Gram matrices relative to the photograph's."""

    @model_validator(mode="after")
    def _check(self) -> Loss:
        if self.end < self.start:
            raise wrong("end", self.end, f"at least its start, {self.start:g}")
        if self.kind in FEATURE_LOSSES and not self.layers:
            raise wrong("layers", [], "layer names")
        return self

    def active(self, progress: float) -> bool:
        """Whether it counts when so much of the training is done."""
        return self.start <= progress <= self.end


class Optimizer(Settings):
    """Adam for the generator."""

    learning_rate: Rate
    final_rate: Share = 1.0
    """Fraction of the learning rate at the end of half a cosine; 1 keeps it."""
    warmup_steps: Steps = 0
    betas: Pair[Beta] = (0.9, 0.999)
    beta_with_critic: Beta | None = None
    """Replaces the first beta once a discriminator's loss has joined."""
    per_layer_scaling: bool = False
    """Scale the learning rate of each convolution by the size that its weights start with, or have
    when the initial phase ends."""


class InitialPhase(Settings):
    """The first part of a training: large steps, each slice normalized by its own statistics."""

    steps: Steps = 0
    """That it takes, at most half of the training; 0 for none."""
    learning_rate: Rate = 0.03
    """At its beginning; it falls to the optimizer's by half a cosine."""

    def progress(self, step: int, training: float) -> float:
        """Fraction of it that is done, 1 or more after it; `training`: of the whole training."""
        return max(step / self.steps, 2 * training) if self.steps else 1.0


class Recipe(Settings):
    """A whole recipe."""

    generator: GeneratorSettings
    optimizer: Optimizer
    losses: dict[str, Loss]
    init: Init = Init()
    grain: Grain = Grain()
    slicing: Slicing = Slicing()
    initial_phase: InitialPhase = InitialPhase()
    critic: CriticSettings = CriticSettings()
    projected_critic: ProjectedCriticSettings = ProjectedCriticSettings()
    mixing: Literal["sum", "unit-gradients"] = "sum"
    """Adds weighted losses, or weighted gradients of unit length with respect to the slice."""
    match_histograms: bool = False
    """Gives several photographs one common histogram per channel."""

    @field_validator("losses", mode="before")
    @classmethod
    def _named(cls, tables: Any) -> Any:
        """A loss whose `enabled` is false is left out; the others are computed in order of kind."""
        if not isinstance(tables, dict) or not all(isinstance(t, dict) for t in tables.values()):
            raise expected("named tables, such as [losses.gram]")
        on = {n: {"kind": n, **t} for n, t in tables.items() if t.get("enabled", True) is not False}
        for table in on.values():
            if table.get("enabled") is True:
                del table["enabled"]
        place = {kind: i for i, kind in enumerate(KINDS)}
        return dict(sorted(on.items(), key=lambda item: place.get(str(item[1]["kind"]), 0)))

    @field_validator("losses")
    @classmethod
    def _one_always_counts(cls, losses: dict[str, Loss]) -> dict[str, Loss]:
        if not any((t.start, t.end) == (0, 1) for t in losses.values()):
            raise expected("at least one with start = 0 and end = 1")
        return losses

    @model_validator(mode="after")
    def _fits_its_generator(self) -> Recipe:
        kind = self.generator.kind
        if self.initial_phase.steps and self.generator.statistics == "trained":
            needed = "0 where generator.statistics are trained all along"
            raise wrong("initial_phase.steps", self.initial_phase.steps, needed)
        for name, value in self.init if kind != "lattice" else ():
            if value != (default := Init.model_fields[name].default):
                raise wrong(f"init.{name}", value, f"{default:g} for generator.kind {kind}")
        if self.family == "field":
            self._check_lattice()
        elif self.slicing.oblique_share:
            needed = "0 for this generator (planes: auto, axes, any, about-z)"
            raise wrong("slicing.oblique_share", self.slicing.oblique_share, needed)
        return self

    def _check_lattice(self) -> None:
        if self.grain != Grain():
            raise wrong("grain", self.grain.model_dump(), "none for this generator")
        if self.slicing.planes != "axes":
            needed = "axes for this generator (oblique_share adds oblique slices)"
            raise wrong("slicing.planes", self.slicing.planes, needed)
        if self.slicing.free_share and not self.of_kind("wavelets"):
            needed = "0 without a loss of wavelets"
            raise wrong("slicing.free_share", self.slicing.free_share, needed)

    @property
    def family(self) -> Literal["field", "sampler"]:
        return "sampler" if self.generator.kind == "sampler" else "field"

    def of_kind(self, kind: str) -> list[Loss]:
        return [term for term in self.losses.values() if term.kind == kind]

    @property
    def discriminators(self) -> dict[str, AnyDiscriminator]:
        """Those that judge for its losses, by the names of their tables."""
        names = self._discriminators_of(self.losses.values())
        return {name: getattr(self, name) for name in names}

    def discriminators_at(self, progress: float) -> list[str]:
        """Those that judge when so much of the training is done."""
        return self._discriminators_of(t for t in self.losses.values() if t.active(progress))

    @staticmethod
    def _discriminators_of(terms: Iterable[Loss]) -> list[str]:
        kinds = (t.kind for t in terms if t.kind in DISCRIMINATOR_OF)
        return list(dict.fromkeys(DISCRIMINATOR_OF[kind] for kind in kinds))

    def uses(self, descriptor: str) -> bool:
        if descriptor == "learned" and "projected_critic" in self.discriminators:
            return True
        terms = (t for t in self.losses.values() if t.kind in DESCRIPTOR_LOSSES)
        return any(t.descriptor == descriptor for t in terms)

    @property
    def smallest_judged(self) -> int:
        """Side of the smallest slice that its discriminators can judge, in texels; 1 without."""
        return max((d.smallest for d in self.discriminators.values()), default=1)

    @property
    def only_vgg(self) -> bool:
        """Whether VGG-19, which sees three channels, is all that judges from the start."""
        first = [t for t in self.losses.values() if t.start == 0]
        return all(t.descriptor == "vgg" and t.kind not in DISCRIMINATOR_OF for t in first)
