"""Measures bakes beside the usual ways to the same files, in one run.

loop        a Zarr store, and PyTorch with zarr-python in a loop over blocks. The loop evaluates the
            exported network with the neighborhood that a block needs, and writes each block as a
            shard. It makes no levels of detail, draws its noise anew, so that neighboring blocks do
            not fit, and is not held to write whole files: its time is a lower bound.
slices      PNG images of all slices, and one file that oiiotool or ffmpeg splits into images.
library     a Zarr store, and the case lattice.256 of solidtex-bench, which writes nothing.
processes   a Zarr store by one process, and by two with --shard at the same time.
"""

from __future__ import annotations

import argparse
import itertools
import os
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import torch
import zarr
from onnx import ModelProto
from solidtex_side import DEFAULT_PROGRAM, REPOSITORY, run_case
from torch_graph import TorchGraph
from zarr.codecs import BloscCodec, Crc32cCodec

from solidtex_export.commands import cli
from solidtex_export.export.file_format import model_file
from solidtex_export.export.onnx.model import onnx_model
from solidtex_export.generators.lattice import Box

PROGRAM = "volume_bake.py"
EXAMPLES = f"""  {PROGRAM}
  {PROGRAM} loop --size 512 --rounds 3 --folder /scratch
  {PROGRAM} library --threads 1 --rounds 3"""

Candidates = dict[str, Callable[[Path], None]]


def main(arguments: list[str] | None = None) -> int:
    return cli.run(make_parser(), arguments, measure)


def make_parser() -> argparse.ArgumentParser:
    p = cli.parser(PROGRAM, (__doc__ or "").splitlines()[0], EXAMPLES, has_json=False)
    p.add_argument("against", nargs="?", default="loop", choices=sorted(COMPARISONS),
                   help="what to compare with (default loop)")  # fmt: skip
    p.add_argument("--model", default="granite-grey", help="shipped lattice model")
    p.add_argument("--size", type=int, default=256, help="voxels along each axis (default 256)")
    p.add_argument("--block", type=int, default=128, help="of the alternative (default 128)")
    p.add_argument("--rounds", type=int, default=1, help="turns of each (default 1)")
    p.add_argument("--threads", type=int, default=len(os.sched_getaffinity(0)),
                   help="threads of each (default: all cores)")  # fmt: skip
    p.add_argument("--bake", type=Path, default=DEFAULT_PROGRAM.with_name("solidtex-bake"),
                   help="solidtex-bake")  # fmt: skip
    p.add_argument("--folder", type=Path, help="for the stores (default: a temporary one)")
    return p


def measure(args: argparse.Namespace) -> None:
    candidates = COMPARISONS[args.against](args)
    seconds: dict[str, list[float]] = {name: [] for name in candidates}
    processor: dict[str, list[float]] = {name: [] for name in candidates}
    for _ in range(args.rounds):
        for name, run in candidates.items():
            with tempfile.TemporaryDirectory(dir=args.folder) as folder:
                before, start = processor_seconds(), time.perf_counter()
                run(Path(folder))
                seconds[name].append(time.perf_counter() - start)
                processor[name].append(processor_seconds() - before)
    print(f"{args.model}, {args.size}^3 voxels, {args.threads} threads, best of {args.rounds}")
    for name in candidates:
        report(name, args.size**3, min(seconds[name]), min(processor[name]))
    ours, *others = candidates
    for other in others:
        print(f"ratio: {min(seconds[other]) / min(seconds[ours]):.1f}, "
              f"of processors {min(processor[other]) / min(processor[ours]):.2f}")  # fmt: skip
    if args.against == "library":
        report_library(args, min(processor[ours]))


def report(name: str, voxels: int, wall: float, processor: float) -> None:
    rate = voxels / wall / 1e6
    print(f"{name:24} {wall:8.2f} s {rate:8.2f} Mvoxel/s {processor:8.2f} s of processors")


def report_library(args: argparse.Namespace, ours: float) -> None:
    options = ["--clock", "cpu", "--rounds", str(args.rounds), "--lattice-model", args.model]
    result = run_case(args.bake.with_name("solidtex-bench"), "lattice.256", args.threads, options)
    theirs = result.seconds_per_unit * args.threads * args.size**3
    print(f"lattice.256 takes {theirs:.2f} s of processors for as many voxels, "
          f"{theirs / ours:.2f} of the bake")  # fmt: skip


def processor_seconds() -> float:
    """Of this process and of all that it has waited for."""
    usages = map(resource.getrusage, (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return sum(usage.ru_utime + usage.ru_stime for usage in usages)


def bake_command(args: argparse.Namespace, output: Path, *options: object) -> list[str]:
    size = ["--size", args.size, "--threads", args.threads]
    return list(map(str, [args.bake, args.model, *size, "-o", output, *options]))


def run(*command: object) -> None:
    subprocess.run(list(map(str, command)), check=True, capture_output=True)


def bake(args: argparse.Namespace, output: Path, *options: object) -> None:
    run(*bake_command(args, output, *options))


def against_loop(args: argparse.Namespace) -> Candidates:
    if args.size < args.block or args.size % args.block:
        raise SystemExit(f"{PROGRAM}: --size: found {args.size}, expected whole blocks")
    model = model_file.read(REPOSITORY / "models" / f"{args.model}.solidtex")
    network = onnx_model(model, Box((0,) * 3, (args.block,) * 3))
    return {
        "solidtex-bake": lambda folder: bake(args, folder / "a.zarr"),
        "PyTorch + zarr-python": lambda folder: loop(args, network, folder / "a.zarr"),
    }


def against_slices(args: argparse.Namespace) -> Candidates:
    def oiiotool(folder: Path) -> None:
        bake(args, folder / "a.tif", "--depth", 8)
        run("oiiotool", folder / "a.tif", "--sisplit", "-o:all=1", folder / "%04d.png")
        expect_slices(args, folder)

    def ffmpeg(folder: Path) -> None:
        bake(args, folder / "a.raw", "--depth", 8)
        layout = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{args.size}x{args.size}"]
        run("ffmpeg", *layout, "-i", folder / "a.raw", folder / "%04d.png")
        expect_slices(args, folder)

    ours = {"solidtex-bake": lambda folder: bake(args, folder / "slices", "--slices", "png")}
    others: Candidates = {".tif + oiiotool": oiiotool, ".raw + ffmpeg": ffmpeg}
    found = {name: run for name, run in others.items() if shutil.which(name.split()[-1])}
    if not found:
        raise SystemExit(f"{PROGRAM} slices: found neither oiiotool nor ffmpeg")
    return ours | found


def expect_slices(args: argparse.Namespace, folder: Path) -> None:
    count = len(list(folder.glob("*.png")))
    if count != args.size:
        raise SystemExit(f"{PROGRAM}: found {count} slices, expected {args.size}")


def against_library(args: argparse.Namespace) -> Candidates:
    return {"solidtex-bake": lambda folder: bake(args, folder / "a.zarr")}


def against_processes(args: argparse.Namespace) -> Candidates:
    def both(folder: Path) -> None:
        parts = [bake_command(args, folder / "a.zarr", "--shard", f"{i}/2") for i in (1, 2)]
        running = [
            subprocess.Popen(part, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            for part in parts
        ]
        if any([process.wait() for process in running]):
            raise SystemExit(f"{PROGRAM}: a part failed")

    return {"1 process": lambda folder: bake(args, folder / "a.zarr"), "2 processes": both}


COMPARISONS: dict[str, Callable[[argparse.Namespace], Candidates]] = {
    "loop": against_loop,
    "slices": against_slices,
    "library": against_library,
    "processes": against_processes,
}


def loop(args: argparse.Namespace, network: ModelProto, store: Path) -> None:
    """What one would write with PyTorch and zarr-python, in the faster memory layout."""
    torch.set_num_threads(args.threads)
    layout = torch.channels_last_3d
    graph = TorchGraph(network, layout)
    shapes = {
        value.name: [d.dim_value for d in value.type.tensor_type.shape.dim]
        for value in network.graph.input
    }
    channels = network.graph.output[0].type.tensor_type.shape.dim[1].dim_value
    array = zarr.create_array(
        store,
        shape=(channels, *[args.size] * 3),
        dtype="float32",
        chunks=(1, 64, 64, 64) if args.block % 64 == 0 else (1, *[args.block] * 3),
        shards=(channels, *[args.block] * 3),
        compressors=[
            BloscCodec(typesize=4, cname="lz4", clevel=5, shuffle="bitshuffle"),
            Crc32cCodec(),
        ],
    )
    for corner in itertools.product(range(0, args.size, args.block), repeat=3):
        noise = {
            name: torch.rand(shape).to(memory_format=layout)
            if len(shape) == 5
            else torch.rand(shape)
            for name, shape in shapes.items()
        }
        values = graph(noise)[0].permute(0, 3, 2, 1)
        z, y, x = (slice(first, first + args.block) for first in corner)
        array[:, z, y, x] = values.contiguous().numpy()


if __name__ == "__main__":
    sys.exit(main())
