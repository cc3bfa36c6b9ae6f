#!/usr/bin/env python3
"""Losses of trainings, their means over each sixth of the logged steps (docs/papers-length.md).

They tell whether a training still improved when it ended:

    benchmarks/loss_sixths.py results/papers/*/*/result
"""

from __future__ import annotations

import argparse
import csv
from pathlib import Path

import numpy as np

PARTS = 6
NO_LOSS = {"step", "seconds", "rate"}


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("results", type=Path, nargs="+", help="folders with a log.csv")
    print("| training | loss |" + "".join(f" {part + 1} |" for part in range(PARTS)))
    print("|---|---|" + "---|" * PARTS)
    for folder in options.parse_args().results:
        with (folder / "log.csv").open(newline="") as lines:
            log = csv.DictReader(lines)
            rows = list(log)
        for name in log.fieldnames or ():
            if name in NO_LOSS:
                continue
            values = np.array([float(row[name] or "nan") for row in rows])
            means = [np.nanmean(part) if np.isfinite(part).any() else np.nan
                     for part in np.array_split(values, PARTS)]  # fmt: skip
            texts = " | ".join("" if np.isnan(mean) else f"{mean:.3g}" for mean in means)
            print(f"| {folder} | {name} | {texts} |")


if __name__ == "__main__":
    main()
