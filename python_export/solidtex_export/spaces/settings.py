"""Settings of a texture space's training; the presets in presets/spaces are files of them."""

from __future__ import annotations

from importlib import resources
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from solidtex_export.discriminators.settings import CriticSettings
from solidtex_export.settings import Settings, SettingsError, read_toml, validated, within
from solidtex_export.spaces.alanov.settings import AlanovRecipe
from solidtex_export.training.recipe import GeneratorSettings, Optimizer

Size = Annotated[int, within(1, 4096)]


class LatticeSettings(Settings):
    """Sizes of the lattice generator (generators/lattice.py)."""

    levels: Annotated[int, within(2, 12)] = 6
    noise_channels: Size = 3
    step_channels: Size = 6
    slope: Annotated[float, within(0, 1)] = 0.2


class SamplerSettings(Settings):
    """Sizes of the sampler (generators/sampler.py)."""

    octaves: Annotated[int, within(1, 256)] = 32
    hidden_layers: Annotated[int, within(2, 64)] = 5
    width: Size = 128
    slope: Annotated[float, within(0, 1)] = 0.2
    coarsest: Annotated[float, within(0.1, 4096)] = 48.0
    finest: Annotated[float, within(0.1, 4096)] = 1.0
    noise_at: Literal["hidden", "input"] = "hidden"
    condition_at: Literal["hidden", "input"] = "hidden"
    """hidden: scale and shift of every hidden layer (GramGAN, equation 5); input: an input vector
    (Henzler et al. 2020).
    """
    transforms: Literal["bounded", "linear"] = "bounded"
    """linear: Q gives the entries of T_i, as published; bounded: a limited change of a learned
    T_i.
    """
    grain: Annotated[float, within(1, 1000)] = 1.0
    """Initial stretch of the octaves along z."""
    round_octaves: Annotated[int, within(0, 256)] = 0
    """Number of octaves, evenly over the ladder, that start without that stretch."""

    @model_validator(mode="after")
    def _check(self) -> SamplerSettings:
        if self.round_octaves > self.octaves:
            raise ValueError(
                f"round_octaves: found {self.round_octaves}, expected at most {self.octaves},"
                " all octaves"
            )
        return self


class EncoderSettings(Settings):
    """Encoder E: patch to code."""

    kind: Literal["descriptor", "convolutions"]
    """descriptor: statistics of the frozen learned descriptor, then a small trained network;
    convolutions: a convolutional network trained with the space.
    """
    width: Size = 64
    unit_codes: bool = False
    """Scale codes to a mean square of 1, so that no photograph's code is far from all others."""


class SlicingSettings(Settings):
    """Slices and photographs of one step."""

    size: Annotated[int, within(32, 1024)] = 96
    batch: Annotated[int, within(1, 256)] = 3
    """Number of materials in a step, one slice each."""
    planes: Literal["axes", "any", "about-z"] = "axes"
    symmetry: Literal["all", "flips", "none"] = "all"
    scales: Annotated[tuple[float, ...], Field(strict=False, min_length=1)] = (1.0,)
    """Each photograph is learned at these scales, as different materials."""


class LossSettings(Settings):
    """Weights of the generator's losses; 0 leaves a loss out."""

    descriptor: Annotated[float, within(0, 1e6)] = 0.0
    network: Literal["procedural", "distilled"] = "procedural"
    """The descriptor's weights."""
    wavelets: Annotated[float, within(0, 1e6)] = 0.0
    style: Annotated[float, within(0, 1e6)] = 0.0
    adversarial: Annotated[float, within(0, 1e6)] = 0.0
    mixing: Literal["sum", "unit-gradients"] = "sum"
    """unit-gradients: the gradient of each loss and slice has unit length before weighting."""
    code_noise: Annotated[float, within(0, 10)] = 0.0
    """Deviation of the noise that is added to codes in training."""


class SpaceRecipe(Settings):
    """Everything of a space's training that does not depend on the photographs."""

    code: Size = 32
    style_width: Size = 128
    colors: Literal["photograph", "network"]
    """photograph: the network gives whitened values, and each photograph its own mean and axes."""
    directions: Literal["xyz", "xy"] = "xyz"
    lattice: LatticeSettings | None = None
    sampler: SamplerSettings | None = None
    encoder: EncoderSettings
    slicing: SlicingSettings = SlicingSettings()
    losses: LossSettings
    optimizer: Optimizer
    gradient_norm: Annotated[float, within(0, 1e6)] = 0.0
    """Longest gradient of a step; a longer one is scaled down. 0: no limit."""
    critic: CriticSettings | None = None

    @property
    def family(self) -> Literal["lattice", "sampler"]:
        return "lattice" if self.lattice is not None else "sampler"


class Reptile(Settings):
    """Reptile (Nichol, Achiam and Schulman 2018): short inner trainings, each of one photograph."""

    steps: Annotated[int, within(1, 10000)] = 24
    """Number of steps of an inner training."""
    rate: Annotated[float, within(1e-6, 1)] = 0.5
    """Share of the way to the inner training's weights that the start goes."""
    final_rate: Annotated[float, within(0, 1)] = 0.1
    """Final rate after half a cosine, as a fraction of the first."""


class StartRecipe(Settings):
    """Training of a start: weights of an ordinary generator that are learned for being adapted."""

    reptile: Reptile
    generator: GeneratorSettings
    directions: Literal["xyz", "xy"] = "xyz"
    colors: Literal["photograph"] = "photograph"
    slicing: SlicingSettings = SlicingSettings()
    losses: LossSettings
    optimizer: Optimizer


def shipped_presets() -> list[str]:
    files = (f.name for f in (resources.files("solidtex_export") / "presets" / "spaces").iterdir())
    return sorted(name.removesuffix(".toml") for name in files if name.endswith(".toml"))


AnyRecipe = SpaceRecipe | StartRecipe | AlanovRecipe


def load_space_recipe(name: str) -> AnyRecipe:
    """Load a recipe by the name of a shipped preset or the path of a TOML file."""
    if name in shipped_presets():
        path = resources.files("solidtex_export") / "presets" / "spaces" / f"{name}.toml"
    elif name.endswith(".toml"):
        path = Path(name)
    else:
        names = ", ".join(shipped_presets())
        raise SettingsError(f"--preset: found {name}, expected one of {names} or a .toml file")
    table = read_toml(path)
    if "reptile" in table:
        return validated(StartRecipe, table, name)
    if "dimensions" in table:
        return _alanov_recipe(table, name)
    recipe = validated(SpaceRecipe, table, name)
    if (recipe.lattice is None) == (recipe.sampler is None):
        raise SettingsError(f"{name}: expected one of the tables lattice and sampler")
    if (recipe.losses.style > 0 or recipe.losses.adversarial > 0) and recipe.critic is None:
        raise SettingsError(f"{name}: critic: found nothing, expected this table for its losses")
    return recipe


def _alanov_recipe(table: dict[str, Any], name: str) -> AlanovRecipe:
    recipe = validated(AlanovRecipe, table, name)
    size, least = recipe.crops.size, recipe.smallest_crop
    if size < least:
        raise SettingsError(
            f"{name}: crops.size: found {size}, expected at least {least} for these networks"
        )
    return recipe
