"""Measures the npm package under Node beside the desktop engine: one run, one thread, in turn."""

from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from solidtex import Texture
from solidtex_export.commands import cli

REPOSITORY = Path(__file__).resolve().parents[1]
PROGRAM = "measure_web.py"
POINTS, EDGE = 1024, 16
MODELS = ("granite-grey", "granite-speckled")
EXAMPLES = f"""  {PROGRAM}
  {PROGRAM} marble --rounds 5"""
# Reads [package, model, precision, points, edge, rounds]; prints the seconds of both queries.
SCRIPT = """
const [index, model, precision, count, edge, rounds] = JSON.parse(process.argv[1]);
const { load } = await import(index);
const texture = await load(model, { precision, cacheLimitBytes: 0 });
const points = Float32Array.from({ length: 3 * count }, (_, i) => (i * 7919) % 256 + 0.25);
const best = (query) => {
  let least = Infinity;
  for (let i = 0; i < rounds; ++i) {
    const begin = process.cpuUsage();
    query();
    const { user, system } = process.cpuUsage(begin);
    least = Math.min(least, (user + system) / 1e6);
  }
  return least;
};
console.log(JSON.stringify([best(() => texture.evalPoints(points)),
                            best(() => texture.evalBox([0, 0, 0], [edge, edge, edge]))]));
"""


def main(arguments: list[str] | None = None) -> int:
    p = cli.parser(PROGRAM, __doc__ or "", EXAMPLES, has_json=False)
    p.add_argument("models", nargs="*", default=MODELS, help="names or paths (a granite, both)")
    p.add_argument("--rounds", type=int, default=3, help="the best one counts (3)")
    build = Path(os.environ.get("SOLIDTEX_BUILD", REPOSITORY / "build"))
    p.add_argument("--package", type=Path, default=build / "wasm" / "package", help="(of build)")
    return cli.run(p, arguments, measure)


def measure(args: argparse.Namespace) -> None:
    print("| model | engine | points a second | voxels a second |\n|---|---|---|---|")
    for model in args.models:
        rows = {"desktop, one thread": desktop_seconds(model, args.rounds)}
        for precision in ("exact", "fast"):
            rows[precision] = web_seconds(model, precision, args.package, args.rounds)
        for engine, (points, box) in rows.items():
            print(f"| {model} | {engine} | {POINTS / points:,.0f} | {EDGE**3 / box:,.0f} |")


def desktop_seconds(model: str, rounds: int) -> tuple[float, float]:
    points = (np.arange(3 * POINTS) * 7919 % 256 + 0.25).astype(np.float32).reshape(-1, 3)

    def best(query: Callable[[], object]) -> float:
        seconds = []
        for _ in range(rounds):
            begin = time.process_time()
            query()
            seconds.append(time.process_time() - begin)
        return min(seconds)

    with Texture(model, threads=1, cache_limit=0) as texture:
        return (
            best(lambda: texture.eval_points(points)),
            best(lambda: texture.eval_box((0, 0, 0), (EDGE, EDGE, EDGE))),
        )


def web_seconds(model: str, precision: str, package: Path, rounds: int) -> tuple[float, float]:
    path = Path(model) if Path(model).exists() else REPOSITORY / "models" / f"{model}.solidtex"
    job = [str(package.resolve() / "index.mjs"), str(path), precision, POINTS, EDGE, rounds]
    node = shutil.which("node") or "node"
    command = [node, "--input-type=module", "-e", SCRIPT, json.dumps(job)]
    done = subprocess.run(command, check=True, capture_output=True, text=True)
    points, box = json.loads(done.stdout)
    return points, box


if __name__ == "__main__":
    raise SystemExit(main())
