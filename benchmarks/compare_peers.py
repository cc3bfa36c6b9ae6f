"""Measures solidtex beside OpenVINO, ONNX Runtime and PyTorch: one run, same threads, in turn."""

from __future__ import annotations

import argparse
import json
import os
import re
import sys
from pathlib import Path

from peer_cases import CASES, Case, Settings, measure_case
from peer_report import document, table
from solidtex_side import DEFAULT_PROGRAM, REPOSITORY
from timing import CLOCKS

from solidtex_export.commands import cli
from solidtex_export.export.file_format import model_file
from solidtex_export.export.file_format.model_file import ModelFile
from solidtex_export.export.verification.model_output import OutputError, check_output
from solidtex_export.whole_file import write_whole

PROGRAM = "compare_peers.py"
QUICK_SECONDS = 0.001

EXAMPLES = f"""  {PROGRAM}
  {PROGRAM} lattice.32 sampler.batch --clock cpu
  {PROGRAM} lattice.256 --threads 1 --rounds 5 --json peers.json
Peers that are not installed are left out; pip install './python_export[peers]' has them all."""


def main(arguments: list[str] | None = None) -> int:
    return cli.run(make_parser(), arguments, compare)


def make_parser() -> argparse.ArgumentParser:
    p = cli.parser(PROGRAM, __doc__ or "", EXAMPLES, has_json=False)
    p.add_argument("cases", metavar="CASE", nargs="*", type=case_name,
                   help=f"what to measure (default: {' '.join(CASES)})")  # fmt: skip
    p.add_argument("--threads", type=positive, default=len(os.sched_getaffinity(0)),
                   help="of lattice.256; the others run on one (default: all cores)")  # fmt: skip
    p.add_argument("--rounds", type=positive, default=3,
                   help="how often everything takes its turn (default 3)")  # fmt: skip
    p.add_argument("--seconds", type=float, default=1.0,
                   help="for each peer and size in a round, one call at least")  # fmt: skip
    p.add_argument("--clock", choices=CLOCKS, default="wall",
                   help="cpu: processor time over threads, for a busy machine")  # fmt: skip
    p.add_argument("--lattice-model", "--field-model", metavar="MODEL", type=Path,
                   default="granite-grey",
                   help="a file or the name of a shipped model (default granite-grey)")  # fmt: skip
    p.add_argument("--sampler-model", metavar="MODEL", type=Path, default="stone-grey",
                   help="the same (default stone-grey)")  # fmt: skip
    p.add_argument("--bench", metavar="PROGRAM", type=Path, default=DEFAULT_PROGRAM,
                   help=f"solidtex-bench (default {DEFAULT_PROGRAM})")  # fmt: skip
    p.add_argument("--quick", action="store_true",
                   help="everything tiny and once: shows that it runs, not how fast")  # fmt: skip
    p.add_argument("--json", metavar="FILE", type=Path, help="write the figures to a file as well")
    p.add_argument("--force", action="store_true", help="replace FILE if it exists")
    return p


def compare(args: argparse.Namespace) -> None:
    if args.json:
        check_output(args.json, args.force, ".json")
    settings = make_settings(args)
    results = [measure_case(case, settings) for case in args.cases or CASES.values()]
    print(table(results, settings))
    if args.json:
        text = json.dumps(document(results, settings), indent=2) + "\n"
        write_whole(args.json, text.encode())


def make_settings(args: argparse.Namespace) -> Settings:
    paths = {"lattice": shipped(args.lattice_model), "sampler": shipped(args.sampler_model)}
    options = ["--rounds", "1", "--seconds", str(args.seconds), "--clock", args.clock]
    for family, path in paths.items():
        options += [f"--{family}-model", str(path)]
    return Settings(
        bench=args.bench,
        models={family: read_model(path, family) for family, path in paths.items()},
        bench_options=[*options, "--quick"] if args.quick else options,
        threads=args.threads,
        rounds=1 if args.quick else args.rounds,
        seconds=QUICK_SECONDS if args.quick else args.seconds,
        clock=args.clock,
        quick=args.quick,
    )


def shipped(model: Path) -> Path:
    """Path of a model; a bare name is that of a shipped one."""
    return REPOSITORY / "models" / f"{model}.solidtex" if model.suffix == "" else model.absolute()


def read_model(path: Path, family: str) -> ModelFile:
    model = model_file.read(path)
    found = model.document["family"]
    found = "lattice" if found == "field" else found  # its name in files
    if found != family:
        raise OutputError(f"{path}: family: found {found!r}, expected {family!r}")
    return model


def case_name(text: str) -> Case:
    text = re.sub(r"^field\.", "lattice.", text)  # its old name
    if text not in CASES:
        raise argparse.ArgumentTypeError(f"found {text}, expected one of {', '.join(CASES)}")
    return CASES[text]


def positive(text: str) -> int:
    value = int(text)
    if value < 1:
        raise argparse.ArgumentTypeError(f"found {text}, expected 1 or more")
    return value


if __name__ == "__main__":
    sys.exit(main())
