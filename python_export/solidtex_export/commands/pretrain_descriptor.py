"""solidtex-pretrain-descriptor: trains a descriptor for solidtex-train --descriptor."""

from __future__ import annotations

import argparse
import hashlib
import sys
from pathlib import Path

import torch

from solidtex_export.commands import cli
from solidtex_export.commands.terminal import run_in_terminal
from solidtex_export.images.file_kinds import ExemplarError
from solidtex_export.losses.descriptor.network import DescriptorNetwork
from solidtex_export.networks.squeezenet import load_squeezenet
from solidtex_export.networks.weights import WeightsError
from solidtex_export.research.descriptor.contrast import Contrast
from solidtex_export.research.descriptor.distil import SIDE, Distillation
from solidtex_export.research.descriptor.pretrain import PretrainConfig, Pretrainer, Task
from solidtex_export.spaces.photographs import find_sources, load_materials
from solidtex_export.training.result import ResultError, ResultFolder

INTERRUPTED = 130

RESOLUTION, SCALES = 512, (1.0, 0.6, 0.4)  # of photographs
EXAMPLES = """  solidtex-pretrain-descriptor -o results/descriptor
  solidtex-pretrain-descriptor --features squeezenet.safetensors --photos photographs/train \\
      --steps 4000 -o results/distilled

The same command again resumes an interrupted training. Ctrl-C saves before it stops.
solidtex-train --descriptor reads RESULT/weights.safetensors. The same steps, seed and threads give
the same weights on the same machine."""


def parser() -> argparse.ArgumentParser:
    p = cli.parser(
        "solidtex-pretrain-descriptor",
        "Train the descriptor network: to tell procedural textures apart, or with --features to"
        " predict what SqueezeNet sees in photographs.",
        EXAMPLES,
    )
    p.add_argument("-o", dest="result", metavar="RESULT", required=True, type=Path,
                   help="result folder, new or of the same training")  # fmt: skip
    p.add_argument(
        "--steps", type=int, default=800, metavar="N", help="number of steps (default: 800)"
    )
    p.add_argument("--features", metavar="FILE", type=Path,
                   help="weights of SqueezeNet, the teacher; with --photos")  # fmt: skip
    p.add_argument("--photos", metavar="PHOTO", nargs="+", type=Path, default=[],
                   help="photographs, folders of them, or CSV files with the columns file and"
                   " licence")  # fmt: skip
    p.add_argument("--folder", metavar="DIR", type=Path,
                   help="folder of the files in a CSV (default: that of the CSV)")  # fmt: skip
    p.add_argument("--seed", type=int, default=0, metavar="S", help="random seed (default: 0)")
    p.add_argument("--threads", type=int, default=1, metavar="T", help="CPU threads (default: 1)")
    return p


def check(p: argparse.ArgumentParser, args: argparse.Namespace) -> None:
    for name, low in (("steps", 1), ("seed", 0), ("threads", 1)):
        if (value := getattr(args, name)) < low:
            p.error(f"--{name}: found {value}, expected at least {low}")
    if bool(args.features) != bool(args.photos):
        p.error("--features: expected together with --photos")


def make_pretrainer(args: argparse.Namespace) -> Pretrainer:
    folder = ResultFolder(args.result, "solidtex-pretrain-descriptor")
    materials = load_materials(find_sources(args.photos, args.folder), RESOLUTION, SIDE,
                               "photograph", SCALES) if args.photos else []  # fmt: skip
    teacher = load_squeezenet(args.features) if args.features else None
    digest = hashlib.sha256(args.features.read_bytes()).hexdigest() if args.features else ""
    config = PretrainConfig(args.steps, args.seed, digest, tuple(m.record() for m in materials))
    folder.open(config, [])

    def task(seed: int, network: DescriptorNetwork) -> Task:
        if teacher is None:
            return Contrast(seed, network)
        cli.say(f"{args.result}: measuring features of {len(materials)} photographs")
        return Distillation(seed, network, teacher, [m.image for m in materials])

    pretrainer = Pretrainer(config, folder, task)
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
    except (ResultError, ExemplarError, WeightsError, OSError) as error:
        print(f"{p.prog}: {error}", file=sys.stderr)
        return 1
    finished = pretrainer.progress >= 1
    measures = pretrainer.task.measures() if finished else {}
    if args.json:
        found = {"result": str(args.result), "step": pretrainer.step, "finished": finished}
        cli.print_document(
            p.prog,
            found | {"accuracies": measures} | cli.files(args.result / "weights.safetensors"),
        )
    elif finished:
        print(f"{args.result}: done; {pretrainer.task.measured}:")
        for name, share in measures.items():
            print(f"  {name:12} {share:.1%}")
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
