"""Measures a bake to a Zarr store beside PyTorch and zarr-python in a loop, in one run.

Both take turns in one run. The alternative evaluates the exported network block by block, with the
neighborhood that a block needs, and writes each block as a shard. It makes no levels of detail,
draws its noise anew, so that neighboring blocks do not fit, and is not held to write whole files:
its time is a lower bound.
"""

from __future__ import annotations

import argparse
import itertools
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import torch
import zarr
from onnx import ModelProto
from solidtex_side import DEFAULT_PROGRAM, REPOSITORY
from torch_graph import TorchGraph
from zarr.codecs import BloscCodec, Crc32cCodec

from solidtex_export.commands import cli
from solidtex_export.export.file_format import model_file
from solidtex_export.export.onnx.model import onnx_model
from solidtex_export.generators.lattice import Box

PROGRAM = "volume_bake.py"
EXAMPLES = f"""  {PROGRAM}
  {PROGRAM} --size 512 --rounds 3 --folder /scratch"""


def main(arguments: list[str] | None = None) -> int:
    return cli.run(make_parser(), arguments, measure)


def make_parser() -> argparse.ArgumentParser:
    p = cli.parser(PROGRAM, (__doc__ or "").splitlines()[0], EXAMPLES)
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
    if args.size < args.block or args.size % args.block:
        raise SystemExit(f"{PROGRAM}: --size: found {args.size}, expected whole blocks")
    model = model_file.read(REPOSITORY / "models" / f"{args.model}.solidtex")
    network = onnx_model(model, Box((0,) * 3, (args.block,) * 3))
    candidates: dict[str, Callable[[Path], None]] = {
        "solidtex-bake": lambda store: bake(args, store),
        "PyTorch + zarr-python": lambda store: loop(args, network, store),
    }
    seconds: dict[str, list[float]] = {name: [] for name in candidates}
    processor: dict[str, list[float]] = {name: [] for name in candidates}
    for _ in range(args.rounds):
        for name, run in candidates.items():
            with tempfile.TemporaryDirectory(dir=args.folder) as folder:
                before, start = processor_seconds(), time.perf_counter()
                run(Path(folder) / "a.zarr")
                seconds[name].append(time.perf_counter() - start)
                processor[name].append(processor_seconds() - before)
    print(f"{args.model}, {args.size}^3 voxels, {args.threads} threads, best of {args.rounds}")
    for name in candidates:
        wall, cpu = min(seconds[name]), min(processor[name])
        rate = args.size**3 / wall / 1e6
        print(f"{name:24} {wall:8.2f} s {rate:8.2f} Mvoxel/s {cpu:8.2f} s of processors")
    ours, other = candidates
    print(f"ratio: {min(seconds[other]) / min(seconds[ours]):.1f}, "
          f"of processors {min(processor[other]) / min(processor[ours]):.1f}")  # fmt: skip


def processor_seconds() -> float:
    """Of this process and of all that it has waited for."""
    usages = map(resource.getrusage, (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return sum(usage.ru_utime + usage.ru_stime for usage in usages)


def bake(args: argparse.Namespace, store: Path) -> None:
    command = [args.bake, args.model, "--size", args.size, "--threads", args.threads, "-o", store]
    subprocess.run(list(map(str, command)), check=True, capture_output=True)


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
