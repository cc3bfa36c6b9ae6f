#!/usr/bin/env python3
"""What Python and Mitsuba 3 cost beside the library itself (docs/hosts/README.md).

Points a texel apart on a tilted plane, whose bricks are there: millions a second of processor time,
the best of several rounds, on one thread. "direct" is one call for all of them into memory that is
there, of which Python's part is some microseconds. From the repository, built:
taskset -c 1 .venv/bin/python benchmarks/measure_hosts.py granite-grey granite-speckled
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Iterator

import numpy as np

import solidtex

EDGE = 256
FEW = 1024  # points that are looked up one by one
ROUNDS = 5


def plane() -> np.ndarray:
    x, y = np.meshgrid(np.arange(EDGE), np.arange(EDGE))
    return np.stack([x, y, 0.3 * x + 0.2 * y], axis=-1).reshape(-1, 3).astype(np.float32)


def rate(count: int, work: Callable[[], object]) -> float:
    """Best rate in millions of points per second; the first round only fills caches."""
    work()
    best = np.inf
    for _ in range(ROUNDS):
        started = time.process_time()
        work()
        best = min(best, time.process_time() - started)
    return count / best / 1e6


def python_rates(model: str) -> Iterator[tuple[str, float]]:
    points = plane()
    with solidtex.Texture(model) as texture:
        out = np.empty((len(points), len(texture.channels)), np.float32)

        def batches(count: int, size: int) -> None:
            for first in range(0, count, size):
                part = slice(first, first + size)
                texture.eval_points(points[part], out=out[part])

        yield "direct", rate(len(points), lambda: texture.eval_points(points, out=out))
        yield "Python, 4096 a call", rate(len(points), lambda: batches(len(points), 4096))
        yield "Python, one a call", rate(FEW, lambda: batches(FEW, 1))


def mitsuba_rates(model: str) -> Iterator[tuple[str, float]]:
    try:
        import drjit as dr
        import mitsuba as mi

        import solidtex.mitsuba  # noqa: F401 (registers the texture)
    except ImportError:
        return
    points = plane()
    description = {"type": "solidtex", "model": model}
    mi.set_variant("scalar_rgb")
    scalar = mi.load_dict(description)
    single = []
    for point in points[:FEW]:
        interaction = mi.SurfaceInteraction3f()
        interaction.p = mi.Point3f(*map(float, point))
        single.append(interaction)
    yield "Mitsuba, scalar_rgb", rate(FEW, lambda: [scalar.eval(each) for each in single])
    mi.set_variant("llvm_ad_rgb")
    texture = mi.load_dict(description)
    many = dr.zeros(mi.SurfaceInteraction3f, len(points))
    many.p = mi.Point3f(points.T)
    dr.eval(many.p)

    def evaluate() -> None:
        dr.eval(texture.eval(many))
        dr.sync_thread()

    yield "Mitsuba, llvm_ad_rgb", rate(len(points), evaluate)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("model", nargs="+", help="a file, or the name of a shipped model")
    for model in parser.parse_args().model:
        rows = [*python_rates(model), *mitsuba_rates(model)]
        direct = rows[0][1]
        print(f"| {model} | million a second | of direct |\n|---|---|---|")
        for name, found in rows:
            print(f"| {name} | {found:.2g} | {found / direct:.2g} |")


if __name__ == "__main__":
    main()
