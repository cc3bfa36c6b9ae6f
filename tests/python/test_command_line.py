"""Options that all commands have, wrong ones, and Ctrl-C at any time."""

from __future__ import annotations

import argparse
import json
import signal
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from PIL import Image

from solidtex_export import __version__
from solidtex_export.commands import cli, launch, solids
from solidtex_export.export.verification.model_output import OutputError

PROJECT = Path(__file__).resolve().parents[2] / "python_export" / "pyproject.toml"
SCRIPTS = tomllib.loads(PROJECT.read_text())["project"]["scripts"]

SLOW_IMPORT = """
import sys, time
from importlib import import_module

class Slow:
    def find_spec(name, path, target=None):
        if name == "numpy":
            print("loading", flush=True)
            time.sleep(60)

sys.meta_path.insert(0, Slow)
module, _, name = sys.argv.pop(1).partition(":")
sys.exit(getattr(import_module(module), name)())
"""


def parsed(*arguments: object) -> tuple[list[str], int, list[str], bool, bool]:
    p = cli.parser("program", "", "")
    p.add_argument("files", nargs="*")
    p.add_argument("--steps", type=int, default=1)
    p.add_argument("--map", action="append", default=[])
    p.add_argument("--force", action="store_true")
    args = p.parse_args([str(a) for a in arguments])
    return args.files, args.steps, args.map, args.force, args.quiet


def test_options_come_from_a_file_and_the_command_line_goes_first(tmp_path: Path) -> None:
    config = tmp_path / "c.toml"
    config.write_text(
        'arguments = ["a.png"]\nsteps = 60\nmap = ["x=1", "y=2"]\nforce = true\nquiet = false\n'
    )
    assert parsed() == ([], 1, [], False, False)
    assert parsed("--config", config) == (["a.png"], 60, ["x=1", "y=2"], True, False)
    assert parsed(f"--config={config}", "--steps", 80, "-q")[1:] == (80, ["x=1", "y=2"], True, True)


def test_a_missing_file_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        parsed("--config", tmp_path / "none.toml")
    said = capsys.readouterr().err
    assert f"--config: {tmp_path}/none.toml: found no such file, expected a TOML file" in said


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("step = 3", "found an unknown option step"),
        ("steps = ", "found no readable TOML"),
        ("steps = 'many'", "--steps: found many, expected a whole number"),
    ],
)
def test_a_wrong_file_is_refused(
    text: str, message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "c.toml").write_text(text)
    with pytest.raises(SystemExit) as refused:
        parsed("--config", tmp_path / "c.toml")
    assert refused.value.code == 2 and message in capsys.readouterr().err


def test_a_command_runs_by_a_file(tmp_path: Path) -> None:
    config, out = tmp_path / "c.toml", tmp_path / "out"
    config.write_text(f'arguments = ["marble"]\no = "{out}"\nsize = "24,16"\nseed = 3\n')
    assert solids.main(["--config", str(config)]) == 0
    assert Image.open(out / "marble.png").size == (24, 16)
    assert solids.main(["marble", "-o", str(tmp_path), "--size", "24,16", "--seed", "3"]) == 0
    assert (tmp_path / "marble.png").read_bytes() == (out / "marble.png").read_bytes()


def test_quiet_drops_remarks_but_no_errors(capsys: pytest.CaptureFixture[str]) -> None:
    def work(args: argparse.Namespace) -> None:
        print("result")
        print("remark", file=sys.stderr)
        raise OutputError("error")

    for options, error in (([], "remark\nprogram: error\n"), (["-q"], "program: error\n")):
        assert cli.run(cli.parser("program", "", ""), options, work) == 1
        assert capsys.readouterr() == ("result\n", error)


def test_quiet_drops_no_errors_of_options(capsys: pytest.CaptureFixture[str]) -> None:
    p = cli.parser("program", "", "")
    with pytest.raises(SystemExit) as refused:
        cli.run(p, ["-q"], lambda _: p.error("--axes: found w"))
    assert refused.value.code == 2
    assert capsys.readouterr().err.startswith("program: --axes: found w\n")


@pytest.mark.parametrize("value", ["-1um", "-.wgsl", "-1,5"])
@pytest.mark.parametrize("option", ["-o", "--size"])
def test_values_may_begin_like_options(option: str, value: str) -> None:
    p = cli.parser("program", "", "")
    p.add_argument("-o", "--size", dest="value")
    assert p.parse_args([option, value]).value == value


def test_json_replaces_the_text(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    assert solids.main(["marble", "-o", str(tmp_path), "--size", "16", "--json"]) == 0
    printed = capsys.readouterr()
    document = json.loads(printed.out)
    assert document["program"] == "solidtex-solids"
    assert document["files"] == [str(tmp_path / "marble.png")]


def test_unknown_options_are_named_beside_missing_arguments(
    capsys: pytest.CaptureFixture[str],
) -> None:
    for words, message in (
        (["--sead=3", "-x"], "unrecognized arguments: --sead=3 -x; the following arguments are"),
        (
            ["--sead", "3"],
            "--sead; the following arguments are required: -o; did you mean --seed?\n",
        ),
        (["--quiet"], "program: the following arguments are required: file, -o\n"),
        (
            ["a", "-o", "b", "--qiet"],
            "program: unrecognized arguments: --qiet; did you mean --quiet?",
        ),
        (["a", "-o", "b", "--sorcery"], "program: unrecognized arguments: --sorcery\n"),
    ):
        p = cli.parser("program", "", "")
        p.add_argument("file")
        p.add_argument("-o", required=True)
        p.add_argument("--seed")
        with pytest.raises(SystemExit) as refused:
            p.parse_args(words)
        assert refused.value.code == 2 and message in capsys.readouterr().err


@pytest.mark.parametrize("program", SCRIPTS)
def test_a_program_that_loads_is_interrupted(program: str) -> None:
    command = [sys.executable, "-c", SLOW_IMPORT, SCRIPTS[program]]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert process.stdout is not None and process.stdout.readline() == "loading\n"
    process.send_signal(signal.SIGINT)
    assert process.communicate(timeout=60) == ("", f"{program}: interrupted\n")
    assert process.returncode == 130
    done = subprocess.run([*command, "--version"], capture_output=True, text=True, check=True)
    assert done.stdout == f"{program} {__version__}\n"


def test_a_program_that_reads_its_options_is_interrupted(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def main(_arguments: list[str] | None) -> int:
        raise KeyboardInterrupt

    monkeypatch.setattr(solids, "main", main)
    before = signal.getsignal(signal.SIGINT)
    assert launch.solids([]) == 130
    assert capsys.readouterr().err == "solidtex-solids: interrupted\n"
    assert signal.getsignal(signal.SIGINT) is before
