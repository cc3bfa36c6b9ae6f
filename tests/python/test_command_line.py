"""Options that all commands have: --config and --quiet."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

import pytest
from PIL import Image

from solidtex_export.commands import cli, solids
from solidtex_export.export.verification.model_output import OutputError


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


def test_json_replaces_the_text(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    assert solids.main(["marble", "-o", str(tmp_path), "--size", "16", "--json"]) == 0
    printed = capsys.readouterr()
    document = json.loads(printed.out)
    assert document["program"] == "solidtex-solids"
    assert document["files"] == [str(tmp_path / "marble.png")]
