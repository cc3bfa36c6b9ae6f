"""Builds generators by kind."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from solidtex_export.generators.lattice import LatticeGenerator
from solidtex_export.generators.pyramid import PyramidGenerator
from solidtex_export.generators.sampler import OctaveSampler

Generator = LatticeGenerator | PyramidGenerator | OctaveSampler

KINDS: dict[str, type[Generator]] = {
    "lattice": LatticeGenerator,
    "pyramid": PyramidGenerator,
    "sampler": OctaveSampler,
}
KIND_OF_FAMILY = {"field": "lattice", "sampler": "sampler"}
"""Kind of a configuration that names only its family."""


def build_generator(family: str, sizes: Mapping[str, Any]) -> Generator:
    """Build an untrained generator from its kind and its constructor arguments `sizes`."""
    arguments = dict(sizes)
    kind = arguments.pop("kind", KIND_OF_FAMILY[family])
    if kind not in KINDS:
        raise ValueError(f"kind: found {kind}, expected one of {', '.join(KINDS)}")
    return KINDS[kind](**arguments)
