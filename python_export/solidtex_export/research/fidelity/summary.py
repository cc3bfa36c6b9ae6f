"""Figures of a method over all exemplars: geometric means, the worst tenth, paired tests."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from textwrap import fill

import numpy as np
from scipy.stats import bootstrap, wilcoxon

from solidtex_export.research.fidelity.outcome import Outcome, Outcomes
from solidtex_export.research.fidelity.plan import Plan

FEATURE_DISTANCE = "feature_distance"
MEASURES: dict[str, tuple[str, str]] = {
    "LBP, axes": ("axes", "binary_patterns"),
    "LBP, oblique": ("oblique", "binary_patterns"),
    "spectrum": ("multiples", "spectrum"),
    "Wasserstein": ("multiples", "sliced_wasserstein"),
    "feature distance": ("multiples", FEATURE_DISTANCE),
}
"""Title -> slices and metric."""
RESAMPLES = 2000
WIDTH = 100  # columns of the page
FEWEST = 6  # exemplars: fewer give no interval and no test

Statistic = Callable[..., np.ndarray]
"""Statistic of values along `axis`."""


@dataclass(frozen=True)
class Estimate:
    """A figure with its 95 % bootstrap interval over the exemplars, if there are enough."""

    value: float
    low: float | None = None
    high: float | None = None

    def __str__(self) -> str:
        if self.low is None:
            return f"{self.value:.2f}"
        return f"{self.value:.2f} ({self.low:.2f} … {self.high:.2f})"


@dataclass(frozen=True)
class Paired:
    """Distances of one method relative to another on the exemplars that both have."""

    ratio: Estimate
    better: int
    count: int
    p: float | None

    def __str__(self) -> str:
        test = "" if self.p is None else f", p = {self.p:.2g}"
        return f"{self.ratio}, {self.better} of {self.count}{test}"


def distances(plan: Plan, outcomes: Outcomes, measure: str, method: str) -> dict[str, float]:
    """Relative distance by exemplar of the plan, where there is one."""
    found = {}
    for entry in plan.exemplars:
        outcome = outcomes.pairs.get(entry.name, {}).get(method, Outcome())
        value = distance(outcome, measure)
        if value is not None:
            found[entry.name] = value
    return found


def distance(outcome: Outcome, measure: str) -> float | None:
    slices, metric = MEASURES[measure]
    value = (getattr(outcome, slices) or {}).get(metric)
    return None if value is None else max(float(value), 1e-6)


def mean_of_logarithms(values: np.ndarray, axis: int = -1) -> np.ndarray:
    return values.mean(axis)


def mean_of_worst_tenth(values: np.ndarray, axis: int = -1) -> np.ndarray:
    worst = math.ceil(values.shape[axis] / 10)
    return np.sort(values, axis).take(range(-worst, 0), axis).mean(axis)


def estimate(values: list[float], statistic: Statistic = mean_of_logarithms) -> Estimate:
    """Geometric mean of positive values, all or the worst tenth."""
    logarithms = np.log(values)
    value = float(np.exp(statistic(logarithms)))
    if len(values) < FEWEST or np.ptp(logarithms) == 0:
        return Estimate(value)
    interval = bootstrap(
        (logarithms,), statistic, n_resamples=RESAMPLES, method="percentile",
        random_state=np.random.default_rng(0),
    ).confidence_interval  # fmt: skip
    return Estimate(value, float(np.exp(interval.low)), float(np.exp(interval.high)))


def compare(first: dict[str, float], second: dict[str, float]) -> Paired | None:
    """The second method relative to the first: below 1 it is nearer to the exemplars."""
    shared = [name for name in first if name in second]
    if not shared:
        return None
    ratios = np.array([second[name] / first[name] for name in shared])
    tested = len(shared) >= FEWEST and bool((ratios != 1).any())
    p = float(wilcoxon(np.log(ratios)).pvalue) if tested else None
    return Paired(estimate(list(ratios)), int((ratios < 1).sum()), len(shared), p)


def summary(plan: Plan, outcomes: Outcomes) -> str:
    """Markdown tables of the methods over the plan's exemplars; empty for a single exemplar."""
    if len(plan.exemplars) < 2:
        return ""
    found = {
        title: {method: distances(plan, outcomes, title, method) for method in plan.methods}
        for title in MEASURES
    }
    found = {title: rows for title, rows in found.items() if any(rows.values())}
    if not found:
        return ""
    parts = ["## Summary\n", _text(found)]
    for title, statistic in (
        ("Geometric mean", mean_of_logarithms),
        ("Geometric mean of the worst tenth", mean_of_worst_tenth),
    ):
        parts.append(_table(title, plan.methods, found, statistic))
    first = plan.methods[0]
    if len(plan.methods) > 1:
        lines = _header(f"relative to {first}", list(found))
        for method in plan.methods[1:]:
            cells = [compare(rows[first], rows[method]) for rows in found.values()]
            lines.append(_line(method, [str(c or "-") for c in cells]))
        parts.append("\n".join(lines) + "\n")
    return "\n".join(parts)


def _text(found: dict[str, dict[str, dict[str, float]]]) -> str:
    text = (
        f"Relative distances over all exemplars, from {FEWEST} exemplars on with 95 % bootstrap"
        " intervals. In the last table a ratio below 1 is nearer to the exemplars than the first"
        " method; the count says on how many, p is Wilcoxon's signed-rank test."
    )
    if "feature distance" not in found:
        text += " The feature distance is left out: it needs `--features`."
    return fill(text, WIDTH, break_on_hyphens=False) + "\n"


def _header(corner: str, titles: list[str]) -> list[str]:
    return [_line(corner, titles), "|---" * (len(titles) + 1) + "|"]


def _line(head: str, cells: list[str]) -> str:
    return f"| {head} | " + " | ".join(cells) + " |"


def _table(
    corner: str,
    methods: tuple[str, ...],
    found: dict[str, dict[str, dict[str, float]]],
    statistic: Statistic,
) -> str:
    lines = _header(corner, ["exemplars", *found])
    for method in methods:
        values = [list(rows[method].values()) for rows in found.values()]
        cells = [str(estimate(v, statistic)) if v else "-" for v in values]
        lines.append(_line(method, [str(max(map(len, values))), *cells]))
    return "\n".join(lines) + "\n"
