"""Measures solidtex-render beside Mitsuba 3: one scene, equal depth and threads, in turn.

A diffuse mesh of a million triangles with a bitmap texture under an environment image. Rates are
samples a second of the wall's clock or of the processor's, which other programs disturb less.
"""

from __future__ import annotations

import argparse
import os
import re
import statistics
import subprocess
import tempfile
import time
from pathlib import Path

from mitsuba_scene import REPOSITORY, mitsuba_scene, scene_file, write_image, write_mesh

from solidtex_export.commands import cli

PROGRAM = "compare_mitsuba.py"
VARIANTS = ("scalar_rgb", "llvm_ad_rgb")
OURS = "solidtex"
EXAMPLES = f"""  {PROGRAM}
  {PROGRAM} --threads 2 --rounds 5 --clock wall"""


def main(arguments: list[str] | None = None) -> int:
    p = cli.parser(PROGRAM, __doc__ or "", EXAMPLES, has_json=False)
    p.add_argument("--render", metavar="PROGRAM", type=Path,
                   default=REPOSITORY / "build" / "bin" / "solidtex-render",
                   help="solidtex-render (default: that in build/bin)")  # fmt: skip
    p.add_argument("--triangles", type=int, default=1_000_000, help="of the mesh")
    p.add_argument("--size", type=int, default=512, help="width and height in pixels (512)")
    p.add_argument("--spp", type=int, default=16, help="samples per pixel (16)")
    p.add_argument("--threads", type=int, default=len(os.sched_getaffinity(0)), help="(all)")
    p.add_argument("--rounds", type=int, default=3, help="how often each takes its turn (3)")
    p.add_argument("--clock", choices=("wall", "cpu"), default="cpu",
                   help="cpu: processor time over threads (default)")  # fmt: skip
    return cli.run(p, arguments, compare)


def compare(args: argparse.Namespace) -> None:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        count = write_mesh(folder / "mesh.ply", args.triangles)
        write_image(folder / "image.png")
        runs = {OURS: solidtex_runner(args, folder)}
        with cli.optional_packages(PROGRAM, "test"):
            runs |= {variant: mitsuba_runner(args, folder, variant) for variant in VARIANTS}
        print(f"{count} triangles, {args.size} x {args.size} pixels, {args.spp} samples each")
        rates: dict[str, list[float]] = {name: [] for name in runs}
        for _ in range(args.rounds):
            for name, run in runs.items():
                rates[name].append(run() * 1e-6)
        report(rates, args)


def report(rates: dict[str, list[float]], args: argparse.Namespace) -> None:
    print(f"million samples a second, {args.threads} threads, {args.clock} clock")
    for name, values in rates.items():
        rounds = "  ".join(f"{value:.2f}" for value in values)
        ratios = [ours / other for ours, other in zip(rates[OURS], values, strict=True)]
        print(
            f"  {name:12} median {statistics.median(values):6.2f}   {OURS} is"
            f" {statistics.median(ratios):5.2f} times as fast   rounds: {rounds}"
        )


def solidtex_runner(args: argparse.Namespace, folder: Path):
    scene = scene_file(folder, {"image": "image.png"})
    options = ["--size", f"{args.size},{args.size}", "--spp", str(args.spp), "--quiet", "--stats"]
    options += ["--threads", str(args.threads), "--force", "-o", str(folder / "image.exr")]

    def run() -> float:
        command = [str(args.render), str(scene), *options]
        text = subprocess.run(command, check=True, capture_output=True, text=True).stdout
        if args.clock == "wall":
            parts = re.findall(r"rendering: ([\d.]+) s", text)
        else:  # without building the scene, which Mitsuba has done when it starts
            parts = re.findall(r"(?:intersection|textures|shading) +([\d.]+) s", text)
        assert parts, text
        seconds = sum(map(float, parts)) / (1 if args.clock == "wall" else args.threads)
        return args.size**2 * args.spp / seconds

    return run


def mitsuba_runner(args: argparse.Namespace, folder: Path, variant: str):
    import drjit
    import mitsuba

    mitsuba.set_variant(variant)
    # Loading hands its work to the helpers of its thread: with one thread alone it never ends.
    drjit.set_thread_count(max(2, args.threads))
    scene = mitsuba_scene(mitsuba, folder, args.size, args.spp)
    clock = time.perf_counter if args.clock == "wall" else time.process_time
    parts = 1 if args.clock == "wall" else args.threads
    seed = 0

    def run() -> float:
        nonlocal seed
        mitsuba.set_variant(variant)
        drjit.set_thread_count(args.threads)
        seed += 1
        start = clock()
        image = mitsuba.render(scene, seed=seed, spp=args.spp)
        drjit.eval(image)
        drjit.sync_thread()
        return args.size**2 * args.spp / ((clock() - start) / parts)

    run()  # compiles its kernels
    return run


if __name__ == "__main__":
    raise SystemExit(main())
