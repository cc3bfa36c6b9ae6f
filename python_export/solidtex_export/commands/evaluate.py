"""solidtex-eval: compares a solid texture with its exemplar, in figures and images."""

from __future__ import annotations

import argparse
import hashlib
import json
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from solidtex_export.commands import cli
from solidtex_export.commands.train_options import maps_of_photographs, named_file, rectangle
from solidtex_export.evaluation import subjects
from solidtex_export.evaluation.pictures import ORIENTATIONS
from solidtex_export.evaluation.subjects import SMALLEST_PICTURE, UNLIMITED, Subject, SubjectError
from solidtex_export.export.file_format import model_file
from solidtex_export.export.verification.model_output import OutputError, check_output
from solidtex_export.images.channels import Reading
from solidtex_export.images.exemplar import Exemplar, check_alike, load_exemplar
from solidtex_export.images.file_kinds import ExemplarError
from solidtex_export.measuring.volumes import PHASE_PREFIX
from solidtex_export.networks.squeezenet import WeightsError
from solidtex_export.whole_file import write_whole

if TYPE_CHECKING:
    from solidtex_export.evaluation.evaluate import Evaluation

PROGRAM = "solidtex-eval"
DEFAULT_SIDE = 96
STANDARD_OUTPUT = Path("-")

EXAMPLES = f"""  {PROGRAM} granite.solidtex granite.jpg -o report.html
  {PROGRAM} granite.solidtex granite.jpg --json report.json --seed 7
  {PROGRAM} --slices results/theirs granite.jpg --resolution 256 -o theirs.html
  {PROGRAM} --slices x=front.png --slices z=top.png granite.jpg

A model's own training configuration says how its photograph is cropped, reduced and compared.
Images have the scale of the exemplar after --resolution. The figures: docs/evaluation.md."""


def make_parser() -> argparse.ArgumentParser:
    p = cli.parser(
        PROGRAM,
        "Compare slices of a model, or images of slices, with the photograph of the training."
        " Distances are relative to self-distance, the distance between the photograph's halves.",
        EXAMPLES,
        has_json=False,
    )
    p.usage = f"{PROGRAM} [options] (MODEL.solidtex | --slices PATH) EXEMPLAR [EXEMPLAR ...]"
    p.add_argument("paths", metavar="MODEL EXEMPLAR", nargs="+", type=Path,
                   help="a model, then its photograph, or photographs if it was trained on one per"
                   " direction")  # fmt: skip
    p.add_argument("--slices", metavar="[NAME=]PATH", action="append", type=view, default=[],
                   help="compare an image, or all in a folder, instead of a model; NAME groups"
                   " them in the report; may be repeated")  # fmt: skip
    p.add_argument("--map", dest="maps", metavar="NAME=FILE", action="append", default=[],
                   type=named_file,
                   help="further channel of the exemplar, as in solidtex-train")  # fmt: skip
    cli.add_reading_arguments(p)
    p.add_argument("-o", dest="output", metavar="HTML", type=Path, help="write a report")
    p.add_argument("--json", metavar="JSON", type=Path,
                   help="write all figures; - for standard output, without the table")  # fmt: skip
    p.add_argument("--pictures", metavar="FOLDER", type=Path,
                   help="write the images of the report, as PNG files")  # fmt: skip
    p.add_argument("--sheet", metavar="PNG", type=Path,
                   help="write the exemplar beside a slice of each kind, like the preview.png of a"
                   " training; one row per map")  # fmt: skip
    p.add_argument("--force", action="store_true", help="replace files that exist")
    p.add_argument("--size", type=int, metavar="N",
                   help="largest side of the compared crops in pixels; smaller if two of them do"
                   " not fit into the photograph (default: the model's, else 96)")  # fmt: skip
    p.add_argument("--crops", type=int, default=16, metavar="N",
                   help="crops in each compared set (default: 16)")  # fmt: skip
    p.add_argument("--resolution", type=int, metavar="N",
                   help="reduce the photograph to a shorter side of N pixels (default: as for the"
                   " model's training)")  # fmt: skip
    p.add_argument("--crop", type=rectangle, metavar="X,Y,W,H",
                   help="use this rectangle of the photograph (default: as for training, if it"
                   " used the same file)"
                   )  # fmt: skip
    p.add_argument("--symmetry", choices=tuple(ORIENTATIONS),
                   help="orientations that count as the same (default: as for training, else"
                   " none)")  # fmt: skip
    p.add_argument("--inception", metavar="FILE", type=Path,
                   help="weights of torchvision's inception_v3 (a state dict): adds SIFID"
                   )  # fmt: skip
    p.add_argument("--features", metavar="FILE", type=Path,
                   help="weights of SqueezeNet v1.0 (safetensors): adds the feature distance, and"
                   " SIFID with that network"
                   )  # fmt: skip
    p.add_argument("--seed", type=int, default=0, metavar="S",
                   help="random seed of the model and of all choices (default: 0)")  # fmt: skip
    return p


def view(text: str) -> tuple[str, Path]:
    name, found, path = text.partition("=")
    return (name, Path(path)) if found else ("slices", Path(text))


def check(p: argparse.ArgumentParser, args: argparse.Namespace) -> None:
    """Separate the model from its photographs, and refuse invalid combinations of options."""
    if not args.slices and len(args.paths) < 2:
        p.error("EXEMPLAR: found none, expected a photograph after the model")
    if args.slices and len(args.paths) > 1:
        p.error(f"--slices: found {len(args.paths)} exemplars, expected 1")
    args.model = None if args.slices else args.paths[0]
    args.photos = args.paths if args.slices else args.paths[1:]
    args.maps = maps_of_photographs(p, args)
    if args.size is not None and args.size < SMALLEST_PICTURE:
        p.error(f"--size: found {args.size}, expected at least {SMALLEST_PICTURE}")
    if args.crops < 1:
        p.error(f"--crops: found {args.crops}, expected at least 1")
    if args.resolution is not None and args.resolution < SMALLEST_PICTURE:
        p.error(f"--resolution: found {args.resolution}, expected at least {SMALLEST_PICTURE}")


def run(args: argparse.Namespace) -> None:
    with cli.optional_packages(PROGRAM, "evaluate"):
        import jinja2  # noqa: F401

        from solidtex_export.evaluation.comparison import Settings
        from solidtex_export.evaluation.evaluate import evaluate
    if args.pictures and args.pictures.exists() and not args.force:
        raise OutputError(f"{args.pictures}: found it, expected a new folder (--force adds to it)")
    for path, suffix in ((args.output, ".html"), (args.json, ".json"), (args.sheet, ".png")):
        if path is not None and path != STANDARD_OUTPUT:
            check_output(path, args.force, suffix)
    training = {}
    if args.model:
        document = model_file.read(args.model).document
        if document["channels"][0].startswith(PHASE_PREFIX):
            raise OutputError(
                f"{args.model}: found a model of phases, expected one of colors, which"
                f" {PROGRAM} compares; solidtex-measure {args.model} --exemplar {args.photos[0]}"
                " compares phases with their section"
            )
        training = document.get("training", {})
    photographs = zip(args.photos, args.maps, strict=True)
    exemplars = [load(path, maps, args, training) for path, maps in photographs]
    cli.print_notes(exemplars)
    check_alike(exemplars)
    side = args.size or training.get("size", DEFAULT_SIDE)
    symmetry = args.symmetry or training.get("symmetry", "none")
    settings = Settings(side, args.crops, symmetry, args.seed, args.inception, args.features)
    subject = make_subject(args, training, side)
    result = evaluate(subject, exemplars, settings)
    result.document["exemplars"] = [{"file": e.name, "sha256": e.sha256} for e in exemplars]
    if args.json == STANDARD_OUTPUT:
        cli.print_document(PROGRAM, result.document)
    else:
        print(summary(result))
    write(args, result, [e.name for e in exemplars])
    if args.sheet:
        from solidtex_export.evaluation.evaluate import sheet
        from solidtex_export.evaluation.report import png

        write_whole(args.sheet, png(sheet(subject, exemplars, side)))
        talk(args)(str(args.sheet))


def load(
    path: Path, maps: dict[str, Path], args: argparse.Namespace, training: dict[str, Any]
) -> Exemplar:
    """Load the photograph at the model's scale: one pixel is one texel."""
    resolution = args.resolution or training.get("resolution", UNLIMITED)
    trained = trained_record(path, training)
    crop = args.crop or (training.get("crop") if trained is not None else None)
    is_said = args.ranges or args.layer
    reading = cli.reading_of(args) if is_said else trained_reading(trained)
    needed = 2 * SMALLEST_PICTURE  # two crops side by side
    return load_exemplar(
        path, resolution, needed, tuple(crop) if crop else None, maps, reading=reading
    )


def trained_record(path: Path, training: dict[str, Any]) -> dict[str, Any] | None:
    """Record of this very file in the model's training configuration, if any."""
    sha256 = hashlib.sha256(path.read_bytes()).hexdigest() if path.is_file() else ""
    return next((e for e in training.get("exemplars", []) if e["sha256"] == sha256), None)


def trained_reading(record: dict[str, Any] | None) -> Reading:
    """How the training read a photograph; where it was given no range, that was the full one."""
    if record is None:
        return Reading()
    reading = Reading.of_record(record.get("reading", {}))
    return replace(reading, ranges={"": "full", **reading.ranges})


def make_subject(args: argparse.Namespace, training: dict[str, Any], side: int) -> Subject:
    if args.slices:
        return subjects.from_pictures(args.slices)
    compared = subjects.compared_views(training, len(args.photos))
    return subjects.from_model(args.model, 2 * side, args.seed, compared)


def summary(result: Evaluation) -> str:
    """One line per metric: the distance relative to self-distance, by view."""
    lines = []
    for group, distances in result.document["distances"].items():
        columns = {"overall": distances["overall"], **distances["views"]}
        lines.append(f"{group:<20}" + "".join(f"{name:>10}" for name in columns))
        for metric, title in distances["titles"].items():
            relative = [column[metric]["multiple"] for column in columns.values()]
            texts = ["-" if m is None else f"{m:.2f}" for m in relative]
            lines.append(f"  {title:<18}" + "".join(f"{text:>10}" for text in texts))
    return "\n".join(lines)


def talk(args: argparse.Namespace) -> Callable[[str], None]:
    """How names of written files are printed: as results, or as remarks beside the figures."""
    return cli.say if args.json == STANDARD_OUTPUT else print


def write(args: argparse.Namespace, result: Evaluation, exemplars: list[str]) -> None:
    """The JSON comes last: solidtex-fidelity takes it for a sign that all is there."""
    say = talk(args)
    if args.output:
        from solidtex_export.evaluation.report import render

        write_whole(args.output, render(result, exemplars).encode())
        say(str(args.output))
    if args.pictures:
        from solidtex_export.evaluation.report import png

        args.pictures.mkdir(parents=True, exist_ok=True)
        for name, picture in result.pictures.items():
            write_whole(args.pictures / f"{name.replace(' ', '-')}.png", png(picture))
        say(str(args.pictures))
    if args.json and args.json != STANDARD_OUTPUT:
        write_whole(args.json, (json.dumps(result.document, indent=1) + "\n").encode())
        print(args.json)


def main(arguments: list[str] | None = None) -> int:
    p = make_parser()

    def work(args: argparse.Namespace) -> None:
        check(p, args)
        run(args)

    failures = (*cli.FAILURES, ExemplarError, SubjectError, WeightsError)
    return cli.run(p, arguments, work, failures)


if __name__ == "__main__":
    sys.exit(main())
