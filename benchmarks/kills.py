"""Kills programs that can be continued, at random moments, and compares what they end with.

Each run of a job is killed (SIGKILL) after a random part of the time that it takes, then started
again by the same command, until it has been killed some times; then it may end. Its output must be
that of an undisturbed run, and no temporary file may be left.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import random
import shutil
import signal
import sys
import tempfile
import threading
import time
from pathlib import Path

from writers import REPOSITORY, Job, Programs, Running, contents, find, leftovers, make_inputs

NAMES = ["npy", "slices png", "zarr", "mesh checkpoint", "render checkpoint", "train"]
NAMES += ["train-space"]


def main() -> int:
    p = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    p.add_argument("jobs", nargs="*", default=NAMES, help=f"of {', '.join(NAMES)} (default: all)")
    p.add_argument("--kills", type=int, default=1000, help="of all jobs together (default 1000)")
    p.add_argument("--seed", type=int, default=0)
    p.add_argument("--build", type=Path, default=REPOSITORY / "build")
    p.add_argument("--inputs", type=Path, help="folder of inputs, made if it does not exist")
    args = p.parse_args()
    draw = random.Random(args.seed)
    print("job                  kills  runs to the end  findings")
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        inputs = args.inputs or folder / "inputs"
        programs = Programs(args.build, inputs if inputs.exists() else make_inputs(inputs))
        jobs = find(args.jobs)
        findings = sum(
            Kills(programs, job, folder / "job", draw).run(-(-args.kills // len(jobs)))
            for job in jobs
        )
        programs.close()
    print(f"findings: {findings}")
    return 1 if findings else 0


class Kills:
    """Runs of one job."""

    def __init__(self, programs: Programs, job: Job, folder: Path, draw: random.Random) -> None:
        self.programs, self.job, self.folder, self.draw = programs, job, folder, draw

    def run(self, kills: int) -> int:
        self._clear()
        self._finish()
        self._clear()
        begin = time.monotonic()  # the second run finds everything in memory
        self._finish()
        self.seconds = time.monotonic() - begin
        self.expected = contents(self.job, self.folder)
        self.kills = ends = findings = 0
        while self.kills < kills:
            self._clear()
            for _ in range(self.draw.randint(1, 6)):
                self._kill()
            problems = self._finish()
            ends += 1
            findings += len(problems)
            for problem in problems:
                print(f"  {self.job.name}, after {self.kills} kills: {problem}", flush=True)
        print(f"{self.job.name:20} {self.kills:5} {ends:16} {findings:9}", flush=True)
        return findings

    def _clear(self) -> None:
        shutil.rmtree(self.folder, ignore_errors=True)
        self.folder.mkdir()

    def _start(self) -> Running | None:
        """Start the job; None if its output is complete and would be refused."""
        whole = any((self.folder / output).exists() for output in self.job.outputs)
        if whole and not self.job.force and not self.job.resumes:
            return None
        more = [self.job.force] if whole and self.job.force else []
        return self.programs.start(self.job, self.folder, *more, **CHECKPOINTS)

    def _kill(self) -> None:
        running = self._start()
        if running is None:
            return

        def kill() -> None:
            with contextlib.suppress(ProcessLookupError):
                os.kill(running.pid, signal.SIGKILL)

        timer = threading.Timer(self.draw.uniform(0, 1.1 * self.seconds), kill)
        timer.start()
        done = running.wait()
        timer.cancel()
        timer.join()
        if done.code == -signal.SIGKILL:
            self.kills += 1
        elif done.code != 0:
            raise SystemExit(f"{self.job.name}: exit code {done.code}: {done.messages}")

    def _finish(self) -> list[str]:
        """Run the job to its end. Returns what is wrong."""
        running = self._start()
        done = running.wait() if running else None
        if done and done.code:
            return [f"exit code {done.code}: {done.messages[-300:]}"]
        left = leftovers(self.job, self.folder)
        problems = [f"left {', '.join(left)}"] if left else []
        expected = getattr(self, "expected", None)
        if expected is not None and contents(self.job, self.folder) != expected:
            problems.append("another output")
        return problems


CHECKPOINTS = {"SOLIDTEX_CHECKPOINT_SECONDS": "0"}

if __name__ == "__main__":
    sys.exit(main())
