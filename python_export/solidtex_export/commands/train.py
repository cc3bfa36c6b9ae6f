"""solidtex-train: trains a solid texture on one to three photographs."""

from __future__ import annotations

import argparse
import sys
from contextlib import redirect_stdout
from pathlib import Path

import torch

from solidtex_export.commands.cli import print_notes, without_remarks
from solidtex_export.commands.terminal import run_in_terminal
from solidtex_export.commands.train_options import parser, request_of
from solidtex_export.images.file_kinds import ExemplarError
from solidtex_export.losses.descriptor.weights import WeightsError
from solidtex_export.losses.statistics import LayerError
from solidtex_export.losses.vgg import VggError
from solidtex_export.settings import SettingsError
from solidtex_export.spaces.space_reader import SpaceError
from solidtex_export.training import ranks
from solidtex_export.training.acceleration import compile_generator
from solidtex_export.training.divergence import TrainError
from solidtex_export.training.resolve import Request, resolve
from solidtex_export.training.result import ResultError, ResultFolder
from solidtex_export.training.trainer import Trainer

INTERRUPTED = 130
FAILURES = (
    ExemplarError,
    LayerError,
    ResultError,
    SettingsError,
    SpaceError,
    TrainError,
    VggError,
    WeightsError,
    OSError,
)


def make_trainer(request: Request, result: Path, use_cuda: bool, compiled: bool) -> Trainer:
    """Open the training in the folder `result`: new, or resumed from its checkpoint."""
    resolved = resolve(request)
    print_notes(resolved.exemplars)
    for choice in resolved.choices:
        print(f"{result}: {choice.sentence}")
    own_ranks, device = ranks.join(use_cuda)
    folder = ResultFolder(result)
    if own_ranks.is_main:
        folder.open(resolved.config, resolved.exemplars)
    own_ranks.wait()
    trainer = Trainer(
        resolved.config,
        resolved.exemplars,
        device,
        folder,
        own_ranks,
        resolved.weights,
        resolved.start,
    )
    if compiled:
        compile_generator(trainer.generator)
    folder.resume(trainer.restore)
    return trainer


def main(arguments: list[str] | None = None) -> int:
    p = parser()
    args = p.parse_args(arguments)
    with without_remarks(args.quiet, redirect_stdout):
        return train(p, args)


def train(p: argparse.ArgumentParser, args: argparse.Namespace) -> int:
    if args.threads:
        torch.set_num_threads(args.threads)
    try:
        request = request_of(p, args)
        use_cuda = args.device != "cpu" and torch.cuda.is_available()
        trainer = make_trainer(request, args.result, use_cuda, args.compile)
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
