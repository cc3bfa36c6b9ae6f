"""Resolves a request to a complete configuration."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import torch

from solidtex_export.analysis.choice import LATTICE, Choice, choose_preset
from solidtex_export.analysis.measurements import Measurements
from solidtex_export.analysis.section_direction import with_direction_note
from solidtex_export.discriminators.critic import Critic
from solidtex_export.generators.build import build_generator
from solidtex_export.generators.sampler import OctaveSampler
from solidtex_export.generators.settings import MAX_WEIGHTS
from solidtex_export.images.channels import AS_IS, Reading
from solidtex_export.images.estimates import METHOD
from solidtex_export.images.exemplar import Exemplar, check_alike, load_exemplar
from solidtex_export.images.histograms import share_histograms
from solidtex_export.images.labels import load_labels
from solidtex_export.images.photographs import read_picture
from solidtex_export.losses.descriptor.weights import DISTILLED, PROCEDURAL, load_weights
from solidtex_export.losses.descriptors import PretrainedWeights
from solidtex_export.losses.learned import LearnedDescriptor
from solidtex_export.networks import SqueezeNet, Vgg19, load_network
from solidtex_export.training.config import Config, FileRecord, exemplar_records
from solidtex_export.training.presets import PresetError, load_recipe
from solidtex_export.training.recipe import FineTuning, Grain, Recipe
from solidtex_export.training.start import Start, StartSource

DEFAULT_SIZE = 128  # texels
SMALLEST_SIZE = 32  # texels

# A sampler is easily trained to shorter grain, hardly ever to longer one, so fibers start longer
# than measured. Layers do not, they would become ruled lines: docs/experiments/sampler-preset.md
GRAIN_GAIN = 2.0
MAX_GRAIN = 128.0


@dataclass(frozen=True)
class Request:
    """Options of a user; None leaves the choice to solidtex."""

    photos: tuple[Path, ...]
    directions: str
    maps: tuple[dict[str, Path], ...]
    """Maps of each photograph, by name."""
    estimated: tuple[str, ...] = ()
    """Names of the maps that were estimated from the photographs."""
    preset: str | None = None
    overrides: tuple[str, ...] = ()
    size: int | None = None
    resolution: int | None = None
    crop: tuple[int, ...] | None = None
    symmetry: str | None = None
    seed: int = 0
    minutes: float | None = None
    clock: Literal["wall", "processor"] = "wall"
    steps: int | None = None
    color_space: str = "srgb"
    reading: Reading = AS_IS
    license: str = ""
    source: str = ""
    features: Path | None = None
    descriptor: Path | None = None
    start: StartSource | None = None
    phases: bool = False
    """Whether the photographs are images of labels."""
    phase_names: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """Name of the preset against which sizes and options are checked."""
        return self.preset or (self.start.preset if self.start else LATTICE)

    def recipe(self) -> Recipe:
        """The recipe of that preset."""
        return load_recipe(self.name, list(self.overrides))

    @property
    def is_open(self) -> bool:
        """Whether the photograph chooses the preset: none is named, and a sampler would serve."""
        named = self.preset is not None or self.start is not None
        one = len(self.photos) == 1 and self.directions in ("xyz", "xy")
        return one and not (named or self.overrides or self.phases)


@dataclass(frozen=True)
class Resolved:
    """A training that is ready to start."""

    config: Config
    exemplars: list[Exemplar]
    weights: PretrainedWeights
    choices: tuple[Choice, ...]
    start: Start | None = None


def resolve(request: Request) -> Resolved:
    """Read the photographs and weights, measure them, and resolve open options."""
    size, resolution = scale(request)
    exemplars = load_exemplars(request, resolution, size)
    check_alike(exemplars)
    if request.size is None and request.resolution is None:
        default = default_size(request)
        pairs = zip(request.photos, exemplars, strict=True)
        exemplars = [note_small(path, exemplar, size, default) for path, exemplar in pairs]
    for exemplar in exemplars:
        for name in request.estimated:
            exemplar.maps[name]["estimate"] = METHOD
    if request.recipe().match_histograms:
        exemplars = share_histograms(exemplars)
    measured = Measurements(
        exemplars, request.directions, lambda: LearnedDescriptor(load_weights(PROCEDURAL)).distances
    )
    preset, recipe, choices = decide(request, measured)
    if recipe.fine_tuning is not None and request.start is None:
        raise PresetError(f"{preset}: fine_tuning: found no --space, expected one to start from")
    start = None
    if request.start is not None:
        if recipe.has_frozen_critic:
            check_critic(preset, recipe, request.start)
        recipe = starting_recipe(preset, recipe, request)
        start = request.start.start(exemplars[0], recipe.has_frozen_critic)
        if request.start.reason:
            choices += (Choice("space", start.record.name, request.start.reason),)
        if request.preset is None:
            choices += (Choice("preset", preset, f"start from {start.record.name}"),)
    descriptor = request.descriptor
    if descriptor is None and uses_learned(recipe, request.features):
        descriptor = shipped_descriptor(recipe)
    config = Config(
        preset=preset,
        reasons=tuple(choice.sentence for choice in choices),
        family=recipe.family,
        size=size,
        resolution=resolution,
        crop=request.crop,
        directions=request.directions,
        seed=request.seed,
        minutes=request.minutes,
        clock=request.clock,
        steps=request.steps,
        exemplars=exemplar_records(exemplars),
        channels=exemplars[0].channels,
        color_space=exemplars[0].color_space,
        license=request.license,
        source=request.source,
        generator=generator_arguments(preset, recipe, len(exemplars[0].channels), request.phases),
        recipe=recipe,
        features=_record(request.features),
        descriptor=_record(descriptor),
        space=start.record if start else None,
        fine_tuned=(recipe.fine_tuning or FineTuning()) if start else None,
    )
    features = load_features(request, config)
    learned = None
    if descriptor is not None:
        learned = load_weights(descriptor)
    weights = PretrainedWeights(features, learned)
    check_layers(preset, recipe, weights)
    return Resolved(config, exemplars, weights, choices, start)


def check_layers(preset: str, recipe: Recipe, weights: PretrainedWeights) -> None:
    """Refuse a loss of features none of whose layers its descriptor has."""
    for name, term in recipe.losses.items():
        known = weights.feature_names(term.descriptor)
        if term.layers and not set(term.layers) & set(known):
            raise PresetError(
                f"{preset}: losses.{name}.layers: found {', '.join(term.layers)}, expected some of"
                f" {', '.join(known)}"
            )


def shipped_descriptor(recipe: Recipe) -> Path:
    """Weights for a recipe; docs/experiments/ablation.md has the figures."""
    return DISTILLED if recipe.family == "field" else PROCEDURAL


def load_exemplars(request: Request, resolution: int, size: int) -> list[Exemplar]:
    if request.phases:
        sections = load_labels(request.photos, resolution, size, request.crop, request.phase_names)
        serves_all = len(sections) == 1 and request.directions == "xyz"
        return [with_direction_note(sections[0])] if serves_all else sections
    return [
        load_exemplar(
            path, resolution, size, request.crop, maps, request.color_space, request.reading
        )
        for path, maps in zip(request.photos, request.maps, strict=True)
    ]


def default_size(request: Request) -> int:
    """Side of the slices of a large photograph, in texels."""
    return request.recipe().slicing.size or DEFAULT_SIZE


def note_small(path: Path, exemplar: Exemplar, size: int, default: int) -> Exemplar:
    """Add a note if the photograph makes the slices smaller."""
    rows, columns = exemplar.image.shape[1:]
    if min(rows, columns) > size or size >= default:
        return exemplar
    note = (
        f"{path}: {columns} x {rows} pixels: slices of {size} instead of {default};"
        " features repeat little in so small a photograph"
    )
    return replace(exemplar, notes=(*exemplar.notes, note))


def smallest_size(request: Request) -> int:
    """Side of the smallest slice that every loss accepts, in texels."""
    return max(SMALLEST_SIZE, request.recipe().smallest_slice)


def scale(request: Request) -> tuple[int, int]:
    """Side of slices, and resolution.

    Slices of the default size see half of the photograph each way, or all of a small one.
    """
    size = request.size
    if size is None:
        crop = request.crop
        sizes = [
            crop[2:] if crop else read_picture(p, request.reading.layer).size
            for p in request.photos
        ]
        default = default_size(request)
        largest = min(default, request.resolution or default, *map(min, sizes))
        size = max(smallest_size(request), largest)
    whole = request.start.resolution if request.start else 2 * size
    return size, request.resolution or whole


def decide(request: Request, measured: Measurements) -> tuple[str, Recipe, tuple[Choice, ...]]:
    """Resolve the name of the preset, its recipe, and the choices made."""
    choices = []
    preset = request.name
    if request.is_open:
        choices.append(choose_preset(measured))
        preset = choices[-1].value
    recipe = load_recipe(preset, list(request.overrides))
    symmetry = request.symmetry or recipe.slicing.symmetry
    if symmetry == "auto":
        symmetry = measured.most_symmetric
        if _shows_orientations(recipe) and measured.symmetry.name != symmetry:
            symmetry, reason = measured.symmetry
            choices.append(Choice("symmetry", symmetry, reason))
    planes = _planes(recipe, request)
    elongation = recipe.grain.elongation
    if elongation is None and recipe.slicing.planes == "auto" and planes == "about-z":
        elongation = initial_grain(measured.grain)
    slicing = recipe.slicing.model_copy(update={"symmetry": symmetry, "planes": planes})
    grain = recipe.grain.model_copy(update={"elongation": elongation})
    resolved = recipe.model_copy(update={"slicing": slicing, "grain": grain})
    return preset, resolved, tuple(choices)


def _shows_orientations(recipe: Recipe) -> bool:
    """Whether orientations are chosen by measurement.

    A sampler's random planes show all orientations alike.
    """
    return recipe.family == "field" and recipe.uses("learned")


def _planes(recipe: Recipe, request: Request) -> str:
    """Meaning of `auto`: GramGAN, section 4, "implementation details"."""
    if recipe.slicing.planes != "auto":
        return recipe.slicing.planes
    if len(request.photos) > 1:
        return "axes"
    return {"xyz": "any", "xy": "about-z"}.get(request.directions, "axes")


def initial_grain(measured: float) -> float:
    """Initial stretch of octaves along z, below 1 for layers normal to z."""
    if measured < 1:
        return max(measured, 1 / MAX_GRAIN)
    return min(GRAIN_GAIN * measured, MAX_GRAIN)


def uses_learned(recipe: Recipe, features: Path | None) -> bool:
    return recipe.uses("learned") or (recipe.uses("features") and features is None)


def generator_arguments(
    preset: str, recipe: Recipe, channels: int, phases: bool = False
) -> dict[str, Any]:
    """Kind and constructor arguments of the generator, checked by building it."""
    settings = recipe.generator
    arguments = {"kind": settings.kind, **settings.sizes, "out_channels": channels}
    if phases and settings.kind != "lattice":
        raise PresetError(
            f"{preset}: generator.kind: found {settings.kind}, expected lattice for --phases"
        )
    if phases:
        arguments["softmax"] = True
    try:
        with torch.device("meta"):
            generator = build_generator(recipe.family, arguments)
    except (TypeError, ValueError) as error:
        raise PresetError(f"{preset}: generator: {error}") from error
    weights = sum(parameter.numel() for parameter in generator.parameters())
    if weights > MAX_WEIGHTS:
        raise PresetError(
            f"{preset}: generator.sizes: found {weights} weights, expected at most {MAX_WEIGHTS},"
            " the 512 MiB of a model file; choose smaller sizes"
        )
    short = recipe.grain.short_octaves
    if isinstance(generator, OctaveSampler) and short >= generator.octaves:
        needed = f"fewer than all {generator.octaves} octaves"
        raise PresetError(f"{preset}: grain.short_octaves: found {short}, expected {needed}")
    return arguments


def starting_recipe(preset: str, recipe: Recipe, request: Request) -> Recipe:
    """The recipe with the generator of the start."""
    source = request.start
    assert source is not None
    sizes = dict(source.generator)
    kind = sizes.pop("kind")
    found = recipe.generator
    if found.kind != kind:
        raise PresetError(
            f"{preset}: generator.kind: found {found.kind}, expected {kind} as in {source.label}"
        )
    if found.statistics != "measured":
        raise PresetError(
            f"{preset}: generator.statistics: found {found.statistics}, expected measured for"
            f" {source.label}"
        )
    for override in request.overrides:
        if override.startswith("generator."):
            raise PresetError(f"--set: found {override}, expected the sizes of {source.label}")
    generator = found.model_copy(update={"sizes": sizes})
    grain = Grain(elongation=None)
    return recipe.model_copy(update={"generator": generator, "grain": grain})


def check_critic(preset: str, recipe: Recipe, source: StartSource) -> None:
    """Refuse a frozen critic that is absent or has other sizes."""
    if source.critic is None:
        raise PresetError(
            f"{preset}: fine_tuning.critic: found no critic in {source.label}, expected the result"
            " folder of a space that was trained with one (solidtex-train-space --preset"
            " gramgan-space)"
        )
    settings = recipe.critic
    critic = Critic(3, settings.widths, settings.equalized_learning_rate)
    try:
        critic.load_state_dict(dict(source.critic))
    except RuntimeError as error:
        raise PresetError(
            f"{preset}: critic.widths: found {list(settings.widths)}, expected those of"
            f" {source.label}"
        ) from error


def load_features(request: Request, config: Config) -> Vgg19 | SqueezeNet | None:
    """The network of --features; bad weights are refused before a result folder is made."""
    if request.features is None:
        return None
    channels = config.channels
    if config.recipe.only_features and len(channels) > 3:
        raise PresetError(
            f"--features: found {len(channels)} channels ({', '.join(channels)}), expected at most"
            f" 3: the network sees no more, and preset {config.preset} has no other loss"
        )
    return load_network(request.features)


def _record(path: Path | None) -> FileRecord | None:
    if path is None:
        return None
    if not path.is_file():
        raise FileNotFoundError(f"{path}: found no such file, expected weights of a descriptor")
    return FileRecord(file=path.name, sha256=hashlib.sha256(path.read_bytes()).hexdigest())
