"""Recipe: all settings of a training that do not depend on the photographs.

Presets are recipes in TOML files (training/presets.py). Every field below is a key of such a file.
A key with a default may be left out.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BeforeValidator, Field, field_validator, model_validator

from solidtex_export.discriminators.settings import (
    AnyDiscriminator,
    Beta,
    CriticSettings,
    ProjectedCriticSettings,
)
from solidtex_export.generators.settings import SIZES, Family, family_of
from solidtex_export.losses import own
from solidtex_export.losses.descriptors import known_feature_names
from solidtex_export.settings import Array, Pair, Settings, check_table, expected, within, wrong

Share = Annotated[float, within(0, 1)]

FEATURE_LOSSES = ("gram", "autocorrelation", "diversity", "smoothness")
DESCRIPTOR_LOSSES = ("descriptor", *FEATURE_LOSSES)
DISCRIMINATOR_OF = {"style": "critic", "adversarial": "critic", "projected": "projected_critic"}
"""Table of the discriminators that a loss uses."""
KINDS = (
    "descriptor",
    "gram",
    "autocorrelation",
    "diversity",
    "smoothness",
    "wavelets",
    "color_distribution",
    "style",
    "adversarial",
    "projected",
    "spectrum",
)


def discriminator_of(kind: str) -> str | None:
    """Name of the discriminators that a loss uses: their table, or "module:class"."""
    return kind if own.is_discriminator(kind) else DISCRIMINATOR_OF.get(kind)


def _present_descriptor(name: Any) -> Any:
    return "features" if name == "vgg" else name


def _known_kind(kind: str) -> str:
    if own.is_own(kind):
        own.load(kind)
    elif kind not in KINDS:
        raise expected(f"one of {', '.join(KINDS)}, or MODULE:FUNCTION")
    return kind


class GeneratorSettings(Settings):
    """Kind and constructor arguments of the generator."""

    kind: Literal["lattice", "pyramid", "sampler"]
    sizes: dict[str, Any] = Field(default_factory=dict)
    """Keys, defaults and ranges are those of the kind's table in generators/settings.py."""
    statistics: Literal["measured", "trained"] = "measured"
    """Statistics of batch normalization: measured once, then fixed; or of each slice, measured at
    the end.
    """

    @model_validator(mode="after")
    def _check(self) -> GeneratorSettings:
        check_table(SIZES[self.kind], self.sizes, "sizes")
        return self


class Grain(Settings):
    """Initial octaves of a sampler for one photograph with grain along z or layers normal to it."""

    short_octaves: Annotated[int, within(0, 255)] = 0
    """Number of octaves that are shorter than the grain and start with weight zero."""
    elongation: Annotated[float, within(1e-3, 1000)] | None = None
    """Stretch of the other octaves along z; below 1 their stretch along x and y, 1 / `elongation`.
    The default follows the photograph's grain where `slicing.planes` is auto and one photograph
    serves x and y.
    """


class Slicing(Settings):
    """Selection of the slices that are compared with a photograph."""

    size: Annotated[int, within(32, 4096)] | None = None
    """Side in texels where the user gives none; None: 128."""
    planes: Literal["auto", "axes", "any", "about-z"] = "axes"
    """auto: any plane for one photograph, planes about z for directions xy, otherwise axis slices.
    """
    batch: Annotated[int, within(1, 256)] = 1
    """Number of slices in one pass through the generator."""
    passes: Annotated[int, within(1, 256)] = 1
    """Number of passes per direction before a step; their gradients are added."""
    every_direction: bool = False
    """Use all directions in each step, rather than one after another."""
    oblique_share: Share = 0.0
    """Fraction of steps that use an oblique slice of the lattice family."""
    oblique_size: Annotated[float, within(0.1, 1)] = 0.6
    """Side of an oblique slice, as a fraction of an axis slice's."""
    free_share: Annotated[float, within(0, 0.5)] = 0.0
    """Fraction of steps of the lattice family that reduce the orientation bias of slices normal to
    z, where one photograph serves x and y; needs a loss of wavelets.
    """
    symmetry: Literal["auto", "all", "flips", "none"] = "auto"
    """Orientations in which the losses see slices and photographs."""


class Loss(Settings):
    """Term of the generator's loss; its kind defaults to the name of its table."""

    kind: Annotated[str, AfterValidator(_known_kind)]
    weight: Annotated[float, within(-1e12, 1e12)] = 1.0
    start: Share = 0.0
    """Fraction of the training after which the term starts."""
    end: Share = 1.0
    """Fraction of the training after which the term ends."""
    descriptor: Annotated[Literal["features", "learned"], BeforeValidator(_present_descriptor)] = (
        "learned"
    )
    """The network of --features (older name: vgg), or the built-in one."""
    layers: Array[str] = ()
    """Layers of the descriptor, for losses that compare features."""
    sigma: Annotated[float, within(1e-9, 1e9)] = 1e-3
    """Width of the smoothness kernel."""

    @model_validator(mode="after")
    def _check(self) -> Loss:
        if self.end < self.start:
            raise wrong("end", self.end, f"at least its start, {self.start:g}")
        if self.kind in FEATURE_LOSSES and not self.layers:
            raise wrong("layers", [], "layer names")
        if self.kind not in FEATURE_LOSSES and self.layers:
            needed = f"none: only the kinds {', '.join(FEATURE_LOSSES)} choose layers"
            raise wrong("layers", self.layers, needed)
        known = known_feature_names()
        if unknown := [name for name in self.layers if name not in known]:
            raise wrong("layers", unknown, f"some of {', '.join(known)}")
        return self

    def active(self, progress: float) -> bool:
        """Whether the term is active at this fraction of the training."""
        return self.start <= progress <= self.end


class Optimizer(Settings):
    """Adam for the generator."""

    learning_rate: Annotated[float, within(1e-9, 10)]
    final_rate: Share = 1.0
    """Final learning rate after half a cosine, as a fraction of the first; 1 keeps it constant."""
    warmup_steps: Annotated[int, within(0, 1_000_000)] = 0
    betas: Pair[Beta] = (0.9, 0.999)
    per_layer_scaling: bool = False
    """Scale the learning rate of each convolution by the size of its initial weights."""


class FineTuning(Settings):
    """Training that starts from a texture space."""

    weights: Literal["all", "conditions"] = "all"
    """conditions: only the transforms T_i, the scale and shift of every layer, and the weights A_l
    of noise (GramGAN, section 3.3).
    """
    critic: Literal["trained", "frozen"] = "trained"
    """frozen: the space's own critic, which is not trained."""


class Recipe(Settings):
    """A complete recipe."""

    generator: GeneratorSettings
    optimizer: Optimizer
    losses: dict[str, Loss]
    grain: Grain = Grain()
    slicing: Slicing = Slicing()
    critic: CriticSettings = CriticSettings()
    projected_critic: ProjectedCriticSettings = ProjectedCriticSettings()
    mixing: Literal["sum", "unit-gradients"] = "sum"
    """Sum of weighted losses, or of weighted gradients of unit length with respect to the slice."""
    fine_tuning: FineTuning | None = None
    match_histograms: bool = False
    """Give several photographs one common histogram per channel."""

    @field_validator("losses", mode="before")
    @classmethod
    def _named(cls, tables: Any) -> Any:
        """Drop losses whose `enabled` is false, and sort the others by kind."""
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
    def family(self) -> Family:
        return family_of(self.generator.kind)

    def of_kind(self, kind: str) -> list[Loss]:
        return [term for term in self.losses.values() if term.kind == kind]

    @property
    def discriminators(self) -> dict[str, AnyDiscriminator]:
        """Discriminators that the losses use, by the names of their tables."""
        names = self._discriminators_of(self.losses.values())
        return {name: self.critic if own.is_own(name) else getattr(self, name) for name in names}

    def discriminators_at(self, progress: float) -> list[str]:
        """Names of the discriminators in use at this fraction of the training."""
        return self._discriminators_of(t for t in self.losses.values() if t.active(progress))

    @staticmethod
    def _discriminators_of(terms: Iterable[Loss]) -> list[str]:
        names = (discriminator_of(t.kind) for t in terms)
        return list(dict.fromkeys(name for name in names if name is not None))

    @property
    def has_frozen_critic(self) -> bool:
        """Whether a loss uses the space's own critic, which is not trained."""
        frozen = self.fine_tuning is not None and self.fine_tuning.critic == "frozen"
        return frozen and "critic" in self.discriminators

    def uses(self, descriptor: str) -> bool:
        if descriptor == "learned" and "projected_critic" in self.discriminators:
            return True
        terms = (t for t in self.losses.values() if t.kind in DESCRIPTOR_LOSSES)
        return any(t.descriptor == descriptor for t in terms)

    @property
    def smallest_slice(self) -> int:
        """Side of the smallest slice that all discriminators accept, in texels; 1 without any."""
        return max((d.smallest for d in self.discriminators.values()), default=1)

    @property
    def only_features(self) -> bool:
        """Whether the network of --features, which sees three channels, is the only loss at the
        start.
        """
        first = [t for t in self.losses.values() if t.start == 0]
        return all(t.descriptor == "features" and discriminator_of(t.kind) is None for t in first)
