"""Builds the generator and the slice sources of a configuration."""

from __future__ import annotations

from solidtex_export.generators.build import Generator, build_generator
from solidtex_export.generators.init import init_grain
from solidtex_export.generators.lattice import BaseLattice
from solidtex_export.generators.oblique import ObliqueSlices
from solidtex_export.generators.slices import LatticeSlices, SamplerSlices, SliceSource
from solidtex_export.training.config import Config


def build(config: Config) -> tuple[Generator, SliceSource, SliceSource | None]:
    """The generator, its slices, and its oblique slices where the recipe has some."""
    recipe = config.recipe
    generator = build_generator(config.family, config.generator)
    if isinstance(generator, BaseLattice):
        return generator, LatticeSlices(generator), _oblique(config, generator)
    if recipe.grain.elongation is not None:
        init_grain(generator, recipe.grain.elongation, recipe.grain.short_octaves)
    return generator, SamplerSlices(generator, recipe.slicing.planes), None


def _oblique(config: Config, generator: BaseLattice) -> ObliqueSlices | None:
    """Oblique slices. Where one photograph serves two directions, only planes along the grain match
    it.
    """
    if config.recipe.slicing.oblique_share == 0 or len(config.exemplars) > 1:
        return None
    axes = {"xyz": "xyz", "xy": "z"}.get(config.directions)
    return ObliqueSlices(generator, axes) if axes else None
