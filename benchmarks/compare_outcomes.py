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
from pathlib import Path

from solidtex_export.research.fidelity.outcome import Outcome, read_outcomes
from solidtex_export.research.fidelity.summary import MEASURES, distance, estimate

FEATURES = "feature distance"


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
    line("photograph", [*MEASURES, "mean", "without features"])
    line("---", ["---"] * (len(MEASURES) + 2))
    rows = []
    for name in sorted(first.keys() & second.keys()):
        ours = first[name].get(args.method, Outcome())
        found = (second[name].get(other, Outcome()) for other in args.others)
        theirs = next((o for o in found if o.preset == ours.preset), Outcome())
        ratios = {}
        for measure in MEASURES:
            above, below = distance(ours, measure), distance(theirs, measure)
            if above is not None and below is not None:
                ratios[measure] = above / below
        if len(ratios) < len(MEASURES):
            continue
        others = [ratio for measure, ratio in ratios.items() if measure != FEATURES]
        row = [*ratios.values(), estimate([*ratios.values()]).value, estimate(others).value]
        rows.append(row)
        line(name, [*row])
    line(f"all {len(rows)}", [estimate(list(column)) for column in zip(*rows, strict=True)])


if __name__ == "__main__":
    main()
