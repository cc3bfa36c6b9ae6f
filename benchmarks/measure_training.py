"""Measures the cost of training: peak memory and seconds per step, by preset and slice size."""

from __future__ import annotations

import argparse
import contextlib
import io
import multiprocessing
import resource
import sys
import tempfile
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass

import numpy as np
import torch
from PIL import Image

from solidtex_export.analysis.choice import LATTICE
from solidtex_export.commands import cli
from solidtex_export.commands.train import make_trainer
from solidtex_export.commands.train_options import parser as train_parser
from solidtex_export.commands.train_options import request_of
from solidtex_export.training.presets import shipped

PROGRAM = "measure_training.py"
MIB = 1 << 20

EXAMPLES = f"""  {PROGRAM} --size 128 256
  {PROGRAM} --preset gutierrez gramgan --size 96 --threads 2
  {PROGRAM} --size 512 1024 --steps 2 --device cuda
Losses that join later are on in the second half of the steps. Memory is what the whole process held
at most (on CUDA what torch did on the device); "start" is the same before the first step. Seconds
are those that the processor spent, all threads together (on CUDA those that passed)."""


@dataclass(frozen=True)
class Case:
    """One training to measure."""

    preset: str
    size: int
    steps: int
    threads: int
    device: str
    compile: bool


@dataclass(frozen=True)
class Cost:
    """Memory in MiB before the first step and at most, and the median seconds of a step."""

    start: float
    peak: float
    seconds: float


def main(arguments: list[str] | None = None) -> int:
    return cli.run(make_parser(), arguments, measure_all)


def make_parser() -> argparse.ArgumentParser:
    p = cli.parser(PROGRAM, __doc__ or "", EXAMPLES, has_json=False)
    p.add_argument("--preset", "--method", nargs="+", choices=shipped(), default=[LATTICE])
    p.add_argument("--size", nargs="+", type=int, default=[128], help="side of the slices")
    p.add_argument("--steps", type=int, default=6, help="of each training (default: 6)")
    p.add_argument("--threads", type=int, default=1, help="CPU threads (default: 1)")
    p.add_argument("--device", choices=("cpu", "cuda"), default="cpu")
    p.add_argument("--compile", action="store_true", help="with torch.compile")
    return p


def measure_all(args: argparse.Namespace) -> None:
    print(f"{'preset':16} {'size':>5} {'start MiB':>10} {'peak MiB':>9} {'s / step':>9}")
    context = multiprocessing.get_context("spawn")  # a process each: peaks do not add up
    for preset in args.preset:
        for size in args.size:
            case = Case(preset, size, args.steps, args.threads, args.device, args.compile)
            with ProcessPoolExecutor(1, context) as pool:  # whose result may be a refusal
                cost = pool.submit(measure, case).result()
            row = f"{cost.start:10.0f} {cost.peak:9.0f} {cost.seconds:9.2f}"
            print(f"{preset:16} {size:5} {row}", flush=True)


def measure(case: Case) -> Cost:
    torch.set_num_threads(case.threads)
    with tempfile.TemporaryDirectory() as folder:
        side = case.size + case.size // 2
        pixels = np.random.default_rng(0).integers(0, 256, (side, side, 3), np.uint8)
        Image.fromarray(pixels).save(f"{folder}/noise.png")
        command = [f"{folder}/noise.png", "-o", f"{folder}/result", "--preset", case.preset]
        command += ["--size", str(case.size), "--steps", str(case.steps), "--device", case.device]
        p = train_parser()
        args = p.parse_args(command)
        clock = time.perf_counter if case.device == "cuda" else time.process_time
        request = request_of(p, args)
        with contextlib.redirect_stderr(io.StringIO()):
            trainer = make_trainer(request, args.result, case.device != "cpu", case.compile)
            start, times = memory(case.device), [clock()]
            # One step short: the end of a training also makes a preview.
            trainer.run(lambda: trainer.step == case.steps - 1, lambda t: times.append(clock()))
        return Cost(start, memory(case.device), float(np.median(np.diff(times))))


def memory(device: str) -> float:
    """Peak memory so far, in MiB."""
    if device == "cuda":
        return torch.cuda.max_memory_allocated() / MIB
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


if __name__ == "__main__":
    sys.exit(main())
