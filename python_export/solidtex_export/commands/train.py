"""solidtex-train: from one to three photographs to a training result."""

from __future__ import annotations

import argparse
import signal
import sys
from pathlib import Path
from types import FrameType

import torch
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn

from solidtex_export import cli
from solidtex_export.losses.critic import FIELD_OF_VIEW
from solidtex_export.training.config import RECIPES, Config, exemplar_records
from solidtex_export.training.exemplar import ExemplarError, load_exemplar
from solidtex_export.training.result import ResultError, ResultFolder
from solidtex_export.training.trainer import Trainer, TrainError

GENERATORS = {
    "field": {"levels": 6, "noise_channels": 3, "step_channels": 4},
    "sampler": {"octaves": 16, "hidden_layers": 5, "width": 128, "coarsest": 48.0, "finest": 1.0},
}
DEFAULT_MINUTES = 15.0
INTERRUPTED = 130

EXAMPLES = """  solidtex-train granite.jpg -o results/granite
  solidtex-train plank.png --model sampler --directions xy -o results/plank
  solidtex-train wall.jpg --crop 0,200,1500,1500 --resolution 256 --minutes 30 -o results/wall
  solidtex-train front.png side.png top.png -o results/cube

The same command again resumes an interrupted training. Ctrl-C saves before it stops.
One photograph serves all directions; two or three are compared with one direction each, in order.
A slice normal to x shows y to the right and z upwards, normal to y: x and z, normal to z: x and y.
So for wood use --directions xy and a photograph with vertical grain: the grain runs along z.
Then: solidtex-export RESULT -o MODEL.solidtex"""


def parser() -> argparse.ArgumentParser:
    p = cli.parser(
        "solidtex-train", "Learn a solid texture from one, two or three photographs.", EXAMPLES
    )
    p.add_argument("photos", metavar="PHOTO", nargs="+", type=Path, help="one to three pictures")
    p.add_argument("-o", dest="result", metavar="RESULT", required=True, type=Path,
                   help="result folder, new or of the same training")  # fmt: skip
    p.add_argument("--model", choices=sorted(GENERATORS), default="field",
                   help="field: 3D convolutions on a lattice; sampler: a network evaluated at any"
                   " point (default: field)")  # fmt: skip
    p.add_argument("--size", type=int, default=96, metavar="N",
                   help="side of the slices compared with the photograph, in texels"
                   " (default: 96)")  # fmt: skip
    p.add_argument("--resolution", type=int, metavar="N",
                   help="reduce photographs whose shorter side is longer than N pixels; one pixel"
                   " is then one texel (default: 1.5 times --size)")  # fmt: skip
    p.add_argument("--crop", type=rectangle, metavar="X,Y,W,H",
                   help="use only this rectangle of each photograph, in its pixels")  # fmt: skip
    p.add_argument("--directions", choices=("xyz", "xy", "xz", "yz", "x", "y", "z"),
                   help="normals of the slices that must look like a photograph"
                   " (default: xyz, with two photographs xy)")  # fmt: skip
    p.add_argument("--symmetry", choices=("all", "flips", "none"),
                   help="orientations in which a photograph looks just as right (default: all for"
                   " one photograph in three directions, else flips)")  # fmt: skip
    p.add_argument("--minutes", type=float, metavar="M",
                   help="how long to train (default: 15)")  # fmt: skip
    p.add_argument("--steps", type=int, metavar="N", help="train N steps instead of --minutes")
    p.add_argument("--seed", type=int, default=0, metavar="S", help="(default: 0)")
    p.add_argument("--device", choices=("auto", "cpu", "cuda"), default="auto",
                   help="auto takes CUDA where there is one (default: auto)")  # fmt: skip
    p.add_argument("--threads", type=int, metavar="T", help="CPU threads (default: torch's)")
    p.add_argument("--license", default="", metavar="TEXT",
                   help="licence of the photographs, stored with the model")  # fmt: skip
    p.add_argument("--source", default="", metavar="TEXT",
                   help="where the photographs come from, stored with the model")  # fmt: skip
    return p


def rectangle(text: str) -> tuple[int, ...]:
    values = tuple(int(v) for v in text.split(","))
    if len(values) != 4 or min(values[2:]) < 1:
        raise argparse.ArgumentTypeError(f"found {text}, expected X,Y,W,H, for example 0,0,256,256")
    return values


def check(p: argparse.ArgumentParser, args: argparse.Namespace) -> None:
    """Fill in what depends on other options, and refuse what cannot work."""
    if len(args.photos) > 3:
        p.error(f"PHOTO: found {len(args.photos)}, expected 1 to 3")
    if args.directions is None:
        args.directions = "xy" if len(args.photos) == 2 else "xyz"
    if len(args.photos) not in (1, len(args.directions)):
        p.error(
            f"--directions: found {len(args.directions)} ({args.directions}) for"
            f" {len(args.photos)} photographs, expected one direction for each"
        )
    if args.size < FIELD_OF_VIEW:
        p.error(f"--size: found {args.size}, expected at least {FIELD_OF_VIEW}")
    args.resolution = args.resolution or args.size + args.size // 2
    if args.resolution < args.size:
        p.error(f"--resolution: found {args.resolution}, expected at least --size = {args.size}")
    if args.minutes is not None and args.steps is not None:
        p.error("--steps: found together with --minutes, expected one of them")
    if args.minutes is not None and not 0 < args.minutes < 1e6:
        p.error(f"--minutes: found {args.minutes}, expected more than 0")
    if args.steps is not None and args.steps < 1:
        p.error(f"--steps: found {args.steps}, expected at least 1")
    if args.threads is not None and args.threads < 1:
        p.error(f"--threads: found {args.threads}, expected at least 1")
    if args.minutes is None and args.steps is None:
        args.minutes = DEFAULT_MINUTES
    if args.symmetry is None:
        isotropic = len(args.photos) == 1 and args.directions == "xyz"
        args.symmetry = "all" if isotropic else "flips"
    if args.device == "cuda" and not torch.cuda.is_available():
        p.error("--device: found no CUDA device, expected one (or use --device cpu)")


def make_trainer(args: argparse.Namespace) -> Trainer:
    exemplars = [load_exemplar(path, args.resolution, args.size, args.crop) for path in args.photos]
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
        license=args.license,
        source=args.source,
        generator=GENERATORS[args.model],
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
