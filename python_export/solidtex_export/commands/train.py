"""solidtex-train: from one to three photographs to a training result."""

from __future__ import annotations

import argparse
import functools
import hashlib
import sys
from pathlib import Path

import torch

from solidtex_export.analysis.choice import suited
from solidtex_export.analysis.lines import line_length
from solidtex_export.analysis.symmetry import symmetry_of
from solidtex_export.commands.cli import print_notes, reading_of
from solidtex_export.commands.terminal import run_in_terminal
from solidtex_export.commands.train_options import DEFAULT_SIZE, check, parser, smallest_size
from solidtex_export.images.exemplar import Exemplar, check_alike, load_exemplar
from solidtex_export.images.file_kinds import ExemplarError
from solidtex_export.images.histograms import share_histograms
from solidtex_export.images.photographs import read_picture
from solidtex_export.losses.descriptor.weights import SHIPPED, WeightsError, load_weights
from solidtex_export.losses.descriptors import PretrainedWeights
from solidtex_export.losses.learned import LearnedDescriptor
from solidtex_export.losses.statistics import LayerError
from solidtex_export.losses.vgg import VggError, read_weights
from solidtex_export.training import ranks
from solidtex_export.training.acceleration import compile_generator
from solidtex_export.training.config import Config, exemplar_records
from solidtex_export.training.divergence import TrainError
from solidtex_export.training.families import generator_sizes
from solidtex_export.training.preset import Method
from solidtex_export.training.preset_file import MethodError, load_method
from solidtex_export.training.result import ResultError, ResultFolder
from solidtex_export.training.trainer import Trainer

INTERRUPTED = 130
FAILURES = (
    ExemplarError,
    LayerError,
    MethodError,
    ResultError,
    TrainError,
    VggError,
    WeightsError,
    OSError,
)


def make_trainer(args: argparse.Namespace) -> Trainer:
    choose_scale(args)
    reading = reading_of(args)
    exemplars = [
        load_exemplar(path, args.resolution, args.size, args.crop, maps, args.color_space, reading)
        for path, maps in zip(args.photos, args.maps, strict=True)
    ]
    print_notes(exemplars)
    check_alike(exemplars)
    if args.settings.match_histograms:
        exemplars = share_histograms(exemplars)
    follow_photographs(args, exemplars)
    config = make_config(args, exemplars)
    learned = load_weights(args.descriptor) if args.descriptor else None
    if args.vgg:
        read_weights(args.vgg)  # refuses a bad file before there is a result folder
    weights = PretrainedWeights(args.vgg, learned)
    own_ranks, device = ranks.join(args.device != "cpu" and torch.cuda.is_available())

    folder = ResultFolder(args.result)
    if own_ranks.leads:
        folder.open(config, exemplars)
    own_ranks.wait()
    trainer = Trainer(config, exemplars, device, folder, own_ranks, weights)
    if args.compile:
        compile_generator(trainer.generator)
    folder.resume(trainer.restore)
    return trainer


def choose_scale(args: argparse.Namespace) -> None:
    """Slices of the default size see half of the photograph each way, or all of a small one."""
    if args.size is None:
        sizes = [
            args.crop[2:] if args.crop else read_picture(p, args.layer).size for p in args.photos
        ]
        largest = min(DEFAULT_SIZE, args.resolution or DEFAULT_SIZE, *map(min, sizes))
        args.size = max(smallest_size(args.settings), largest)
    args.resolution = args.resolution or 2 * args.size


def follow_photographs(args: argparse.Namespace, exemplars: list[Exemplar]) -> None:
    """What is not said, method and symmetry, is measured on the photographs, once if at all."""
    turns = len(exemplars) == 1 and args.directions == "xyz"
    most = "all" if turns else "flips"
    judge = functools.cache(lambda: LearnedDescriptor(load_weights(SHIPPED)).loss)
    measured = functools.cache(lambda: symmetry_of(exemplars, turns, judge()))
    if args.choose:
        args.method, reason = suited(exemplars[0], args.directions, measured, judge())
        args.settings = load_method(args.method)
        print(f"{args.result}: {reason}, so --method {args.method}")
    args.symmetry = args.symmetry or args.settings.slicing.symmetry
    if args.symmetry != "auto":
        return
    args.symmetry = most
    if tells_orientations(args.settings) and measured().name != most:
        args.symmetry, reason = measured()
        print(f"{args.result}: {reason}, so --symmetry {args.symmetry}")


def tells_orientations(method: Method) -> bool:
    """A sampler's random planes show all of them alike; and where no trained weights judge slices,
    none are to decide how these are shown."""
    return method.family == "field" and method.uses("learned")


def make_config(args: argparse.Namespace, exemplars: list[Exemplar]) -> Config:
    channels = exemplars[0].channels
    if args.vgg and args.settings.only_vgg and len(channels) > 3:
        raise MethodError(
            f"--vgg: found {len(channels)} channels ({', '.join(channels)}), expected at most 3:"
            f" VGG-19 sees no more, and method {args.method} has no other loss"
        )
    try:
        generator = generator_sizes(args.settings, len(channels))
    except (TypeError, ValueError) as error:
        raise MethodError(f"{args.method}: generator: {error}") from error
    return Config(
        family=args.settings.family,
        size=args.size,
        resolution=args.resolution,
        crop=args.crop,
        directions=args.directions,
        symmetry=args.symmetry,
        seed=args.seed,
        minutes=args.minutes,
        steps=args.steps,
        exemplars=exemplar_records(exemplars),
        channels=channels,
        color_space=exemplars[0].color_space,
        license=args.license,
        source=args.source,
        generator=generator,
        method_name=args.method,
        method=args.settings,
        vgg=file_record(args.vgg) if args.vgg else None,
        descriptor=file_record(args.descriptor) if args.descriptor else None,
        line_length=round(line_length(exemplars), 1),
    )


def file_record(path: Path) -> dict[str, str]:
    if not path.is_file():
        raise FileNotFoundError(f"{path}: found no such file, expected weights of a descriptor")
    return {"file": path.name, "sha256": hashlib.sha256(path.read_bytes()).hexdigest()}


def main(arguments: list[str] | None = None) -> int:
    p = parser()
    args = p.parse_args(arguments)
    check(p, args)
    if args.threads:
        torch.set_num_threads(args.threads)
    try:
        trainer = make_trainer(args)
        if trainer.finished:
            print(f"{args.result}: already trained to the end")
            return 0
        if trainer.step:
            print(f"{args.result}: resuming at step {trainer.step}")
        print(f"{args.result}: training on {trainer.device}; Ctrl-C saves and stops", flush=True)
        run_in_terminal(trainer)
    except FAILURES as error:
        print(f"solidtex-train: {error}", file=sys.stderr)
        return 1
    finally:
        ranks.leave()
    if not trainer.finished:
        print(f"{args.result}: stopped at step {trainer.step}; the same command resumes")
        return INTERRUPTED
    print(f"{args.result}: done; look at {trainer.folder.preview}")
    print(f"next: solidtex-export {args.result} -o {args.result.name}.solidtex")
    return 0


if __name__ == "__main__":
    sys.exit(main())
