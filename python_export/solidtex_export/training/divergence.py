"""Detects a diverging training."""

from __future__ import annotations

import math
from statistics import median
from typing import Any

FIRST = 10  # values that a loss starts with
RECENT = 10
EXPLOSION = 1000.0


class TrainError(RuntimeError):
    """A training that cannot continue."""


class DivergenceWatch:
    """Compares the median of each loss's recent values with that of its first ones.

    Medians, so that one bad step raises no alarm. Losses have either sign: their magnitude counts.
    """

    def __init__(self) -> None:
        self._first: dict[str, list[float]] = {}
        self._recent: dict[str, list[float]] = {}

    def check(self, step: int, losses: dict[str, float]) -> None:
        """Check the losses of a step; NaN in `losses` marks one that has not started, which is
        ignored.
        """
        for name, value in losses.items():
            if math.isnan(value):
                continue
            first = self._first.setdefault(name, [])
            if len(first) < FIRST:
                first.append(abs(value))
                continue
            recent = self._recent.setdefault(name, [])
            recent.append(abs(value))
            del recent[:-RECENT]
            limit = EXPLOSION * max(1.0, median(first))
            if len(recent) == RECENT and median(recent) > limit:
                raise TrainError(
                    f"step {step}: {name}: found a loss of {median(recent):.3g} where it started at"
                    f" {median(first):.3g}, expected at most {limit:.3g}: the training diverges;"
                    f" {ADVICE}"
                )

    def state(self) -> dict[str, Any]:
        return {"first": self._first, "recent": self._recent}

    def restore(self, state: dict[str, Any]) -> None:
        self._first, self._recent = state["first"], state["recent"]


ADVICE = (
    "a checkpoint, if there is one, is kept; a lower optimizer.learning_rate or another --seed may"
    " work"
)


def not_finite(step: int, what: str) -> TrainError:
    return TrainError(
        f"step {step}: found {what} that is not finite, expected a finite one: the training"
        f" diverges; {ADVICE}"
    )


def gradient_not_finite(step: int, losses: dict[str, float]) -> TrainError:
    """Name the losses that are not finite, or else all of them."""
    names = [name for name, value in losses.items() if not math.isfinite(value)]
    return not_finite(step, f"a gradient of {', '.join(names or losses)}")
