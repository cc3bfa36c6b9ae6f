"""solidtex-bench as a program: every case runs, and says what it measured. No times are judged."""

import json
import math
import os
import shlex
import signal
import subprocess
import time
from pathlib import Path

import pytest

BENCH = Path(os.environ["SOLIDTEX_BUILD"]) / "bin" / "solidtex-bench"
PAGE = Path(__file__).resolve().parents[2] / "docs" / "benchmarks.md"
# Those that run on all threads, and those that run on one.
PARALLEL = ["lattice.256", "sampler.batch", "sampler.batch.gradients", "sampler.fast"]
PARALLEL += ["sampler.coherent", "bake.memory"]
SINGLE = ["lattice.32", "lattice.16", "lattice.16.neighbours", "lattice.voxel"]
SINGLE += ["sampler.point", "sampler.point.gradients"]
NOISE = ["noise.uniform", "noise.normal"]
UNCOUNTED = [*NOISE, "lattice.cached", "lattice.cached.gradients"]
"""Single ones without arithmetic to count."""


def bench(*arguments: object, **options) -> subprocess.CompletedProcess[str]:
    command = [str(BENCH), *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, **options)


def cases_of(report: dict) -> list[dict]:
    """The runs of a report, with the name and the threads of their cases."""
    runs = [run for run in report["benchmarks"] if run["run_type"] == "iteration"]
    for run in runs:
        run["name"], threads = run["name"].split("/threads:")
        run["threads"] = int(threads)
    return runs


def measured(folder: Path, *arguments: object) -> tuple[dict, str]:
    """The JSON report and the text of a quick run."""
    result = bench("--quick", "--json", folder / "a.json", *arguments)
    assert result.returncode == 0, result.stderr
    assert os.listdir(folder) == ["a.json"]
    return json.loads((folder / "a.json").read_text()), result.stdout


def assert_positive(values: dict, *names: str) -> None:
    for name in names:
        assert math.isfinite(values[name]) and values[name] > 0, (values, name)


def test_machine_is_what_the_issue_forms_ask_for() -> None:
    lines = bench("--machine", "--threads", 3).stdout.splitlines()
    found = dict(line.split(maxsplit=1) for line in lines if not line.startswith("instruction"))
    assert list(found) == ["solidtex", "processor", "threads"] and found["threads"] == "3"
    assert lines[-1].startswith("instruction set  ") and len(lines) == 4


@pytest.mark.parametrize("clock", ["wall", "cpu"])
def test_every_case_runs(tmp_path: Path, clock: str) -> None:
    report, text = measured(tmp_path, "*", "--threads", 2, "--clock", clock)
    context = report["context"]
    assert [context[key] for key in ("threads", "clock", "quick")] == [2, clock, True]
    cases = {case["name"]: case for case in cases_of(report)}
    assert sorted(cases) == sorted(PARALLEL + SINGLE + UNCOUNTED)
    peaks = {peak["threads"]: peak["flops"] for peak in context["peaks"]}
    assert sorted(peaks) == [1, 2] and min(peaks.values()) > 0
    for name, case in cases.items():
        assert name in text
        assert case["threads"] == (2 if name in PARALLEL else 1)
        assert_positive(case, "best_seconds", "real_time", "iterations", "repetitions")
        assert_positive(case, "units_per_call", "units_per_second")
        assert case["best_seconds"] <= case["real_time"] * 1e-9 * (1 + 1e-9)
        if name in UNCOUNTED:
            continue
        assert_positive(case, "direct_flops")
        fraction = case["direct_flops"] / peaks[case["threads"]]
        assert case["peak_fraction"] == pytest.approx(fraction)
    assert cases["bake.memory"]["peak_resident_bytes"] > 1 << 20
    ratios = context["ratios"]
    assert_positive(ratios, "lattice.16 / lattice.256", "sampler.fast / sampler.batch")
    for name in ("lattice.cached", "sampler.batch", "sampler.point"):
        seconds = [cases[case]["best_seconds"] for case in (f"{name}.gradients", name)]
        ratio = ratios[f"{name}.gradients / {name}"]
        assert ratio == pytest.approx(seconds[0] / seconds[1])


def test_arithmetic_is_that_of_the_papers(tmp_path: Path) -> None:
    """Gutierrez: sum over the scales; GramGAN: four layers of 128 x 128, octaves, output."""
    report, _ = measured(tmp_path, "lattice.voxel", "sampler.point")
    counts = {case["name"]: case["multiply_adds_per_unit"] for case in cases_of(report)}

    def three(inputs: int, middle: int) -> int:
        """Two convolutions with 3^3 taps, one with 1."""
        return 27 * inputs * middle + 27 * middle * middle + middle * middle

    scales, noise, step = 6, 3, 4
    expected = sum(three(noise, step) / 8**level for level in range(scales))
    joined = ((step * (scales - level), level) for level in range(scales - 1))
    expected += sum(three(width, width) / 8**level for width, level in joined)
    expected += 3 * step * scales
    assert counts["lattice.voxel"] == pytest.approx(expected)
    assert counts["sampler.point"] == 4 * 128 * 128 + 64 * 128 + 3 * 128


def test_scaling_and_targets(tmp_path: Path) -> None:
    report, text = measured(tmp_path, "sampler.batch", "--scaling", "--threads", 2)
    assert sorted(case["threads"] for case in cases_of(report)) == [1, 2]
    assert "threads 1 -> 2" in text
    assert_positive(report["context"]["ratios"], "sampler.batch, threads 1 -> 2")
    best = report["context"]["target"]
    (tmp_path / "a.json").unlink()
    report, text = measured(tmp_path, "noise.*", "--target", f"{best},{best}")
    assert report["targets"] == [best, best] and best in text
    assert sorted(case["name"] for case in report["cases"]) == [
        f"{n}/threads:1" for n in NOISE[::-1]
    ]
    for case in report["cases"]:
        assert_positive(case["units_per_second"], best)
    assert [run["context"]["target"] for run in report["runs"]] == [best, best]


def test_compares_all_targets(tmp_path: Path) -> None:
    report, text = measured(tmp_path, "sampler.point", "--compare-targets")
    assert len(report["targets"]) == len(set(report["targets"])) > 0
    assert all(target in text for target in report["targets"])


def test_help_version_and_list() -> None:
    assert "Examples:" in bench("--help").stdout
    assert bench("--version").stdout.startswith("solidtex-bench ")
    listed = [line.split()[0] for line in bench("--list").stdout.splitlines()]
    assert sorted(listed) == sorted(PARALLEL + SINGLE + UNCOUNTED)


def test_the_old_name_of_lattice_still_works(tmp_path: Path) -> None:
    report, _ = measured(tmp_path, "field.v*", "--field-model", "granite-beige")
    assert [case["name"] for case in cases_of(report)] == ["lattice.voxel"]
    assert report["context"]["lattice_model"] == "granite-beige"


def test_options_of_google_benchmark(tmp_path: Path) -> None:
    out = tmp_path / "out.json"
    options = ["--benchmark_filter=uniform", f"--benchmark_out={out}"]
    result = bench("--quick", "noise.*", *options)
    assert result.returncode == 0, result.stderr
    assert "noise.uniform" in result.stdout and "noise.normal" not in result.stdout
    (run,) = json.loads(out.read_text())["benchmarks"]
    assert run["name"].startswith("noise.uniform") and run["label"] == "value"


def test_repetitions_have_statistics(tmp_path: Path) -> None:
    path = tmp_path / "a.json"
    result = bench("noise.normal", "--seconds", 0.03, "--rounds", 3, "--json", path)
    assert result.returncode == 0, result.stderr
    runs = json.loads(path.read_text())["benchmarks"]
    assert [run["repetition_index"] for run in runs[:3]] == [0, 1, 2]
    median = next(run for run in runs if run.get("aggregate_name") == "median")
    assert median["real_time"] == pytest.approx(sorted(run["real_time"] for run in runs[:3])[1])


def documented_commands() -> list[list[str]]:
    text = PAGE.read_text().split("```sh\n")[1].split("```")[0]
    commands = [shlex.split(line, comments=True) for line in text.splitlines()]
    assert all(command[0] == "build/bin/solidtex-bench" for command in commands)
    return [command[1:] for command in commands]


@pytest.mark.parametrize("arguments", documented_commands(), ids=" ".join)
def test_commands_of_the_page(tmp_path: Path, arguments: list[str]) -> None:
    result = bench("--quick", *arguments, cwd=tmp_path)
    assert result.returncode == 0, result.stderr
    assert "lattice.32" in result.stdout or "memory" in result.stdout or "--scaling" in arguments


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (["lattice.17"], 2, "lattice.256, lattice.32"),
        (["lattice.*", "nothing*"], 2, '"nothing*"'),
        (["--threads", "0"], 2, "--threads"),
        (["--clock", "moon"], 2, "--clock"),
        (["--target", "ABACUS"], 1, 'SOLIDTEX_TARGET is "ABACUS"'),
        (["--lattice-model", "marzipan"], 1, "granite-grey"),
        (["--field-model", "stone-grey"], 1, "expected one of the lattice family"),
    ],
)
def test_refusals(arguments: list[str], code: int, message: str) -> None:
    result = bench("--quick", *arguments)
    assert result.returncode == code
    assert message in result.stderr


def test_an_existing_file_is_kept_unless_forced(tmp_path: Path) -> None:
    path = tmp_path / "a.json"
    path.write_text("mine")
    result = bench("--quick", "noise.uniform", "--json", path)
    assert result.returncode == 1 and "--force" in result.stderr
    assert path.read_text() == "mine"
    assert bench("--quick", "noise.uniform", "--json", path, "--force").returncode == 0
    assert json.loads(path.read_text())["benchmarks"]


@pytest.mark.parametrize("case", ["sampler.batch", "bake.memory"])
def test_interruption_leaves_nothing(tmp_path: Path, case: str) -> None:
    command = [BENCH, case, "--seconds", "100", "--json", tmp_path / "a.json"]
    environment = os.environ | {"TMPDIR": str(tmp_path)}
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True, env=environment) as process:
        time.sleep(1)
        process.send_signal(signal.SIGTERM)
        assert process.wait(60) == 130
        assert "interrupted" in process.stderr.read()
    assert os.listdir(tmp_path) == []
