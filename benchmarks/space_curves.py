"""Quality over training time from nothing, from a texture space and from a learned start.

Each case is one training of one photograph, limited by the processor's seconds of its steps, as
solidtex-train runs it with --minutes. The model is exported and compared with the photograph.
docs/experiments/spaces-curves.md has the results.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import json
import shutil
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from PIL import Image

from solidtex_export.analysis.grain import channel_axes, whiten
from solidtex_export.commands import cli
from solidtex_export.commands.export import build_model
from solidtex_export.commands.train import make_trainer
from solidtex_export.commands.train_options import parser as train_parser
from solidtex_export.commands.train_options import request_of
from solidtex_export.evaluation.comparison import Reference, Settings
from solidtex_export.evaluation.subjects import compared_views, from_model
from solidtex_export.export.file_format import model_file
from solidtex_export.export.training_result import read_result
from solidtex_export.images.sheet import sheet_of_rows
from solidtex_export.losses.descriptor.weights import PROCEDURAL, load_weights
from solidtex_export.losses.learned import LearnedDescriptor
from solidtex_export.whole_file import write_whole

PROGRAM = "space_curves.py"
NOTHING = "nothing"
SIDE = 96  # texels: crops that are compared
SLICE = 2 * SIDE
SHOWN = 128  # texels of a slice on the sheet
WORST = 0.1  # share of the photographs in the second mean
METRICS = {"binary_patterns": "LBP distance", "feature_distance": "feature distance"}

EXAMPLES = f"""  {PROGRAM} validation/*.jpg --space stones.solidtex-space -o curves
  {PROGRAM} rock.jpg --space results/stones --start results/start --seconds 0 60 -o curves
  {PROGRAM} --summary -o curves

The same command again continues; several may write to one folder with different photographs."""


@dataclass(frozen=True)
class Case:
    """One training: name of the start, options of solidtex-train, seconds."""

    photo: Path
    start: str
    options: tuple[str, ...]
    seconds: float

    def folder(self, output: Path) -> Path:
        return output / self.photo.stem / self.start / f"{self.seconds:g}"


def main(arguments: list[str] | None = None) -> int:
    return cli.run(make_parser(), arguments, measure_all)


def make_parser() -> argparse.ArgumentParser:
    p = cli.parser(PROGRAM, __doc__ or "", EXAMPLES, has_json=False)
    p.add_argument("photos", metavar="PHOTO", nargs="*", type=Path)
    p.add_argument("-o", dest="output", metavar="FOLDER", type=Path, required=True)
    p.add_argument("--space", metavar="SPACE", help="adds trainings from a texture space")
    p.add_argument("--start", metavar="START", help="adds trainings from a learned start")
    p.add_argument("--preset", nargs="+", default=[], metavar="NAME",
                   help="further presets for --space, each a start of its own")  # fmt: skip
    p.add_argument("--seconds", nargs="+", type=float, default=[0, 15, 30, 60, 120, 600])
    p.add_argument("--options", default="", metavar="TEXT",
                   help='further options of solidtex-train, such as "--size 96"')  # fmt: skip
    p.add_argument("--features", type=Path, metavar="FILE",
                   help="weights of SqueezeNet, for the feature distance")  # fmt: skip
    p.add_argument("--threads", type=int, default=1, help="CPU threads (default: 1)")
    p.add_argument("--summary", action="store_true", help="only write tables and the sheet again")
    return p


def measure_all(args: argparse.Namespace) -> None:
    torch.set_num_threads(args.threads)
    for photo in () if args.summary else args.photos:
        for case in cases(photo, args):
            if not (case.folder(args.output) / "figures.json").exists():
                measure(case, args)
        summarize(args.output)
    summarize(args.output)
    print(f"{args.output}: look at curves.md and sheet.png")


def cases(photo: Path, args: argparse.Namespace) -> list[Case]:
    more = tuple(args.options.split())
    starts = {NOTHING: more}
    if args.space:
        starts["space"] = ("--space", args.space, *more)
        starts |= {p: ("--space", args.space, "--preset", p, *more) for p in args.preset}
    if args.start:
        starts["start"] = ("--start", args.start, *more)
    return [
        Case(photo, name, options, seconds)
        for name, options in starts.items()
        for seconds in sorted(args.seconds)
        if seconds or name != NOTHING
    ]


def measure(case: Case, args: argparse.Namespace) -> None:
    folder = case.folder(args.output)
    shutil.rmtree(folder, ignore_errors=True)
    result = folder / "result"
    folder.mkdir(parents=True)
    setup = time.process_time()
    trainer = begin(case, result)
    setup = time.process_time() - setup
    trainer.run(lambda: case.seconds == 0, lambda _: None)
    trained = read_result(result)
    path = folder / "model.solidtex"
    model_file.write(path, build_model(trained, case.photo.stem, None))
    config = trained.config
    figures: dict[str, Any] = {"preset": config["preset"], "setup": round(setup, 2)}
    figures |= {"steps": trainer.step, "seconds": round(trainer.seconds, 2)}
    figures |= compared(path, trainer.originals[0], config, args.features, folder)
    write_whole(folder / "figures.json", json.dumps(figures, indent=1).encode())
    shutil.rmtree(result)
    print(f"{case.photo.stem} {case.start} {case.seconds:g} s: {figures}", flush=True)


def begin(case: Case, result: Path) -> Any:
    """The trainer of a case. With zero seconds it makes no step."""
    command = [str(case.photo), "-o", str(result), *case.options, "--clock", "processor"]
    return trainer_of(*command, "--minutes", str(max(case.seconds, 1) / 60))


def trainer_of(*command: str) -> Any:
    """The trainer of a command line of solidtex-train, on the processor, without its talk."""
    p = train_parser()
    args = p.parse_args([*command, "--device", "cpu"])
    with contextlib.redirect_stderr(io.StringIO()):
        return make_trainer(request_of(p, args), args.result, use_cuda=False, compiled=False)


def compared(
    path: Path, exemplar: Any, config: dict[str, Any], features: Path | None, folder: Path
) -> dict[str, Any]:
    """Distances of axis slices and of oblique ones to the photograph."""
    image = exemplar.image.permute(1, 2, 0).numpy().astype(np.float64)
    reference = Reference(image, Settings(side=SIDE, features=features, metrics=tuple(METRICS)))
    descriptor, (mean, basis) = (
        LearnedDescriptor(load_weights(PROCEDURAL)),
        channel_axes([exemplar]),
    )
    whole = whiten(exemplar.image, mean, basis)[None]
    subject = from_model(path, SLICE, 0, compared_views(config, 1))
    save_slices(subject, exemplar, folder)
    axes = [p for v in subject.views for p in v.pictures if v.name in config["directions"]]
    oblique = [p for v in subject.views for p in v.pictures if v.name == "oblique"]
    found: dict[str, Any] = {}
    for name, pictures in (("axes", axes), ("oblique", oblique)):
        pictures = [np.clip(p, 0, 1) for p in pictures]
        for metric, distance in reference.distances(pictures).items():
            found[f"{metric} {name}"] = distance.multiple
        torch.manual_seed(0)
        with torch.no_grad():
            slices = [torch.from_numpy(np.moveaxis(p, 2, 0).copy()).float() for p in pictures]
            y = torch.stack([whiten(s, mean, basis) for s in slices])
            found[f"descriptor {name}"] = float(descriptor.distance(y, descriptor.measure(whole)))
    return found


def save_slices(subject: Any, exemplar: Any, folder: Path) -> None:
    slices = {
        view.name: view.pictures[0] for view in subject.views if view.name in ("x", "oblique")
    }
    slices["photograph"] = exemplar.image.permute(1, 2, 0).numpy()
    for name, picture in slices.items():
        cut = np.clip(picture[:SHOWN, :SHOWN], 0, 1)
        Image.fromarray(np.rint(255 * cut).astype(np.uint8)).save(folder / f"{name}.png")


def summarize(output: Path) -> None:
    """Write curves.md, curves.json and sheet.png of all cases that are measured."""
    found: dict[str, dict[tuple[str, float], dict[str, Any]]] = {}
    for file in sorted(output.glob("*/*/*/figures.json")):
        photo, start, seconds = file.parts[-4:-1]
        found.setdefault(photo, {})[start, float(seconds)] = json.loads(file.read_text())
    cases = sorted({case for figures in found.values() for case in figures})
    whole = {p: figures for p, figures in found.items() if len(figures) == len(cases)}
    if not whole:
        return
    names = [n for n, v in next(iter(whole.values()))[cases[0]].items() if is_distance(n, v)]
    rows = []
    for case in cases:
        values = {n: [figures[case][n] for figures in whole.values()] for n in names}
        rows.append(
            {"start": case[0], "seconds": case[1]} | {n: means(v) for n, v in values.items()}
        )
    write_whole(output / "curves.json", json.dumps(rows, indent=1).encode())
    lines = [f"{len(whole)} photographs; mean, and mean of the worst tenth.", ""]
    lines += ["| start | seconds | " + " | ".join(names) + " |"]
    lines += ["|---|---|" + "---|" * len(names)]
    for row in rows:
        cells = [f"{row[n][0]:.3g}, {row[n][1]:.3g}" for n in names]
        lines.append(f"| {row['start']} | {row['seconds']:g} | " + " | ".join(cells) + " |")
    write_whole(output / "curves.md", ("\n".join(lines) + "\n").encode())
    save_sheet(output, sorted(whole), cases)


def is_distance(name: str, value: object) -> bool:
    return isinstance(value, float) and name not in ("setup", "seconds")


def means(values: Sequence[float]) -> tuple[float, float]:
    count = max(1, round(WORST * len(values)))
    return float(np.mean(values)), float(np.mean(sorted(values)[-count:]))


def save_sheet(output: Path, photos: Sequence[str], cases: Sequence[tuple[str, float]]) -> None:
    """A row for each photograph: itself, then a slice of each case, in the order of the table."""
    images = []
    for photo in photos:
        folders = [output / photo / start / f"{seconds:g}" for start, seconds in cases]
        files = [folders[0] / "photograph.png", *(f / "x.png" for f in folders)]
        images += [torch.from_numpy(np.array(Image.open(f)) / 255).movedim(2, 0) for f in files]
    sheet = sheet_of_rows(images, 1 + len(cases)).movedim(0, 2).numpy()
    Image.fromarray(np.rint(255 * sheet).astype(np.uint8)).save(output / "sheet.png")


if __name__ == "__main__":
    sys.exit(main())
