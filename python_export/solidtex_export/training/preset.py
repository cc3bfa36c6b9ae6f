"""A method: everything that turns photographs into a trained generator, read from a TOML file.

The shipped ones are `solidtex_export/presets/*.toml`; each names its paper and where it differs.
Every field below is a key of such a file, with its default where a file may leave it out.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

from solidtex_export.discriminators.settings import AnyCritic, Critic, ProjectedCritic
from solidtex_export.settings import choice, number

PLANES = ("auto", "axes", "any", "about-z")
GENERATORS = ("lattice", "pyramid", "sampler")
DESCRIPTORS = ("vgg", "learned", "random")
FEATURE_LOSSES = ("gram", "autocorrelation", "diversity", "smoothness")
CRITIC_OF = {"style": "critic", "adversarial": "critic", "projected": "projected_critic"}
"""The table whose critics judge for a loss."""
DESCRIPTOR_LOSSES = ("descriptor", *FEATURE_LOSSES)
LOSSES = ("wavelets", "spectrum", "tones", "patches", *DESCRIPTOR_LOSSES, *CRITIC_OF)
EVERY_LINE = 1e6  # widths: no line is so long
RULES = ("sum", "unit-gradients")
STATISTICS = ("measured", "trained")


@dataclass(frozen=True)
class Generator:
    """The network: its kind and its constructor's arguments."""

    kind: str = choice(*GENERATORS)
    sizes: dict[str, Any] = field(default_factory=dict)
    statistics: str = choice(*STATISTICS, default="measured")
    """Batch normalisation: measured once, then fixed; or by each slice, measured at the end."""


@dataclass(frozen=True)
class Start:
    """Initial weights of a lattice generator (generators/lattice_start.py); the defaults leave the
    paper's."""

    smoothing: float = number(0, 1, 0.0)
    """Share, in their variance, of weights that smooth what comes from a coarser level."""
    fine_noise: float = number(1e-3, 1, 1.0)
    """Size of what the noise of finer levels gives, relative to the coarsest's."""
    line_length: float = number(0, EVERY_LINE, 0.0)
    """Only for lines of so many widths in all directions, else as the paper's; 0: always."""


@dataclass(frozen=True)
class Grain:
    """How a sampler for one photograph with grain along z starts (generators/sampler_start.py)."""

    short_octaves: int = number(0, 255, 0)
    """Octaves that are not as long as the grain, and silent at first."""


@dataclass(frozen=True)
class Slicing:
    """Which slices of the solid are compared with a photograph."""

    planes: str = choice(*PLANES, default="axes")
    batch: int = number(1, 256, 1)
    """Slices in one pass through the generator."""
    passes: int = number(1, 256, 1)
    """Passes per direction whose gradients are added before a step."""
    every_direction: bool = False
    """All directions in each step, instead of one after another."""
    oblique_share: float = number(0, 1, 0.0)
    """Fraction of steps that take an oblique slice of the lattice family."""
    oblique_size: float = number(0.1, 1, 0.6)
    """Side of an oblique slice, as a fraction of the others'."""
    free_share: float = number(0, 0.5, 0.0)
    """Fraction of steps of the lattice family that judge slants of slices normal to z, where one
    photograph serves x and y (directions xy); needs the loss of wavelets."""
    symmetry: str = choice("auto", "all", "flips", "none", default="auto")
    """Orientations in which slices and photographs are shown to the losses."""


@dataclass(frozen=True)
class Loss:
    """A term of the generator's loss."""

    kind: str = choice(*LOSSES)
    weight: float = number(-1e12, 1e12, 1.0)
    start: float = number(0, 1, 0.0)
    """Fraction of the training after which it joins."""
    end: float = number(0, 1, 1.0)
    """Fraction of the training after which it leaves."""
    line_length: float = number(0, EVERY_LINE, 0.0)
    """Only where a photograph has thin lines of so many widths (analysis/lines.py); 0: always."""
    line_length_below: float = number(0, EVERY_LINE, EVERY_LINE)
    """Only where its lines are shorter than so many."""
    with_maps: bool = True
    """Also where a photograph has maps beside its colour."""
    descriptor: str = choice(*DESCRIPTORS, default="random")
    layers: tuple[str, ...] = ()
    """Of the descriptor, for the losses that compare features."""
    groups: tuple[tuple[int, ...], ...] = ()
    """Widths of the random descriptor's convolutions."""
    sigma: float = number(1e-9, 1e9, 1e-3)
    """Of the smoothness loss."""
    relative: bool = False
    """Style: distances of Gram matrices relative to the photograph's."""

    @property
    def of_any_lines(self) -> bool:
        return self.line_length == 0 and self.line_length_below == EVERY_LINE

    def judges(self, progress: float) -> bool:
        """Whether it counts when so much of the training is done."""
        return self.start <= progress <= self.end


@dataclass(frozen=True)
class Optimiser:
    """Adam for the generator."""

    learning_rate: float = number(1e-9, 10)
    final_rate: float = number(0, 1, 1.0)
    """Fraction of the learning rate at the end of half a cosine; 1 keeps it."""
    warmup_steps: int = number(0, 1_000_000, 0)
    betas: tuple[float, float] = number(0, 0.99999, (0.9, 0.999))
    beta_with_critic: float | None = number(0, 0.99999, None)
    """Replaces the first beta once a critic's loss has joined."""
    equalised: bool = False
    """Step each convolution in proportion to the size that its weights start with, or have when
    the early part ends."""


@dataclass(frozen=True)
class Early:
    """The first part of a training: large steps, each slice normalised by its own statistics."""

    steps: int = number(0, 1_000_000, 0)
    """That it takes, at most half of the training; 0 for none."""
    learning_rate: float = number(1e-9, 10, 0.03)
    """At its beginning; it falls to the optimiser's by half a cosine."""
    line_length: float = number(0, EVERY_LINE, 0.0)
    """Only where a photograph has thin lines of so many widths (analysis/lines.py); 0: always."""

    def progress(self, step: int, training: float) -> float:
        """Fraction of it that is done, 1 or more after it; `training`: of the whole training."""
        return max(step / self.steps, 2 * training) if self.steps else 1.0


@dataclass(frozen=True)
class Method:
    """A whole method."""

    generator: Generator
    optimiser: Optimiser
    losses: tuple[Loss, ...]
    start: Start = field(default_factory=Start)
    grain: Grain = field(default_factory=Grain)
    slicing: Slicing = field(default_factory=Slicing)
    early: Early = field(default_factory=Early)
    critic: Critic = field(default_factory=Critic)
    projected_critic: ProjectedCritic = field(default_factory=ProjectedCritic)
    mixing: str = choice(*RULES, default="sum")
    """Adds weighted losses, or weighted gradients of unit length with respect to the slice."""
    match_histograms: bool = False
    """Gives several photographs one common histogram per channel."""

    @property
    def family(self) -> str:
        return "sampler" if self.generator.kind == "sampler" else "field"

    def critics(self, terms: Iterable[Loss]) -> dict[str, AnyCritic]:
        """Those that judge for some of these losses, by the names of their tables."""
        names = dict.fromkeys(CRITIC_OF[t.kind] for t in terms if t.kind in CRITIC_OF)
        return {name: getattr(self, name) for name in names}

    def uses(self, descriptor: str) -> bool:
        if descriptor == "learned" and "projected_critic" in self.critics(self.losses):
            return True
        return any(t.descriptor == descriptor and t.kind in DESCRIPTOR_LOSSES for t in self.losses)

    @property
    def smallest_judged(self) -> int:
        """Side of the smallest slice that its critics can judge, in texels; 1 without critics."""
        return max((c.smallest for c in self.critics(self.losses).values()), default=1)

    @property
    def only_vgg(self) -> bool:
        """Whether VGG-19, which sees three channels, is all that judges from the start."""
        first = [term for term in self.losses if term.start == 0]
        return all(t.descriptor == "vgg" and t.kind not in CRITIC_OF for t in first)

    def document(self) -> dict[str, Any]:
        return dataclasses.asdict(self)
