"""What solid textures cost a render: by `solidtex-render --stats`, on the processor's clock.

frame: a mesh of a million triangles with a lattice texture beside the same with a constant color,
once the bricks exist: the second of two equal frames. Bricks computed, and needed by what is seen.
points: points a second while the renderer evaluates a texture of the sampler family, in the second
of two equal frames (the first measures once how octaves fade), beside the batches of the benchmark
(solidtex-bench sampler.batch and sampler.coherent).
All take turns, and times are divided by the threads.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import statistics
import subprocess
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from mitsuba_scene import REPOSITORY, scene_file, write_mesh

from solidtex_export.commands import cli

PROGRAM = "measure_renderer.py"
CONSTANT = [0.42, 0.4, 0.38]
EXAMPLES = f"""  {PROGRAM}
  {PROGRAM} frame --size 512 --spp 16 --threads 2
  {PROGRAM} points --sampler-model granite-speckled"""


@dataclass
class Stats:
    """Statistics of one frame: processor seconds, millions of points, bricks since loading the
    scene.
    """

    seconds: dict[str, float]
    points: float
    computed: int
    needed: int

    @property
    def total(self) -> float:
        return sum(self.seconds.values())


def main(arguments: list[str] | None = None) -> int:
    p = cli.parser(PROGRAM, __doc__ or "", EXAMPLES, has_json=False)
    binaries = REPOSITORY / "build" / "bin"
    p.add_argument("measurements", nargs="*", metavar="MEASUREMENT",
                   help="frame, points (default: both)")  # fmt: skip
    p.add_argument("--render", metavar="PROGRAM", type=Path, default=binaries / "solidtex-render",
                   help="solidtex-render (default: that in build/bin)")  # fmt: skip
    p.add_argument("--bench", metavar="PROGRAM", type=Path, default=binaries / "solidtex-bench",
                   help="solidtex-bench (default: that in build/bin)")  # fmt: skip
    p.add_argument("--triangles", type=int, default=1_000_000, help="of the mesh (1000000)")
    p.add_argument("--size", type=int, default=1024, help="width and height in pixels (1024)")
    p.add_argument("--spp", type=int, default=64, help="samples per pixel (64)")
    p.add_argument("--texels", type=float, default=200, help="in a unit; the ball has two (200)")
    p.add_argument("--threads", type=int, default=len(os.sched_getaffinity(0)), help="(all)")
    p.add_argument("--rounds", type=int, default=3, help="how often each takes its turn (3)")
    p.add_argument(
        "--lattice-model", "--field-model", default="granite-grey", help="for frame (granite-grey)"
    )
    p.add_argument("--sampler-model", default="stone-grey", help="for points (stone-grey)")
    p.add_argument("--quick", action="store_true", help="a benchmark that shows only that it runs")
    return cli.run(p, arguments, measure, (*cli.FAILURES, ValueError))


def measure(args: argparse.Namespace) -> None:
    known: dict[str, Callable] = {"frame": measure_frame, "points": measure_points}
    for name in args.measurements:
        if name not in known:
            raise ValueError(f"found the measurement {name}, expected {' or '.join(known)}")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        count = write_mesh(folder / "mesh.ply", args.triangles)
        print(f"{count} triangles, {args.size} x {args.size} pixels, {args.spp} samples each,"
              f" {args.threads} threads, processor clock")  # fmt: skip
        for measurement in args.measurements or known:
            known[measurement](args, folder)


def measure_frame(args: argparse.Namespace, folder: Path) -> None:
    texture = {"solid": args.lattice_model, "texels_per_unit": args.texels}
    colors = {"lattice texture": texture, "constant color": CONSTANT}
    rounds: dict[str, list[list[Stats]]] = {name: [] for name in colors}
    for _ in range(args.rounds):
        for name, color in colors.items():
            rounds[name].append(render(args, folder, color, frames=2))
    print(f"\nA frame with {args.lattice_model}, once its bricks exist: seconds")
    for name, renders in rounds.items():
        print_parts(name, [frames[-1] for frames in renders], args.threads)
    pairs = zip(*rounds.values(), strict=True)
    ratios = [textured[-1].total / plain[-1].total for textured, plain in pairs]
    print(f"  the texture takes the time to {spread(ratios)} of that of the color")
    first, last = rounds["lattice texture"][-1]
    print(f"  bricks: {last.computed} computed, {last.needed} needed by what is seen")
    print_extra(first, last, args.threads)


def measure_points(args: argparse.Namespace, folder: Path) -> None:
    texture = {"solid": args.sampler_model, "texels_per_unit": args.texels}
    cases: dict[str, list[float]] = {"sampler.batch": [], "sampler.coherent": []}
    renders: list[list[Stats]] = []
    rates = []
    # Helpers of a query are counted under "other".
    helped = ("textures", "other") if args.threads > 1 else ("textures",)
    for _ in range(args.rounds):
        renders.append(render(args, folder, texture, frames=2))
        last = renders[-1][-1]
        rates.append(last.points * args.threads / sum(last.seconds[part] for part in helped))
        for name, values in cases.items():
            values.append(benchmark(args, folder, name))
    print(f"\nPoints of {args.sampler_model}: million a second")
    print(f"  while rendering    {statistics.median(rates):7.3f}")
    for name, values in cases.items():
        ratios = [rate / value for rate, value in zip(rates, values, strict=True)]
        print(f"  {name:18} {statistics.median(values):7.3f}  rendering is {spread(ratios)} of it")
    print("Seconds of the frame")
    print_parts(args.sampler_model, [frames[-1] for frames in renders], args.threads)
    print_extra(*renders[-1], args.threads)


def render(args: argparse.Namespace, folder: Path, color: object, frames: int = 1) -> list[Stats]:
    scene = scene_file(folder, color, frames=frames)
    options = ["--size", f"{args.size},{args.size}", "--spp", str(args.spp), "--quiet", "--stats"]
    options += ["--threads", str(args.threads), "--force"]
    command = [str(args.render), str(scene), *options, "-o", str(folder / "frame#.exr")]
    return parse_stats(run(command))


def parse_stats(text: str) -> list[Stats]:
    """Parse the output of --stats, frame by frame."""
    found = []
    for frame in text.split("rendering: ")[1:]:
        parts = re.findall(r"^  (intersection|textures|shading|other) +(-?[\d.]+) s", frame, re.M)
        points = re.search(r"^texture points: ([\d.]+) million", frame, re.M)
        bricks = re.search(r"^bricks: (\d+) computed, (\d+) needed", frame, re.M)
        if len(parts) != 4 or not points or not bricks:
            raise ValueError(f"found other statistics than expected:\n{frame}")
        seconds = {name: float(value) for name, value in parts}
        found.append(Stats(seconds, float(points[1]), int(bricks[1]), int(bricks[2])))
    return found


def benchmark(args: argparse.Namespace, folder: Path, case: str) -> float:
    """Median rate in millions of points per second, since a render is a mean of many calls."""
    report = folder / "bench.json"
    command = [str(args.bench), case, "--clock", "cpu", "--threads", str(args.threads)]
    command += ["--sampler-model", args.sampler_model, "--seconds", "2"]
    command += ["--json", str(report), "--force"] + (["--quick"] if args.quick else [])
    run(command)
    runs = [r for r in json.loads(report.read_text())["benchmarks"] if r["run_type"] == "iteration"]
    nanoseconds = statistics.median(r["real_time"] for r in runs)
    return runs[0]["units_per_call"] / nanoseconds * 1e3


def run(command: list[str]) -> str:
    result = subprocess.run(command, capture_output=True, text=True)
    if result.returncode != 0:
        raise ValueError(f"{Path(command[0]).name} failed: {result.stderr.strip()}")
    return result.stdout


def print_parts(name: str, frames: list[Stats], threads: int) -> None:
    parts = "  ".join(
        f"{part} {statistics.median(f.seconds[part] for f in frames) / threads:.2f}"
        for part in frames[0].seconds
    )
    total = statistics.median(frame.total for frame in frames) / threads
    print(f"  {name:16} {total:8.2f}  ({parts})")


def print_extra(first: Stats, last: Stats, threads: int) -> None:
    print(f"  the first frame took {(first.total - last.total) / threads:.2f} s more")


def spread(values: list[float]) -> str:
    return f"{statistics.median(values):.3f} ({min(values):.3f} to {max(values):.3f})"


if __name__ == "__main__":
    raise SystemExit(main())
