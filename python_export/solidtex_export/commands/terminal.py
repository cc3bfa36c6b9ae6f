"""A long training in a terminal: a progress bar with the time left, and Ctrl-C."""

from __future__ import annotations

import signal
from collections.abc import Callable
from types import FrameType
from typing import Any, Protocol

from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn


class Training(Protocol):
    """What can be interrupted between two steps and continued later."""

    step: int
    seconds: float

    @property
    def progress(self) -> float:
        """Fraction that is done."""

    def run(self, stop: Callable[[], bool], report: Callable[[Any], None]) -> None:
        """Train to the end, or until `stop` says so; `report` is called after each step."""


def run_in_terminal(training: Training) -> None:
    """Train with a progress bar; Ctrl-C ends it after the step."""
    interrupted = False

    def interrupt(_signal: int, _frame: FrameType | None) -> None:
        nonlocal interrupted
        interrupted = True

    previous = signal.signal(signal.SIGINT, interrupt)
    columns = (TextColumn("{task.description}"), BarColumn(), TaskProgressColumn())
    try:
        with Progress(*columns) as bar:
            task = bar.add_task("training", total=1.0)

            def report(t: Training) -> None:
                bar.update(task, completed=t.progress, description=_describe(t))

            training.run(lambda: interrupted, report)
    finally:
        signal.signal(signal.SIGINT, previous)


def _describe(training: Training) -> str:
    left = max(0.0, training.seconds * (1 / max(training.progress, 1e-9) - 1))
    return f"step {training.step}, {left / 60:.1f} min left"
