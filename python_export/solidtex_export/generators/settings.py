"""Sizes of the generators: the keys of `[generator.sizes]`, with the limits of the model file."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import model_validator

from solidtex_export.settings import Settings, within, wrong

MAX_CHANNELS = 4096
MAX_OCTAVES = 256
MAX_WEIGHTS = 1 << 27  # 512 MiB of float32

Levels = Annotated[int, within(1, 21)]
Channels = Annotated[int, within(1, MAX_CHANNELS)]
NoiseChannels = Annotated[int, within(1, 512)]
"""One voxel then needs fewer than 2^26 values of all levels."""
Slope = Annotated[float, within(0, 1)]
Spacing = Annotated[float, within(1e-3, 1e6)]
Family = Literal["field", "sampler"]
"""What a model file calls a family: a lattice is a field there."""


def family_of(kind: str) -> Family:
    """Family of the models that a kind of generator makes."""
    return "sampler" if kind == "sampler" else "field"


class LatticeSizes(Settings):
    """Arguments of LatticeGenerator."""

    levels: Levels = 6
    noise_channels: NoiseChannels = 3
    step_channels: Channels = 4
    slope: Slope = 0.01

    @model_validator(mode="after")
    def _check(self) -> LatticeSizes:
        most = MAX_CHANNELS // self.levels
        if self.step_channels > most:
            raise wrong(
                "step_channels", self.step_channels, f"1 to {most} for {self.levels} levels"
            )
        return self


class PyramidSizes(Settings):
    """Arguments of PyramidGenerator."""

    levels: Levels = 5
    noise_channels: NoiseChannels = 4
    width: Channels = 32
    slope: Slope = 0.2

    @model_validator(mode="after")
    def _check(self) -> PyramidSizes:
        most = MAX_CHANNELS - self.noise_channels
        if self.levels > 1 and self.width > most:
            needed = f"1 to {most} for {self.noise_channels} noise_channels"
            raise wrong("width", self.width, needed)
        return self


class SamplerSizes(Settings):
    """Arguments of OctaveSampler."""

    octaves: Annotated[int, within(1, MAX_OCTAVES)] = 16
    hidden_layers: Annotated[int, within(2, 64)] = 5
    width: Channels = 128
    slope: Slope = 0.2
    coarsest: Spacing = 48.0
    finest: Spacing = 1.0
    noise_at: Literal["hidden", "input"] = "hidden"
    conditions: bool = False

    @model_validator(mode="after")
    def _check(self) -> SamplerSizes:
        bins = self.hidden_layers - 1
        if self.noise_at == "hidden" and self.octaves % bins:
            needed = f"a multiple of hidden_layers - 1 = {bins}"
            raise wrong("octaves", self.octaves, needed)
        most = MAX_OCTAVES // bins  # a file has a bin of octaves for each hidden layer but one
        if self.noise_at == "input" and self.octaves > most:
            needed = f"1 to {most} for {self.hidden_layers} hidden_layers with noise_at = input"
            raise wrong("octaves", self.octaves, needed)
        return self


SIZES: dict[str, type[Settings]] = {
    "lattice": LatticeSizes,
    "pyramid": PyramidSizes,
    "sampler": SamplerSizes,
}
