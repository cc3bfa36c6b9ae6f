"""solidtex-fidelity: trains presets on exemplars, evaluates them, and writes the table."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor, as_completed
from pathlib import Path
from typing import TYPE_CHECKING

from solidtex_export.analysis.choice import LATTICE
from solidtex_export.commands import cli
from solidtex_export.export.verification.model_output import OutputError
from solidtex_export.images.file_kinds import ExemplarError
from solidtex_export.networks.squeezenet import WeightsError, load_squeezenet
from solidtex_export.research.fidelity.plan import CHOSEN
from solidtex_export.settings import SettingsError
from solidtex_export.training.presets import load_recipe

if TYPE_CHECKING:
    from solidtex_export.research.fidelity.cell import Cell
    from solidtex_export.research.fidelity.outcome import Outcomes
    from solidtex_export.research.fidelity.plan import Plan

PROGRAM = "solidtex-fidelity"

EXAMPLES = f"""  {PROGRAM} docs/papers.toml --photos photographs -o results/papers
  {PROGRAM} docs/papers.toml --photos photographs -o results/papers --only granite-beige
  {PROGRAM} docs/papers.toml -o results/papers --no-training --table docs/papers.md
  {PROGRAM} docs/fidelity.toml --photos photographs --features squeezenet.safetensors \\
      --workers 2 -o results/fidelity

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
    p.add_argument("--features", metavar="FILE", type=Path,
                   help="weights of SqueezeNet v1.0: adds the feature distance")  # fmt: skip
    p.add_argument("--workers", type=int, default=1, metavar="N",
                   help="trainings at the same time (default: 1)")  # fmt: skip
    p.add_argument("--threads", type=int, default=1, metavar="T",
                   help="CPU threads of each training (default: 1)")  # fmt: skip
    return p


def is_chosen(cell: Cell, args: argparse.Namespace) -> bool:
    exemplar = not args.only or cell.entry.name in args.only
    return exemplar and (not args.method or cell.method in args.method)


def is_done(cell: Cell, recorded: Outcomes, args: argparse.Namespace) -> bool:
    """Whether results exist in the folder or in the table's record."""
    from solidtex_export.research.fidelity.summary import FEATURE_DISTANCE

    outcome = None if args.again else recorded.of(cell)
    if cell.failure.exists() or (outcome and outcome.failure):
        return not args.retry
    if cell.finished:
        return True
    can_measure = args.features is not None and cell.model.exists()
    return outcome is not None and (FEATURE_DISTANCE in outcome.figures or not can_measure)


def run(args: argparse.Namespace) -> cli.Document:
    with cli.optional_packages(PROGRAM, "evaluate"):
        from solidtex_export.research.fidelity.cell import Cell
        from solidtex_export.research.fidelity.contact_sheet import write_contact_sheet
        from solidtex_export.research.fidelity.outcome import (
            check_folder,
            check_outcome,
            read_outcomes,
        )
        from solidtex_export.research.fidelity.plan import read_plan
        from solidtex_export.research.fidelity.summary import summary
        from solidtex_export.research.fidelity.table import write_table
    plan = read_plan(args.plan, args.photos)
    check_names(plan, args)
    if args.features is not None:
        load_squeezenet(args.features)  # refuses other files
    photos = args.photos or args.plan.parent
    rows = [
        [Cell(plan, entry, name, args.folder, photos, args.features) for name in plan.methods]
        for entry in plan.exemplars
    ]
    table = args.table or args.folder / "fidelity.md"
    args.folder.mkdir(parents=True, exist_ok=True)
    figures = table.with_suffix(".json")
    recorded = read_outcomes(figures)
    for cell in (c for row in rows for c in row):
        check_folder(cell)
        if not (args.again and is_chosen(cell, args)):
            check_outcome(cell, recorded.of(cell), figures)
    cells = [] if args.no_training else [c for row in rows for c in row if is_chosen(c, args)]
    cells = [c for c in cells if not is_done(c, recorded, args)]
    check_photographs(cells, args)
    for cell in run_cells(cells, args):
        if cell.failure.exists():
            cli.say(cell.failure.read_text().rstrip("\n"))
        write_table(table, plan, args.plan.name, rows)
    write_table(table, plan, args.plan.name, rows)
    print(summary(plan, read_outcomes(figures)))
    sheet = args.folder / "contact-sheet.png"
    has_sheet = write_contact_sheet(sheet, rows)
    if has_sheet:
        print(sheet)
    print(table)
    return cli.files(table, figures, *([sheet] if has_sheet else []))


def check_names(plan: Plan, args: argparse.Namespace) -> None:
    """Refuse unknown presets, methods and exemplars."""
    for name in plan.methods:
        method = plan.method(name)
        where = f"method.{name}" if name in plan.named_methods else "methods"
        try:
            load_recipe(LATTICE if method.preset == CHOSEN else method.preset, list(method.set))
        except SettingsError as error:
            what = str(error).removeprefix("--preset: ")
            raise SettingsError(f"{args.plan}: {where}: {what}") from error
    exemplars = [entry.name for entry in plan.exemplars]
    for option, names, known in (
        ("--only", args.only, exemplars),
        ("--preset", args.method, plan.methods),
    ):
        for name in names or ():
            if name not in known:
                raise OutputError(f"{option}: found {name}, expected one of {', '.join(known)}")


def check_photographs(cells: list[Cell], args: argparse.Namespace) -> None:
    """Refuse a missing photograph before anything is trained."""
    for cell in cells:
        if cell.entry.photo and not cell.photo.is_file():
            raise OutputError(
                f"{args.plan}: exemplar {cell.entry.name}: photo: found no file {cell.photo},"
                " expected a photograph (--photos FOLDER)"
            )


def run_cells(cells: list[Cell], args: argparse.Namespace) -> Iterator[Cell]:
    """Run cells by --workers at the same time; yields each when it has ended."""

    def work(cell: Cell) -> Cell:
        cli.say(f"{cell.entry.name}, {cell.method}")
        cell.run(args.threads)
        return cell

    for cell in cells:
        cell.prepare()
    with ThreadPoolExecutor(args.workers) as pool:
        try:
            for done in as_completed([pool.submit(work, cell) for cell in cells]):
                yield done.result()
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise


def main(arguments: list[str] | None = None) -> int:
    return cli.run(
        make_parser(), arguments, run, (*cli.FAILURES, SettingsError, WeightsError, ExemplarError)
    )


if __name__ == "__main__":
    sys.exit(main())
