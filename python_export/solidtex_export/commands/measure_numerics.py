"""Prints the table of docs/experiments/full-precision.md: the C++ engine against float64.

    python -m solidtex_export.commands.measure_numerics [MODEL ...]

Without arguments: untrained models of many shapes, then every model in models/.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TypeVar

from solidtex_export.commands import cli
from solidtex_export.export import random_models
from solidtex_export.export.file_format import model_file
from solidtex_export.export.file_format.model_file import ModelFile
from solidtex_export.export.verification import verify

Found = TypeVar("Found")

SHIPPED = Path(__file__).resolve().parents[3] / "models"

RANDOM_MODELS: dict[str, Callable[[], ModelFile]] = {
    "lattice K=5 M_i=3 M_s=4 (the paper's)": random_models.lattice_model,
    "lattice K=0 M_i=1 M_s=1": lambda: random_models.lattice_model(1, 1, 1),
    "lattice K=2 M_i=5 M_s=7": lambda: random_models.lattice_model(3, 5, 7),
    "lattice K=3 M_i=1 M_s=13": lambda: random_models.lattice_model(4, 1, 13),
    "every operation": random_models.every_operation_model,
    "sampler n=16 L=5 m=128 (the paper's)": random_models.sampler_model,
    "sampler n=1 L=2 m=1": lambda: random_models.sampler_model(1, 2, 1),
    "sampler n=6 L=4 m=7": lambda: random_models.sampler_model(6, 4, 7),
    "sampler n=12 L=5 m=64": lambda: random_models.sampler_model(12, 5, 64),
    "sampler n=9 L=4 m=33": lambda: random_models.sampler_model(9, 4, 33),
}

EXAMPLES = """  python -m solidtex_export.commands.measure_numerics
  python -m solidtex_export.commands.measure_numerics granite.solidtex"""


def measured(
    models: list[Path], random: list[str], shipped: list[Path], measure: Callable[[Path], Found]
) -> Iterator[tuple[str, Found]]:
    """Name and measurement of each model; without `models`, of random and of shipped ones."""
    if not models:
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "random.solidtex"
            for name in random:
                model_file.write(path, RANDOM_MODELS[name]())
                yield name, measure(path)
    for model in models or shipped:
        yield model.stem, measure(model)


def line(name: str, found: verify.Differences) -> str:
    return f"| {name} | {found.boxes:.1e} | {found.points:.1e} | {255 * found.largest:.1e} |"


def main(arguments: list[str] | None = None) -> int:
    p = cli.parser(
        "solidtex_export.commands.measure_numerics",
        "Measure how far the C++ engine is from a float64 evaluation of the same file.",
        EXAMPLES,
    )
    p.add_argument("models", metavar="MODEL", nargs="*", type=Path, help="files to measure")

    def work(args: argparse.Namespace) -> None:
        print("| model | boxes | points | largest, in 1/255 |\n|---|---|---|---|")
        shipped = sorted(SHIPPED.glob("*.solidtex"))
        for name, found in measured(args.models, list(RANDOM_MODELS), shipped, verify.differences):
            print(line(name, found), flush=True)

    return cli.run(p, arguments, work)


if __name__ == "__main__":
    sys.exit(main())
