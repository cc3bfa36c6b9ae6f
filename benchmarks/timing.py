"""Times of a call on the wall clock or the processor's clock."""

from __future__ import annotations

import time
from collections.abc import Callable

CLOCKS: dict[str, Callable[[], float]] = {"wall": time.perf_counter, "cpu": time.process_time}
SETTLE_SECONDS = 0.05
"""Pause before timing: idle workers of the previous runtime spin for a few milliseconds."""


def seconds_of_calls(
    work: Callable[[], object], budget: float, clock: str, threads: int
) -> list[float]:
    """Seconds of each call; at least one call, and calls start until `budget` seconds have passed.

    Processor time is divided by the number of threads, as in solidtex-bench.
    """
    now, parts = CLOCKS[clock], threads if clock == "cpu" else 1
    time.sleep(SETTLE_SECONDS)
    end = time.perf_counter() + budget
    values: list[float] = []
    while not values or time.perf_counter() < end:
        start = now()
        work()
        values.append((now() - start) / parts)
    return values
