"""solidtex-fidelity: trains presets on exemplars, evaluates them, and writes the table."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from solidtex_export.commands import cli
from solidtex_export.export.verification.model_output import OutputError
from solidtex_export.settings import SettingsError
from solidtex_export.training.presets import load_recipe

if TYPE_CHECKING:
    from solidtex_export.research.fidelity.cell import Cell
    from solidtex_export.research.fidelity.outcome import Outcomes

PROGRAM = "solidtex-fidelity"

EXAMPLES = f"""  {PROGRAM} docs/fidelity.toml --photos photographs -o results/fidelity
  {PROGRAM} docs/fidelity.toml --photos photographs -o results/fidelity --only granite-grey
  {PROGRAM} docs/fidelity.toml -o results/fidelity --no-training --table docs/fidelity.md

The same command again resumes, so Ctrl-C is safe at any time. Failed steps are repeated only with
--retry. A JSON file beside the table records its figures, so that parts of the table can be made in
different folders. docs/evaluation.md describes plans."""


def make_parser() -> argparse.ArgumentParser:
    p = cli.parser(
        PROGRAM,
        "Train every preset of a plan on each of its exemplars, compare the results with the"
        " exemplars, and write a table with images.",
        EXAMPLES,
    )
    p.add_argument("plan", metavar="PLAN", type=Path, help="a TOML file")
    p.add_argument("-o", dest="folder", metavar="FOLDER", type=Path, required=True,
                   help="folder for models, reports and figures")  # fmt: skip
    p.add_argument("--photos", metavar="FOLDER", type=Path,
                   help="folder of the photographs (default: that of PLAN)")  # fmt: skip
    p.add_argument("--table", metavar="MARKDOWN", type=Path,
                   help="table to write or replace; its images go to images/ beside it"
                   " (default: FOLDER/fidelity.md)")  # fmt: skip
    p.add_argument("--only", metavar="EXEMPLAR", action="append",
                   help="train on this exemplar only; may be repeated")  # fmt: skip
    p.add_argument("--preset", "--method", dest="method", metavar="PRESET", action="append",
                   help="train this preset of the plan only; may be repeated")  # fmt: skip
    p.add_argument("--again", action="store_true",
                   help="train pairs that are in the table but not in FOLDER")  # fmt: skip
    p.add_argument("--no-training", action="store_true", help="only write the table")
    p.add_argument("--retry", action="store_true", help="repeat failed steps")
    p.add_argument("--threads", type=int, default=1, metavar="T",
                   help="CPU threads of each training (default: 1)")  # fmt: skip
    return p


def is_chosen(cell: Cell, args: argparse.Namespace) -> bool:
    exemplar = not args.only or cell.entry.name in args.only
    return exemplar and (not args.method or cell.method in args.method)


def is_done(cell: Cell, recorded: Outcomes, args: argparse.Namespace) -> bool:
    """Whether results exist in the folder or in the table's record."""
    outcome = None if args.again else recorded.of(cell)
    if cell.failure.exists() or (outcome and outcome.failure):
        return not args.retry
    return cell.finished or outcome is not None


def run(args: argparse.Namespace) -> None:
    with cli.optional_packages(PROGRAM, "evaluate"):
        from solidtex_export.research.fidelity.cell import Cell
        from solidtex_export.research.fidelity.outcome import read_outcomes
        from solidtex_export.research.fidelity.plan import read_plan
        from solidtex_export.research.fidelity.table import write_table
    plan = read_plan(args.plan)
    for method in plan.methods:
        load_recipe(method)  # refuses unknown presets
    exemplars = [entry.name for entry in plan.exemplars]
    for option, names, known in (
        ("--only", args.only, exemplars),
        ("--preset", args.method, plan.methods),
    ):
        for name in names or ():
            if name not in known:
                raise OutputError(f"{option}: found {name}, expected one of {', '.join(known)}")
    photos = args.photos or args.plan.parent
    rows = [
        [Cell(plan, entry, method, args.folder, photos) for method in plan.methods]
        for entry in plan.exemplars
    ]
    table = args.table or args.folder / "fidelity.md"
    args.folder.mkdir(parents=True, exist_ok=True)
    recorded = read_outcomes(table.with_suffix(".json"))
    for cell in [] if args.no_training else [c for row in rows for c in row]:
        if not is_chosen(cell, args) or is_done(cell, recorded, args):
            continue
        print(f"{cell.entry.name}, {cell.method}", flush=True)
        if not cell.run(args.threads):
            print(cell.failure.read_text(), end="", flush=True)
        write_table(table, plan, args.plan.name, rows)
    write_table(table, plan, args.plan.name, rows)
    print(table)


def main(arguments: list[str] | None = None) -> int:
    return cli.run(make_parser(), arguments, run, (*cli.FAILURES, SettingsError))


if __name__ == "__main__":
    sys.exit(main())
