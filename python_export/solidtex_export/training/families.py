"""From a method to its generator, and the ways it is sliced."""

from __future__ import annotations

from typing import Any

from solidtex_export.analysis.grain import grain_ratio
from solidtex_export.generators.build import Generator, build_generator
from solidtex_export.generators.init import init_grain, quiet_fine_noise, smooth_coarse_features
from solidtex_export.generators.lattice import BaseLattice, LatticeGenerator
from solidtex_export.generators.oblique import ObliqueSlices
from solidtex_export.generators.sampler import OctaveSampler
from solidtex_export.generators.slices import LatticeSlices, SamplerSlices, SliceSource
from solidtex_export.images.exemplar import Exemplar
from solidtex_export.training.config import Config
from solidtex_export.training.preset import Method

# Long grain is easily cut shorter, short grain hardly ever grows together, so it starts longer than
# measured; the longest by more, since its ends are not on the photograph and a slight lean looks
# like one. 1500 steps, patterns along the axes and by eye: zebrano (measured 25) at 50 4.70,
# short fibres; at 100 4.74, long ones that taper off; at 200 4.83, ruled lines. Oak (8.5) at 17
# 5.89, the strokes of its pores; at 34 and 68 7.63 and 8.05, ever longer fibres. Layered wood (28,
# 1000 steps) at 55 and 111 1.84 and 1.96, long either way. All octaves alike: with every other one
# at the root of that the figures fall (zebrano 4.7 to 2.7, oak 5.9 to 2.0), and so with the finest
# two (3.8), but training then takes the short ones and wood becomes dashes. All of this was before
# there were short octaves that start silent (generators/sampler_start.py).
GRAIN_START = 2.0
GRAIN_POWER = 1.4
MAX_GRAIN = 128.0


def generator_sizes(method: Method, channels: int) -> dict[str, Any]:
    """The generator's constructor arguments, and its kind; checked by building it."""
    sizes = {"kind": method.generator.kind, **method.generator.sizes, "out_channels": channels}
    generator = build_generator(method.family, sizes)
    short = method.grain.short_octaves
    if isinstance(generator, OctaveSampler) and short >= generator.octaves:
        expected = f"fewer than all {generator.octaves} octaves"
        raise ValueError(f"grain.short_octaves: found {short}, expected {expected}")
    return sizes


def build(
    config: Config, exemplars: list[Exemplar]
) -> tuple[Generator, SliceSource, SliceSource | None]:
    """The generator, its slices, and its oblique slices where the method has some."""
    generator = build_generator(config.family, config.generator)
    if isinstance(generator, LatticeGenerator):
        smooth_coarse_features(generator, config.start.smoothing)
        quiet_fine_noise(generator, config.start.fine_noise)
    if isinstance(generator, BaseLattice):
        return generator, LatticeSlices(generator), _oblique(config, generator)
    planes = _planes(config)
    if planes == "about-z" and config.method.slicing.planes == "auto":
        grain = _grain_at_start(exemplars[0])
        init_grain(generator, grain, config.method.grain.short_octaves)
    return generator, SamplerSlices(generator, planes), None


def _oblique(config: Config, generator: BaseLattice) -> ObliqueSlices | None:
    """Where one photograph serves two directions, only planes that hold the grain look like it."""
    if config.method.slicing.oblique_share == 0 or len(config.exemplars) > 1:
        return None
    axes = {"xyz": "xyz", "xy": "z"}.get(config.directions)
    return ObliqueSlices(generator, axes) if axes else None


def _planes(config: Config) -> str:
    """What `auto` means: GramGAN, section 4, "implementation details"."""
    planes = config.method.slicing.planes
    if planes != "auto":
        return planes
    if len(config.exemplars) > 1:
        return "axes"
    return {"xyz": "any", "xy": "about-z"}.get(config.directions, "axes")


def _grain_at_start(exemplar: Exemplar) -> float:
    ratio = grain_ratio(exemplar)
    return min(max(GRAIN_START * ratio, ratio**GRAIN_POWER, 1.0), MAX_GRAIN)
