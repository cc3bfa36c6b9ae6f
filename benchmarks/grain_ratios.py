#!/usr/bin/env python3
"""Grain ratios of photographs, with their shade and without it (docs/experiments/ablation.md).

From the repository, with `python_export` on PYTHONPATH:

    .venv/bin/python benchmarks/grain_ratios.py photographs/SOURCES.csv
    .venv/bin/python benchmarks/grain_ratios.py photographs/SOURCES.csv --direction layered
"""

from __future__ import annotations

import argparse
import csv
from pathlib import Path

from solidtex_export.analysis.grain import grain_ratios
from solidtex_export.images.exemplar import load_exemplar

RESOLUTION = 256  # pixels, what solidtex-train measures by default
SMALLEST = 32  # pixels


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("list", type=Path, help="CSV with split, file and direction")
    options.add_argument("--direction", help="only photographs of this direction")
    given = options.parse_args()
    print("| photograph | split | direction | grain ratio | without shade |\n|---|---|---|---|---|")
    with given.list.open(newline="") as lines:
        for row in csv.DictReader(lines):
            if given.direction not in (None, row["direction"]):
                continue
            path = given.list.parent / row["split"] / row["file"]
            ratios = grain_ratios(load_exemplar(path, RESOLUTION, SMALLEST))
            texts = " | ".join(f"{ratio:.2f}" for ratio in ratios)
            print(f"| {path.stem} | {row['split']} | {row['direction']} | {texts} |", flush=True)


if __name__ == "__main__":
    main()
