"""Runs a long training: progress with the time left, in a terminal or a log, and Ctrl-C."""

from __future__ import annotations

import signal
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any, Protocol

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn

from solidtex_export.commands.cli import say

LOG_SECONDS = 30.0


class Training(Protocol):
    """A training that can be interrupted between two steps and resumed later."""

    step: int
    seconds: float
    activity: str
    """What is done instead of steps; empty during the steps."""

    @property
    def progress(self) -> float:
        """Finished fraction."""

    def run(self, stop: Callable[[], bool], report: Callable[[Any], None]) -> None:
        """Train to the end, or until `stop` returns true; `report` is called after each step."""


Report = Callable[[Training], None]


def run_in_terminal(training: Training) -> None:
    """Train with a progress bar, or without a terminal with a line every half minute.

    Ctrl-C ends the training after the current step.
    """
    interrupted = False

    def interrupt(_signal: int, _frame: FrameType | None) -> None:
        nonlocal interrupted
        interrupted = True

    previous = signal.signal(signal.SIGINT, interrupt)
    # A notebook asks for colors (FORCE_COLOR), but its output is no terminal to draw a bar in.
    console = Console(stderr=True, force_terminal=sys.stderr.isatty())
    try:
        with _progress_bar(console) if console.is_terminal else _progress_lines() as report:
            training.run(lambda: interrupted, report)
    finally:
        signal.signal(signal.SIGINT, previous)


@contextmanager
def _progress_bar(console: Console) -> Iterator[Report]:
    columns = (TextColumn("{task.description}"), BarColumn(), TaskProgressColumn())
    with Progress(*columns, console=console) as bar:
        task = bar.add_task("training", total=1.0)
        yield lambda t: bar.update(task, completed=_progress(t), description=_describe(t))


@contextmanager
def _progress_lines() -> Iterator[Report]:
    said = time.monotonic()

    def report(training: Training) -> None:
        nonlocal said
        if time.monotonic() - said >= LOG_SECONDS:
            said = time.monotonic()
            done = "" if training.activity else f", {_progress(training):.0%}"
            say(_describe(training) + done)

    yield report


def _progress(training: Training) -> float:
    """Finished fraction to show: the last step may take longer than the time that was left."""
    return min(training.progress, 1.0)


def _describe(training: Training) -> str:
    if training.activity:
        return training.activity
    left = training.seconds * (1 / max(_progress(training), 1e-9) - 1)
    return f"step {training.step}, {left / 60:.1f} min left"
