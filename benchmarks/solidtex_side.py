"""Times of solidtex: one run of solidtex-bench."""

from __future__ import annotations

import json
import os
import subprocess
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from solidtex_export.export.verification.engine import EngineError

REPOSITORY = Path(__file__).resolve().parents[1]
DEFAULT_PROGRAM = (
    Path(os.environ.get("SOLIDTEX_BUILD", REPOSITORY / "build")) / "bin/solidtex-bench"
)


@dataclass(frozen=True)
class BenchResult:
    seconds_per_unit: float
    multiply_adds_per_unit: float
    peak_flops: float
    """Peak of the machine with the same number of threads, from the same run."""
    target: str


def run_case(program: Path, case: str, threads: int, options: Sequence[str]) -> BenchResult:
    with tempfile.TemporaryDirectory() as folder:
        output = Path(folder) / "result.json"
        command = [str(program), case, "--threads", str(threads), *options, "--json", str(output)]
        try:
            run = subprocess.run(command, capture_output=True, text=True, check=False)
        except OSError as error:
            raise EngineError(f"{program}: cannot run: {error.strerror}; build solidtex") from error
        if run.returncode != 0:
            raise EngineError(f"{program} {case}: exit code {run.returncode}: {run.stderr.strip()}")
        return parse(json.loads(output.read_text()), case, threads)


def parse(report: dict, case: str, threads: int) -> BenchResult:
    name = f"{case}/threads:{threads}"
    runs = [r for r in report["benchmarks"] if (r["name"], r["run_type"]) == (name, "iteration")]
    (peak,) = (p["flops"] for p in report["context"]["peaks"] if p["threads"] == threads)
    return BenchResult(
        min(run["best_seconds"] for run in runs) / runs[0]["units_per_call"],
        runs[0]["multiply_adds_per_unit"],
        peak,
        report["context"]["target"],
    )
