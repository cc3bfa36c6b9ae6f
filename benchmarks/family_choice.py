#!/usr/bin/env python3
"""How near the chosen family comes to the nearer one (docs/experiments/ablation.md).

For the pairs of a fidelity page that has both families: what `solidtex-train` would choose for each
photograph, how far the sampler is relative to the lattice (geometric mean of the five distances),
how much each limit of the choice gains, how rules compare, and how long the choice takes. From the
repository, built, with `python_export` on PYTHONPATH:

    .venv/bin/python benchmarks/family_choice.py docs/fidelity.toml --photos photographs
"""

from __future__ import annotations

import argparse
import re
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from solidtex_export.analysis.choice import LONG_GRAIN, SAMPLER, Choice, choose_preset
from solidtex_export.analysis.measurements import Measurements
from solidtex_export.losses.descriptor.weights import PROCEDURAL, load_weights
from solidtex_export.losses.learned import LearnedDescriptor
from solidtex_export.research.fidelity.outcome import read_outcomes
from solidtex_export.research.fidelity.plan import Entry, photograph, read_plan
from solidtex_export.research.fidelity.summary import MEASURES, distances, estimate
from solidtex_export.training.resolve import Request, load_exemplars, scale


@dataclass(frozen=True)
class Case:
    """A photograph: what is measured on it, what is chosen, how far each family is."""

    measured: Measurements
    choice: Choice
    ratios: list[float]
    """Distances of the sampler relative to the lattice, by measure."""
    seconds: float
    """Processor time of the choice; the photograph has been read."""

    @property
    def ratio(self) -> float:
        return estimate(self.ratios).value

    @property
    def limit(self) -> str:
        """What decided, without the figure of this photograph."""
        reason = re.sub("flipped|turned", "flipped or turned", self.choice.reason)
        return re.sub(r"\d+(\.\d+)?", "…", reason, count=1)

    def beyond(self, is_sampler: bool) -> float:
        """Distance of a family relative to the nearer one."""
        return (self.ratio if is_sampler else 1.0) / min(self.ratio, 1.0)


def has_long_grain(case: Case) -> bool:
    return case.measured.directions == "xy" and case.measured.grain >= LONG_GRAIN


RULES: dict[str, Callable[[Case], bool]] = {
    "always `sampler`": lambda case: True,
    "always `lattice`": lambda case: False,
    "`sampler` for long grain only": has_long_grain,
    "as `solidtex-train` chooses": lambda case: case.choice.value == SAMPLER,
}
"""Whether a rule chooses the sampler."""


@cache
def learned() -> LearnedDescriptor:
    return LearnedDescriptor(load_weights(PROCEDURAL))


def measurements(entry: Entry, folder: Path) -> Measurements:
    request = Request(
        photos=(photograph(entry, folder),),
        directions=entry.directions or "xyz",
        maps=({},),
        size=entry.size,
        resolution=entry.resolution,
    )
    size, resolution = scale(request)
    exemplars = load_exemplars(request, resolution, size)
    return Measurements(exemplars, request.directions, lambda: learned().distances)


def print_limits(cases: list[Case]) -> None:
    print("\n| limit | chosen | photographs | mean | " + " | ".join(MEASURES) + " |")
    print("|---" * (len(MEASURES) + 4) + "|")
    for limit, chosen in sorted({(case.limit, case.choice.value) for case in cases}):
        group = [case for case in cases if (case.limit, case.choice.value) == (limit, chosen)]
        means = [estimate([case.ratio for case in group])]
        means += [estimate([case.ratios[i] for case in group]) for i in range(len(MEASURES))]
        print(f"| {limit} | `{chosen}` | {len(group)} | {' | '.join(map(str, means))} |")


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("plan", type=Path, help="the plan; its outcomes stand beside it")
    options.add_argument("--photos", type=Path, required=True, help="folder of the photographs")
    given = options.parse_args()
    plan = read_plan(given.plan, given.photos)
    outcomes = read_outcomes(given.plan.with_suffix(".json"))
    far = {
        family: [distances(plan, outcomes, measure, family) for measure in MEASURES]
        for family in ("sampler", "lattice")
    }
    cases = []
    print("| photograph | " + " | ".join(MEASURES) + " | mean | chosen |")
    print("|---" * (len(MEASURES) + 3) + "|")
    for entry in plan.exemplars:
        pairs = list(zip(far["sampler"], far["lattice"], strict=True))
        if not all(entry.name in sampler and entry.name in lattice for sampler, lattice in pairs):
            continue
        ratios = [sampler[entry.name] / lattice[entry.name] for sampler, lattice in pairs]
        measured = measurements(entry, given.photos)
        begin = time.process_time()
        choice = choose_preset(measured)
        case = Case(measured, choice, ratios, time.process_time() - begin)
        cases.append(case)
        figures = " | ".join(f"{ratio:.2f}" for ratio in (*ratios, case.ratio))
        print(f"| {entry.name} | {figures} | `{case.choice.value}` |", flush=True)
    print_limits(cases)
    print("\n| rule | nearer | mean |\n|---|---|---|")
    for name, chooses_sampler in RULES.items():
        beyond = [case.beyond(chooses_sampler(case)) for case in cases]
        print(f"| {name} | {beyond.count(1)} | {estimate(beyond)} |")
    seconds = [case.seconds for case in cases]
    print(f"\nprocessor seconds of a choice: {np.median(seconds):.2f}, at most {max(seconds):.2f}")


if __name__ == "__main__":
    main()
