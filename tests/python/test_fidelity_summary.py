"""Summary and overviews of a fidelity page: means, intervals, paired tests, the nearest method."""

from __future__ import annotations

import numpy as np
import pytest

from solidtex_export.research.fidelity.outcome import Outcome, Outcomes
from solidtex_export.research.fidelity.plan import Plan
from solidtex_export.research.fidelity.summary import (
    compare,
    distances,
    estimate,
    mean_of_worst_tenth,
    summary,
)
from solidtex_export.research.fidelity.table import overview


def outcomes_of(distances: dict[str, list[float]]) -> tuple[Plan, Outcomes]:
    """Exemplars with the given distances of each method, whatever the metric."""
    count = len(next(iter(distances.values())))
    plan = Plan(
        steps=1,
        methods=tuple(distances),
        exemplar=[{"name": f"e{i}", "photo": "e.png"} for i in range(count)],
    )
    pairs = {
        f"e{i}": {
            method: Outcome(axes=figures, oblique={}, multiples=figures)
            for method, values in distances.items()
            for figures in [{"binary_patterns": values[i]}]
        }
        for i in range(count)
    }
    return plan, Outcomes(pairs, {})


def test_the_summary_has_means_intervals_and_a_paired_test() -> None:
    values = list(np.geomspace(1, 4, 20))
    ratios = np.geomspace(0.64, 1, 21)[:20]
    plan, outcomes = outcomes_of({"one": values, "two": list(ratios * values)})
    first = distances(plan, outcomes, "LBP, axes", "one")
    mean = estimate(list(first.values()))
    assert mean.value == pytest.approx(2) and 1.6 < mean.low < 1.9 and 2.1 < mean.high < 2.5
    worst = estimate(list(first.values()), mean_of_worst_tenth)
    assert worst.value == pytest.approx(np.sqrt(values[-1] * values[-2]))
    paired = compare(first, distances(plan, outcomes, "LBP, axes", "two"))
    assert paired.ratio.value == pytest.approx(np.exp(np.log(ratios).mean()))
    assert paired.better == paired.count == 20
    assert paired.p == pytest.approx(2 / 2**20)  # every sign is the same
    text = summary(plan, outcomes)
    assert "| one | 20 | 2.00 (" in text and ", 20 of 20, p = 1.9e-06 |" in text
    assert "it needs `--features`" in text and "spectrum" not in text
    assert max(len(line) for line in text.splitlines() if not line.startswith("|")) <= 100


def test_methods_that_differ_by_chance_are_not_significant() -> None:
    random = np.random.default_rng(0)
    one, two = np.exp(random.normal(0, 0.3, (2, 40)))
    plan, outcomes = outcomes_of({"one": list(one), "two": list(two)})
    paired = compare(*(distances(plan, outcomes, "LBP, axes", m) for m in ("one", "two")))
    assert paired.p > 0.05 and paired.ratio.low < 1 < paired.ratio.high


def test_the_nearest_of_several_methods_is_bold() -> None:
    both = overview(*outcomes_of({"one": [2.0, 1.0], "two": [1.5, 3.0]}), "binary_patterns")
    assert "| [e0](#e0) | 2.00 | **1.50** |" in both and "| **1.00** | 3.00 |" in both
    assert "**" not in overview(*outcomes_of({"one": [2.0]}), "binary_patterns")
