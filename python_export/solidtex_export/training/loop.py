"""Loop of a resumable training: progress, checkpoints, previews and the log."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import nullcontext
from typing import Any, Self

from solidtex_export.training.ranks import Ranks
from solidtex_export.training.result import ResultFolder


class ResumableTraining:
    """A training of `steps` or `minutes`; `run` may be interrupted between any two steps."""

    folder: ResultFolder
    ranks: Ranks
    checkpoint_seconds = 180.0
    preview_seconds = 600.0
    log_steps = 50
    clock = staticmethod(time.monotonic)
    steps: int | None = None
    minutes: float | None = None
    step = 0
    seconds = 0.0
    activity = ""
    """What is done instead of steps; empty during the steps."""

    @property
    def progress(self) -> float:
        """Fraction of the training that is done."""
        if self.steps is not None:
            return self.step / self.steps
        assert self.minutes is not None
        return self.seconds / (60 * self.minutes)

    def run(self, stop: Callable[[], bool], report: Callable[[Self], None]) -> None:
        """Train to the end, or until `stop` returns true; saves a checkpoint in either case."""
        with self.folder.held() if self.ranks.is_main else nullcontext():
            self._run(stop, report)

    def _run(self, stop: Callable[[], bool], report: Callable[[Self], None]) -> None:
        saved = previewed = time.monotonic()
        recent: list[dict[str, float]] = []
        while True:
            now = time.monotonic()
            old = now - saved > self.checkpoint_seconds, now - previewed > self.preview_seconds
            due = stop(), *old
            self.seconds, stopping, saving, previewing = self.ranks.agree(self.seconds, *due)
            if saving:
                self.save()
                saved = now
            if previewing:
                self.save_preview()
                previewed = now
            if self.progress >= 1 or stopping:
                break
            start = self.clock()
            recent.append(self._train_step())
            self.seconds += self.clock() - start
            if self.step == 1 or self.step % self.log_steps == 0:
                row = self._summary(recent)
                recent = []
                if self.ranks.is_main:
                    self.folder.log({"step": self.step, "seconds": round(self.seconds, 1)} | row)
            report(self)
        if self.progress >= 1:
            self._finish(stop, report)
        self.save()
        self.save_preview()

    def _summary(self, rows: list[dict[str, float]]) -> dict[str, float]:
        """What is logged of recent steps: mean losses, which differ more between materials than in
        time.
        """
        return {name: sum(row[name] for row in rows) / len(rows) for name in rows[0]}

    def _finish(self, stop: Callable[[], bool], report: Callable[[Self], None]) -> None:
        """Called at the end of a training that was not stopped before.

        If `stop` returns true, it changes nothing, and is called again when the training resumes.
        """

    def save(self) -> None:
        state = self.state()
        if self.ranks.is_main:
            self.folder.save_checkpoint(state)
        self.ranks.wait()

    def state(self) -> dict[str, Any]:
        raise NotImplementedError

    def save_preview(self) -> None:
        raise NotImplementedError

    def _train_step(self) -> dict[str, float]:
        """One step; its rate and losses."""
        raise NotImplementedError
