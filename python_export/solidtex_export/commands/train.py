"""solidtex-train: from one to three photographs to a training result."""

from __future__ import annotations

import argparse
import signal
import sys
from types import FrameType

import torch
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn

from solidtex_export.commands.train_options import check, parser
from solidtex_export.training.config import RECIPES, Config, exemplar_records
from solidtex_export.training.exemplar import check_alike, load_exemplar
from solidtex_export.training.pictures import ExemplarError
from solidtex_export.training.result import ResultError, ResultFolder
from solidtex_export.training.trainer import Trainer, TrainError

GENERATORS = {
    "field": {"levels": 6, "noise_channels": 3, "step_channels": 4},
    "sampler": {"octaves": 16, "hidden_layers": 5, "width": 128, "coarsest": 48.0, "finest": 1.0},
}
INTERRUPTED = 130


def make_trainer(args: argparse.Namespace) -> Trainer:
    exemplars = [
        load_exemplar(path, args.resolution, args.size, args.crop, maps, args.color_space)
        for path, maps in zip(args.photos, args.maps, strict=True)
    ]
    check_alike(exemplars)
    channels = exemplars[0].channels
    config = Config(
        family=args.model,
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
        generator=GENERATORS[args.model] | {"out_channels": len(channels)},
        recipe=RECIPES[args.model],
    )
    folder = ResultFolder(args.result)
    folder.open(config, exemplars)
    use_cuda = args.device != "cpu" and torch.cuda.is_available()
    trainer = Trainer(config, exemplars, torch.device("cuda" if use_cuda else "cpu"), folder)
    state = folder.load_checkpoint()
    if state is not None:
        try:
            trainer.restore(state)
        except (KeyError, TypeError, ValueError, RuntimeError) as error:
            raise ResultError(
                f"{folder.checkpoint}: found a checkpoint that does not fit config.json ({error});"
                " delete it to start over"
            ) from error
    return trainer


def train(trainer: Trainer) -> bool:
    """Train with a progress bar; true when the end was reached, false when interrupted."""
    interrupted = False

    def interrupt(_signal: int, _frame: FrameType | None) -> None:
        nonlocal interrupted
        interrupted = True

    previous = signal.signal(signal.SIGINT, interrupt)
    columns = (TextColumn("{task.description}"), BarColumn(), TaskProgressColumn())
    try:
        with Progress(*columns) as bar:
            task = bar.add_task("training", total=1.0)

            def report(t: Trainer) -> None:
                bar.update(task, completed=t.progress, description=describe(t))

            trainer.run(lambda: interrupted, report)
    finally:
        signal.signal(signal.SIGINT, previous)
    return trainer.finished


def describe(trainer: Trainer) -> str:
    left = max(0.0, trainer.seconds / max(trainer.progress, 1e-9) - trainer.seconds)
    return f"step {trainer.step}, {left / 60:.1f} min left"


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
        finished = train(trainer)
    except (ExemplarError, ResultError, TrainError, OSError) as error:
        print(f"solidtex-train: {error}", file=sys.stderr)
        return 1
    if not finished:
        print(f"{args.result}: stopped at step {trainer.step}; the same command resumes")
        return INTERRUPTED
    print(f"{args.result}: done; look at {trainer.folder.preview}")
    print(f"next: solidtex-export {args.result} -o {args.result.name}.solidtex")
    return 0


if __name__ == "__main__":
    sys.exit(main())
