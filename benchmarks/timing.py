"""Seconds of a call, by the wall's clock or the processor's."""

from __future__ import annotations

import time
from collections.abc import Callable

CLOCKS: dict[str, Callable[[], float]] = {"wall": time.perf_counter, "cpu": time.process_time}
SETTLE_SECONDS = 0.05
"""Idle workers of the runtime before look for work for a few milliseconds."""


def seconds_of_calls(
    work: Callable[[], object], budget: float, clock: str, threads: int
) -> list[float]:
    """One value for each call, at least one; calls begin until `budget` seconds are over.

    The processor's time is divided by the threads, as solidtex-bench does.
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
