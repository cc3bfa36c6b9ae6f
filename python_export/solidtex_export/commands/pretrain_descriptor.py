"""solidtex-pretrain-descriptor: trains a descriptor for solidtex-train --descriptor."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import torch

from solidtex_export.commands import cli
from solidtex_export.commands.terminal import run_in_terminal
from solidtex_export.research.descriptor.pretrain import PretrainConfig, Pretrainer
from solidtex_export.training.result import ResultError, ResultFolder

INTERRUPTED = 130

EXAMPLES = """  solidtex-pretrain-descriptor -o results/descriptor
  solidtex-pretrain-descriptor --steps 200 --threads 2 -o results/short

The same command again resumes an interrupted training. Ctrl-C saves before it stops.
solidtex-train --descriptor reads RESULT/weights.safetensors. The first example makes the shipped
weights. The same steps, seed and threads give the same weights on the same machine."""


def parser() -> argparse.ArgumentParser:
    p = cli.parser(
        "solidtex-pretrain-descriptor",
        "Train the descriptor network on procedural textures, without any photograph.",
        EXAMPLES,
    )
    p.add_argument("-o", dest="result", metavar="RESULT", required=True, type=Path,
                   help="result folder, new or of the same training")  # fmt: skip
    p.add_argument(
        "--steps", type=int, default=800, metavar="N", help="number of steps (default: 800)"
    )
    p.add_argument("--seed", type=int, default=0, metavar="S", help="random seed (default: 0)")
    p.add_argument("--threads", type=int, default=1, metavar="T", help="CPU threads (default: 1)")
    return p


def check(p: argparse.ArgumentParser, args: argparse.Namespace) -> None:
    for name, low in (("steps", 1), ("seed", 0), ("threads", 1)):
        if (value := getattr(args, name)) < low:
            p.error(f"--{name}: found {value}, expected at least {low}")


def make_pretrainer(args: argparse.Namespace) -> Pretrainer:
    folder = ResultFolder(args.result, "solidtex-pretrain-descriptor")
    config = PretrainConfig(args.steps, args.seed)
    folder.open(config, [])
    pretrainer = Pretrainer(config, folder)
    folder.resume(pretrainer.restore)
    return pretrainer


def main(arguments: list[str] | None = None) -> int:
    p = parser()
    args = p.parse_args(arguments)
    check(p, args)
    torch.set_num_threads(args.threads)
    try:
        with cli.without_remarks(args.quiet):
            pretrainer = pretrain(args)
    except (ResultError, OSError) as error:
        print(f"{p.prog}: {error}", file=sys.stderr)
        return 1
    finished = pretrainer.progress >= 1
    accuracies = pretrainer.accuracies() if finished else {}
    if args.json:
        found = {"result": str(args.result), "step": pretrainer.step, "finished": finished}
        cli.print_document(
            p.prog,
            found | {"accuracies": accuracies} | cli.files(args.result / "weights.safetensors"),
        )
    elif finished:
        print(
            f"{args.result}: done; held-out crops whose most similar crop shows the same texture:"
        )
        for name, share in accuracies.items():
            print(f"  {name:8} {share:.1%}")
    return 0 if finished else INTERRUPTED


def pretrain(args: argparse.Namespace) -> Pretrainer:
    """Train to the end or to Ctrl-C."""
    pretrainer = make_pretrainer(args)
    if pretrainer.step:
        cli.say(f"{args.result}: resuming at step {pretrainer.step}")
    if pretrainer.progress < 1:
        run_in_terminal(pretrainer)
    if pretrainer.progress < 1:
        cli.say(f"{args.result}: stopped at step {pretrainer.step}; the same command resumes")
    return pretrainer


if __name__ == "__main__":
    sys.exit(main())
