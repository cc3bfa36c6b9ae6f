"""solidtex-train-space: trains a texture space on many photographs."""

from __future__ import annotations

import argparse
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import torch

from solidtex_export.commands import cli
from solidtex_export.commands.terminal import run_in_terminal
from solidtex_export.images.file_kinds import ExemplarError
from solidtex_export.losses.descriptor.weights import WeightsError
from solidtex_export.settings import SettingsError
from solidtex_export.spaces.alanov.materials import Texture, load_textures, notes_of
from solidtex_export.spaces.alanov.settings import AlanovRecipe
from solidtex_export.spaces.alanov.trainer import AlanovTrainer
from solidtex_export.spaces.photographs import Material, find_sources, load_materials
from solidtex_export.spaces.reptile import StartTrainer
from solidtex_export.spaces.settings import (
    AnyRecipe,
    SpaceRecipe,
    StartRecipe,
    load_space_recipe,
    shipped_presets,
)
from solidtex_export.spaces.space_file import SUFFIX
from solidtex_export.spaces.start_file import SUFFIX as START_SUFFIX
from solidtex_export.spaces.trainer import PATCH, SpaceTrainer
from solidtex_export.training import ranks
from solidtex_export.training.divergence import TrainError
from solidtex_export.training.result import ResultError, ResultFolder

INTERRUPTED = 130
FAILURES = (ExemplarError, ResultError, SettingsError, TrainError, WeightsError, OSError)

EXAMPLES = """  solidtex-train-space stones/ -o results/stones --minutes 120
  solidtex-train-space woods.csv --preset sampler -o results/woods --minutes 120
  solidtex-train-space stones/ --held-out validation/ -o results/stones --steps 20000
  solidtex-train-space berea.tif ketton.tif --preset alanov-porous -o results/rocks

A CSV names files and their licences in the columns file and licence; source or attribution, split
and direction are optional. Of PHOTOS, rows whose split is train or empty are learned; of --held-out
any row that is not learned is shown. sampler turns photographs so that their grain is vertical, but
none with a direction, whatever it is.

The same command again resumes an interrupted training, and with more --minutes or --steps continues
a finished one. Ctrl-C saves before it stops.
Then: solidtex-export-space RESULT -o NAME.solidtex-space
With the presets alanov-*: solidtex-export-space RESULT --material NAME -o NAME.solidtex"""

KINDS = {SpaceRecipe: "space", StartRecipe: "start", AlanovRecipe: "alanov"}
Trainer = SpaceTrainer | StartTrainer | AlanovTrainer


@dataclass(frozen=True)
class SpaceConfig:
    """Everything that a space's result depends on, but how long it is trained."""

    preset: str
    recipe: AnyRecipe
    resolution: int
    seed: int
    photographs: list[dict[str, str]]

    def document(self) -> dict[str, Any]:
        return {
            "version": 1,
            "kind": KINDS[type(self.recipe)],
            "preset": self.preset,
            "recipe": self.recipe.model_dump(mode="json", exclude_none=True),
            "resolution": self.resolution,
            "seed": self.seed,
            "photographs": self.photographs,
        }


def parser() -> argparse.ArgumentParser:
    p = cli.parser(
        "solidtex-train-space",
        "Learn a texture space from many photographs.",
        EXAMPLES,
    )
    p.add_argument("photos", metavar="PHOTOS", nargs="+", type=Path,
                   help="photographs (volumes with alanov-porous), folders of them, or CSV files"
                   " that list them")  # fmt: skip
    p.add_argument("-o", dest="result", metavar="RESULT", required=True, type=Path,
                   help="result folder, new or of the same training")  # fmt: skip
    p.add_argument("--preset", default="lattice", metavar="NAME",
                   help=f"one of {', '.join(shipped_presets())}, or a TOML file"
                   " (default: lattice)")  # fmt: skip
    p.add_argument("--held-out", nargs="+", type=Path, default=[], metavar="PHOTOS",
                   help="photographs that are not learned, only shown in previews; of a CSV, rows"
                   " of any split")  # fmt: skip
    p.add_argument("--folder", type=Path, metavar="FOLDER",
                   help="folder of the files of a CSV (default: its own folder)")  # fmt: skip
    p.add_argument("--resolution", type=int, default=256, metavar="N",
                   help="reduce photographs whose shorter side is longer than N pixels; one pixel"
                   " is then one texel (default: 256)")  # fmt: skip
    p.add_argument("--minutes", type=float, metavar="M", help="training time (default: 120)")
    p.add_argument("--steps", type=int, metavar="N", help="train N steps instead of --minutes")
    p.add_argument("--seed", type=int, default=0, metavar="S", help="random seed (default: 0)")
    p.add_argument("--device", choices=("auto", "cpu", "cuda"), default="auto",
                   help="auto: CUDA if there is a device (default: auto)")  # fmt: skip
    p.add_argument("--threads", type=int, metavar="T", help="CPU threads (default: torch's)")
    return p


def check(p: argparse.ArgumentParser, args: argparse.Namespace) -> None:
    if args.minutes is not None and args.steps is not None:
        p.error("--steps: found together with --minutes, expected one of them")
    if args.minutes is not None and not 0 < args.minutes < 1e6:
        p.error(f"--minutes: found {args.minutes}, expected more than 0")
    for option, low in (("steps", 1), ("threads", 1), ("resolution", PATCH)):
        value = getattr(args, option)
        if value is not None and value < low:
            p.error(f"--{option}: found {value}, expected at least {low}")
    if args.device == "cuda" and not torch.cuda.is_available():
        p.error("--device: found no CUDA device, expected one (or use --device cpu)")


def make_trainer(args: argparse.Namespace) -> Trainer:
    """Open the training in the result folder: new, or resumed from its checkpoint."""
    recipe = load_space_recipe(args.preset)
    if isinstance(recipe, AlanovRecipe):
        return _make_alanov_trainer(args, recipe)
    materials = _materials(args.photos, args, recipe)
    held_out = []
    if args.held_out:
        held_out = _materials(args.held_out, args, recipe, [m.source.path for m in materials])
    folder, own_ranks, device = _open(args, recipe, [m.record() for m in materials])
    trainer: SpaceTrainer | StartTrainer
    if isinstance(recipe, StartRecipe):
        trainer = StartTrainer(recipe, materials, held_out, args.seed, device, folder)
    else:
        cli.say(f"{args.result}: measuring {len(materials)} photographs")
        trainer = SpaceTrainer(recipe, materials, held_out, args.seed, device, folder, own_ranks)
    _begin(trainer, args)
    return trainer


def _make_alanov_trainer(args: argparse.Namespace, recipe: AlanovRecipe) -> AlanovTrainer:
    given = (args.folder, args.resolution, recipe)
    textures, held_out = load_textures(args.photos, *given), list[Texture]()
    if args.held_out:
        held_out = load_textures(args.held_out, *given, [t.source.path for t in textures])
    for note in notes_of([*textures, *held_out]):
        cli.say(note)
    folder, own_ranks, device = _open(args, recipe, [t.record() for t in textures])
    trainer = AlanovTrainer(recipe, textures, held_out, args.seed, device, folder, own_ranks)
    _begin(trainer, args)
    return trainer


def _open(
    args: argparse.Namespace, recipe: AnyRecipe, records: list[dict[str, str]]
) -> tuple[ResultFolder, ranks.Ranks, torch.device]:
    config = SpaceConfig(args.preset, recipe, args.resolution, args.seed, records)
    use_cuda = args.device != "cpu" and torch.cuda.is_available()
    own_ranks, device = ranks.join(use_cuda)
    folder = ResultFolder(args.result, "solidtex-train-space")
    if own_ranks.is_main:
        folder.open(config, [])
    own_ranks.wait()
    return folder, own_ranks, device


def _begin(trainer: Trainer, args: argparse.Namespace) -> None:
    """Set the length of the training, and the state of its checkpoint."""
    trainer.steps = args.steps
    trainer.minutes = 120.0 if args.steps is args.minutes is None else args.minutes
    trainer.folder.resume(trainer.restore)


def _materials(
    paths: list[Path],
    args: argparse.Namespace,
    recipe: SpaceRecipe | StartRecipe,
    learned: list[Path] | None = None,
) -> list[Material]:
    upright, scales = recipe.directions == "xy", recipe.slicing.scales
    sources = find_sources(paths, args.folder, learned=learned)
    return load_materials(sources, args.resolution, PATCH, recipe.colors, scales, upright)


def main(arguments: list[str] | None = None) -> int:
    p = parser()
    args = p.parse_args(arguments)
    check(p, args)
    if args.threads:
        torch.set_num_threads(args.threads)
    try:
        with cli.without_remarks(args.quiet):
            trainer = train(args)
    except FAILURES as error:
        print(f"solidtex-train-space: {cli.reason(error)}", file=sys.stderr)
        return 1
    finally:
        ranks.leave()
    finished = trainer.progress >= 1
    if args.json:
        found = {"result": str(args.result), "step": trainer.step, "finished": finished}
        cli.print_document(p.prog, found | cli.files(trainer.folder.preview))
    elif finished:
        print(f"{args.result}: done; look at {trainer.folder.preview}")
    return 0 if finished else INTERRUPTED


def train(args: argparse.Namespace) -> Trainer:
    """Train to the end or to Ctrl-C; what happens meanwhile is told on standard error."""
    trainer = make_trainer(args)
    if trainer.progress >= 1:
        cli.say(f"{args.result}: already trained to the end")
        return trainer
    if trainer.step:
        cli.say(f"{args.result}: resuming at step {trainer.step}")
    cli.say(f"{args.result}: training on {trainer.device}; Ctrl-C saves and stops")
    run_in_terminal(trainer)
    if trainer.progress < 1:
        cli.say(f"{args.result}: stopped at step {trainer.step}; the same command resumes")
    else:
        cli.say(f"next: solidtex-export-space {args.result} {_export_options(trainer, args)}")
    return trainer


def _export_options(trainer: Trainer, args: argparse.Namespace) -> str:
    """A space or a start is one file; each material of an Alanov training is a model."""
    if isinstance(trainer, AlanovTrainer):
        material = trainer.textures[0].name
        return f"--material {material} -o {material}.solidtex"
    suffix = START_SUFFIX if isinstance(trainer, StartTrainer) else SUFFIX
    return f"-o {args.result.name}{suffix}"


if __name__ == "__main__":
    sys.exit(main())
