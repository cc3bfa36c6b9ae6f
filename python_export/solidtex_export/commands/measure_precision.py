"""Prints the table of docs/experiments/fast-precision.md: fast precision against full precision.

    python -m solidtex_export.commands.measure_precision [MODEL ...]

Without arguments: untrained sampler models of many shapes, then the samplers of models/.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from solidtex_export.commands import cli, measure_numerics
from solidtex_export.export.verification import engine

TRAINED = ("stone-grey", "wood-zebrano")
SEEDS = range(4)
BOX = ((-7, 1000, 1 << 20), (96, 64, 64))

EXAMPLES = """  python -m solidtex_export.commands.measure_precision
  python -m solidtex_export.commands.measure_precision granite.solidtex"""


@dataclass
class Shift:
    """Differences between fast and full precision, in 1/255, relative to values beyond 1."""

    spread: float
    differences: np.ndarray

    @property
    def within_one(self) -> float:
        return float(np.mean(self.differences <= 1))


def shift(model: Path) -> Shift:
    """Evaluate both precisions over the same boxes of several seeds."""
    full, fast = (
        np.concatenate([_box(model, seed, precision) for seed in SEEDS])
        for precision in ("full", "fast")
    )
    unit = max(1.0, float(np.abs(full).max())) / 255
    return Shift(float(full.std()) / unit, np.abs(fast.astype(np.float64) - full) / unit)


def _box(model: Path, seed: int, precision: str) -> np.ndarray:
    with engine.open_model(model, seed, precision) as texture:
        return texture.eval_box(*BOX).ravel()


def line(name: str, found: Shift) -> str:
    """One row of the table."""
    root, high = np.sqrt(np.mean(found.differences**2)), np.quantile(found.differences, 0.999)
    return (
        f"| {name} | {found.spread:.0f} | {100 * found.within_one:.3f} % | {root:.3f} "
        f"| {high:.2f} | {found.differences.max():.2f} |"
    )


def main(arguments: list[str] | None = None) -> int:
    p = cli.parser(
        "solidtex_export.commands.measure_precision",
        "Measure how far fast precision is from full precision on this processor.",
        EXAMPLES,
    )
    p.add_argument("models", metavar="MODEL", nargs="*", type=Path, help="files to measure")

    def work(args: argparse.Namespace) -> None:
        print(
            "| model | standard deviation | within 1 | root mean square | 99.9 % below | largest |"
        )
        print("|---|---|---|---|---|---|")
        random = [name for name in measure_numerics.RANDOM_MODELS if name.startswith("sampler")]
        shipped = [measure_numerics.SHIPPED / f"{name}.solidtex" for name in TRAINED]
        for name, found in measure_numerics.measured(args.models, random, shipped, shift):
            print(line(name, found), flush=True)

    return cli.run(p, arguments, work)


if __name__ == "__main__":
    sys.exit(main())
