"""solidtex-train: trains a solid texture on one to three photographs."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import torch

from solidtex_export.commands.cli import (
    files,
    print_document,
    print_notes,
    reason,
    say,
    without_remarks,
)
from solidtex_export.commands.terminal import run_in_terminal
from solidtex_export.commands.train_options import parser, request_of
from solidtex_export.images.file_kinds import ExemplarError
from solidtex_export.losses.statistics import LayerError
from solidtex_export.networks.weights import WeightsError
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
    WeightsError,
    OSError,
)


def make_trainer(request: Request, result: Path, use_cuda: bool, compiled: bool) -> Trainer:
    """Open the training in the folder `result`: new, or resumed from its checkpoint."""
    resolved = resolve(request)
    print_notes(resolved.exemplars)
    for choice in resolved.choices:
        say(f"{result}: {choice.sentence}")
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
    if args.threads:
        torch.set_num_threads(args.threads)
    try:
        with without_remarks(args.quiet):
            trainer = train(request_of(p, args), args)
    except FAILURES as error:
        print(f"{p.prog}: {reason(error)}", file=sys.stderr)
        return 1
    finally:
        ranks.leave()
    if args.json:
        found = {"result": str(args.result), "step": trainer.step, "finished": trainer.finished}
        print_document(p.prog, found | files(trainer.folder.preview))
    elif trainer.finished:
        print(f"{args.result}: done; look at {trainer.folder.preview}")
    return 0 if trainer.finished else INTERRUPTED


def train(request: Request, args: argparse.Namespace) -> Trainer:
    """Train to the end or to Ctrl-C; what happens meanwhile is told on standard error."""
    use_cuda = args.device != "cpu" and torch.cuda.is_available()
    trainer = make_trainer(request, args.result, use_cuda, args.compile)
    if trainer.finished:
        say(f"{args.result}: already trained to the end")
        return trainer
    if trainer.step:
        say(f"{args.result}: resuming at step {trainer.step}")
    say(f"{args.result}: training on {trainer.device}; Ctrl-C saves and stops")
    if trainer.phases:
        say(
            f"{args.result}: after the steps the fractions of phases are held, which takes one core"
            " up to about four minutes more: slices are drawn, and the more they differ, the more"
        )
    run_in_terminal(trainer)
    if trainer.finished:
        if trainer.fraction_error is not None:
            say(f"{args.result}: fractions held, standard error {trainer.fraction_error:.1%}")
        say(f"next: solidtex-export {args.result} -o {args.result.name}.solidtex")
    else:
        before = ", before its fractions were held" if trainer.progress >= 1 else ""
        say(f"{args.result}: stopped at step {trainer.step}{before}; the same command resumes")
    return trainer


if __name__ == "__main__":
    sys.exit(main())
