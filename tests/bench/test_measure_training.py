"""The measurements of trainings run and say what they measured. No times are judged."""

import subprocess
import sys
from pathlib import Path

BENCHMARKS = Path(__file__).resolve().parents[2] / "benchmarks"
COMMAND = [sys.executable, str(BENCHMARKS / "measure_training.py")]


def run(*arguments: str) -> subprocess.CompletedProcess[str]:
    command = [*COMMAND, "--steps", "2", *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=300)


def test_a_row_for_each_preset_and_size() -> None:
    done = run("--preset", "lattice", "sampler", "--size", "48", "56")
    assert done.returncode == 0, done.stderr
    head, *rows = done.stdout.splitlines()
    assert head.split()[:2] == ["preset", "size"]
    found = [row.split() for row in rows]
    expected = [(m, s) for m in ("lattice", "sampler") for s in ("48", "56")]
    assert [tuple(row[:2]) for row in found] == expected
    for row in found:
        start, peak, seconds = map(float, row[2:])
        assert 0 < start <= peak
        assert seconds > 0


def test_a_refusal_of_the_trainer_ends_the_measurement() -> None:
    done = run("--size", "31")
    assert done.returncode == 2
    assert "--size: found 31, expected at least 32" in done.stderr
