#!/usr/bin/env python3
"""One method relative to another by photograph, of one page of solidtex-fidelity or of two.

    python benchmarks/compare_outcomes.py docs/fidelity-default.json default \\
        docs/fidelity.json sampler lattice

For each photograph that both pages have, the five distances of the first method divided by those of
the first named method of the second page that is of the same family; then their geometric means,
with intervals. `mean` is over the five, `without features` over the other four.
"""

from __future__ import annotations

import argparse
import math
from pathlib import Path

from solidtex_export.research.fidelity.outcome import Outcome, read_outcomes
from solidtex_export.research.fidelity.summary import FEATURE_DISTANCE, MEASURES, estimate


def figures(outcome: Outcome) -> list[float] | None:
    values = [(getattr(outcome, slices) or {}).get(metric) for slices, metric in MEASURES.values()]
    return None if None in values else [float(value) for value in values if value is not None]


def mean(ratios: list[float]) -> float:
    return math.exp(sum(map(math.log, ratios)) / len(ratios))


def line(name: str, cells: list[object]) -> None:
    texts = (f"{cell:.2f}" if isinstance(cell, float) else str(cell) for cell in cells)
    print(f"| {name} | {' | '.join(texts)} |", flush=True)


def main() -> None:
    p = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    p.add_argument("first", type=Path, help="JSON file beside a page")
    p.add_argument("method", help="method of that page")
    p.add_argument("second", type=Path, help="JSON file beside a page, or the same")
    p.add_argument("others", nargs="+", metavar="other", help="methods of that page")
    args = p.parse_args()
    first, second = read_outcomes(args.first).pairs, read_outcomes(args.second).pairs
    features = [metric for _, metric in MEASURES.values()].index(FEATURE_DISTANCE)
    line("photograph", [*MEASURES, "mean", "without features"])
    line("---", ["---"] * (len(MEASURES) + 2))
    rows = []
    for name in sorted(first.keys() & second.keys()):
        ours = first[name].get(args.method, Outcome())
        found = (second[name].get(other, Outcome()) for other in args.others)
        theirs = next((o for o in found if o.preset == ours.preset), Outcome())
        upper, lower = figures(ours), figures(theirs)
        if upper is None or lower is None:
            continue
        ratios = [a / b for a, b in zip(upper, lower, strict=True)]
        row = [*ratios, mean(ratios), mean(ratios[:features] + ratios[features + 1 :])]
        rows.append(row)
        line(name, [*row])
    line(f"all {len(rows)}", [estimate(list(column)) for column in zip(*rows, strict=True)])


if __name__ == "__main__":
    main()
