"""What differs between the two families in training: the generator and the way it is sliced."""

from __future__ import annotations

from torch import nn

from solidtex_export.generators.lattice import LatticeGenerator
from solidtex_export.generators.sampler import OctaveSampler
from solidtex_export.training.axes import grain_ratio
from solidtex_export.training.config import Config
from solidtex_export.training.exemplar import Exemplar
from solidtex_export.training.slices import LatticeSlices, SamplerSlices, SliceSource

GRAIN_START = 2.0  # long grain is easily cut shorter, short grain hardly ever grows together
MAX_GRAIN = 64.0


def build(config: Config, exemplars: list[Exemplar]) -> tuple[nn.Module, SliceSource]:
    """The generator of the family, and its way of slicing."""
    if config.family == "field":
        generator = LatticeGenerator(**config.generator)
        return generator, LatticeSlices(generator)
    sampler = OctaveSampler(**config.generator)
    planes = "axes"
    if len(exemplars) == 1 and config.directions == "xyz":
        planes = "any"
    elif len(exemplars) == 1 and config.directions == "xy":
        planes = "about-z"
        grain = min(max(GRAIN_START * grain_ratio(exemplars[0]), 1.0), MAX_GRAIN)
        sampler.scales[:, :, 2] /= grain
    return sampler, SamplerSlices(sampler, planes)
