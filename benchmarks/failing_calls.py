"""Lets every call that changes the disk fail, one run for each, in every program that writes.

A preloaded library (tests/faults/faults.c) counts the calls of a job: open, write, fsync, rename,
ftruncate, fclose and their relatives. Then the job runs twice for each call N, which fails: alone,
and with all later ones, as ENOSPC, EROFS or EACCES, in an empty folder or over an older file.

What must be true: a program that succeeds has written what an undisturbed one writes. One that
fails says why in one sentence, with exit code 1, leaves no temporary file, and does no harm to an
older file. A job that can be continued is, with the undisturbed result.
"""

from __future__ import annotations

import argparse
import errno
import shutil
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

from writers import REPOSITORY, Job, Programs, contents, find, leftovers, make_inputs

ERRORS = (errno.ENOSPC, errno.EROFS, errno.EACCES)
OLD = b"an older file"


def main() -> int:
    p = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    p.add_argument("jobs", nargs="*", help="names of jobs (default: all)")
    p.add_argument("--every", type=int, default=1, metavar="K", help="try each K-th call")
    p.add_argument("--build", type=Path, default=REPOSITORY / "build")
    p.add_argument("--inputs", type=Path, help="folder of inputs, made if it does not exist")
    args = p.parse_args()
    library = args.build / "tests/faults/libsolidtex_faults.so"
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        inputs = args.inputs or folder / "inputs"
        jobs = find(args.jobs)
        programs = Programs(args.build, inputs if inputs.exists() else make_inputs(inputs), library)
        programs.prepare(jobs)
        findings = 0
        print("job                  calls  runs  failed  findings")
        for job in jobs:
            findings += len(Sweep(programs, job, folder / "job", args.every).run())
        programs.close()
    print(f"findings: {findings}")
    return 1 if findings else 0


@dataclass
class Sweep:
    """All runs of one job."""

    programs: Programs
    job: Job
    folder: Path
    every: int

    def run(self) -> list[str]:
        count = self.folder.with_suffix(".count")
        self._clear()
        done = self._start(SOLIDTEX_FAULT_COUNT=str(count))
        if "ONNX Runtime" in done.messages:
            print(f"{self.job.name}: skipped, this build cannot encode", flush=True)
            return []
        if done.code:
            raise SystemExit(f"{self.job.name}: exit code {done.code}: {done.messages}")
        self.expected = contents(self.job, self.folder)
        assert self.expected, self.job.name
        calls = int(count.read_text())
        findings, runs, self.failed = [], 0, 0
        for call in range(1, calls + 1, self.every):
            for once in (True, False):
                runs += 1
                problem = self._problem_of(call, once, ERRORS[(call + once) % len(ERRORS)])
                if problem:
                    findings.append(problem)
                    print(f"  {self.job.name}, {problem}", flush=True)
        print(
            f"{self.job.name:20} {calls:5} {runs:5} {self.failed:7} {len(findings):9}", flush=True
        )
        return findings

    def _clear(self) -> None:
        shutil.rmtree(self.folder, ignore_errors=True)
        self.folder.mkdir()

    def _start(self, *more: str, **variables: str):
        return self.programs.run(
            self.job, self.folder, *more, SOLIDTEX_FAULT_FOLDER=str(self.folder), **variables
        )

    def _problem_of(self, call: int, once: bool, error: int) -> str:
        """Run the job with this fault. Returns what is wrong, or nothing."""
        self._clear()
        older = bool(self.job.force) and call % 2 == 0
        for output in self.job.outputs if older else ():
            (self.folder / output).write_bytes(OLD)
        log = self.folder.with_suffix(".log")
        log.write_text("no call")
        variables = {"SOLIDTEX_FAULT_CALL": str(call), "SOLIDTEX_FAULT_ACTION": str(error)}
        variables |= {"SOLIDTEX_FAULT_LOG": str(log)}
        if once:
            variables["SOLIDTEX_FAULT_ONCE"] = "1"
        done = self._start(*([self.job.force] if older else []), **variables)
        problems = self._judge(done.code, done.messages, older)
        if not problems:
            return ""
        where = f"call {call} ({log.read_text()}), {errno.errorcode[error]}"
        return f"{where}{', once' if once else ''}: {'; '.join(problems)}"

    def _judge(self, code: int, messages: str, older: bool) -> list[str]:
        left, found = leftovers(self.job, self.folder), self._contents()
        problems = [f"left {', '.join(left)}"] if left else []
        if code == 0:
            return problems + ["success with another output"] * (found != self.expected)
        self.failed += 1
        last = (messages.splitlines() or [""])[-1]
        if code != 1 or "Traceback" in messages or not last.startswith(self.job.program):
            problems.append(f"exit code {code}, {last!r}")
        elif ".tmp" in last or "errno" in last.lower():
            problems.append(f"unclear: {last!r}")
        if self.job.resumes:
            done = self._start()
            if done.code or self._contents() != self.expected:
                problems.append(f"not continued: {done.code}, {done.messages[-200:]!r}")
        else:
            problems += [
                f"{name} is damaged"
                for name in self.expected
                if not self._is_unharmed(name, found.get(name), older)
            ]
        return problems

    def _contents(self) -> dict[str, bytes]:
        try:
            return contents(self.job, self.folder)
        except Exception as error:  # a damaged checkpoint
            return {"unreadable": str(error).encode()}

    def _is_unharmed(self, name: str, found: bytes | None, older: bool) -> bool:
        """Whether a file of a job that failed is missing, whole or the older one."""
        if found == self.expected[name]:
            return True
        return (self.folder / name).read_bytes() == OLD if older else found is None


if __name__ == "__main__":
    sys.exit(main())
