"""Measures the tables and figure 6 of GramGAN 2020 on our models, by SqueezeNet's features."""

from __future__ import annotations

import argparse
import csv
import json
import subprocess
import sys
from collections.abc import Iterable
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path

import numpy as np
import torch
from PIL import Image, ImageDraw
from scipy.stats import rankdata, wilcoxon

from solidtex_export.commands import cli
from solidtex_export.evaluation.metrics import standard_metrics
from solidtex_export.evaluation.metrics.features import FeatureSifid
from solidtex_export.evaluation.metrics.parzen import ParzenWindows
from solidtex_export.evaluation.pictures import to_8_bit
from solidtex_export.evaluation.report import png
from solidtex_export.evaluation.subjects import oblique_slice, values
from solidtex_export.export.file_format import model_file
from solidtex_export.export.verification import engine
from solidtex_export.export.verification.model_output import OutputError
from solidtex_export.images.exemplar import load_exemplar
from solidtex_export.images.file_kinds import ExemplarError
from solidtex_export.images.sheet import sheet_of_rows
from solidtex_export.networks.squeezenet import WeightsError, load_squeezenet
from solidtex_export.whole_file import write_whole

PROGRAM = "space_tables.py"
STONES = ("granite", "gravel", "ground", "marble", "rock", "soil", "concrete", "plaster")
PATCHES = 22
LEAST = 128  # pixels: side of the smallest exemplar
KERNEL = 8  # pixels: side of the patches of the likelihood
GAP, LABEL = 4, 26
SHOWN = 6  # patches in a picture

EXAMPLES = f"""  solidtex-fidelity benchmarks/space_table_1.toml --photos photographs \\
      -o results/variants
  {PROGRAM} variants results/variants --features squeezenet.safetensors
  {PROGRAM} patches photographs -o results/held-out
  {PROGRAM} encode results/held-out stones=models/stones.solidtex-space
  {PROGRAM} held-out results/held-out --features squeezenet.safetensors
  {PROGRAM} sheet stone.jpg encoded=a.solidtex critic=b.solidtex -o figure-6.png --features ..."""


def make_parser() -> argparse.ArgumentParser:
    p = cli.parser(PROGRAM, __doc__ or "", EXAMPLES, has_json=False)
    commands = p.add_subparsers(dest="command", required=True)

    def command(name: str, text: str) -> argparse.ArgumentParser:
        return commands.add_parser(name, help=text, description=text)

    def measuring(p: argparse.ArgumentParser) -> None:
        p.add_argument("--features", metavar="FILE", type=Path, required=True,
                       help="weights of SqueezeNet v1.0")  # fmt: skip
        p.add_argument("--slices", metavar="N", type=int, default=50,
                       help="slices of each model, each of its own seed (default: 50)")  # fmt: skip
        p.add_argument("--upright", action="store_true",
                       help="cut slices that contain z, the grain of woods (default: of models"
                       " trained with --directions xy)")  # fmt: skip

    one = command("variants", "table 1: SIFID of randomly oriented slices")
    one.add_argument("folder", type=Path, help="results of solidtex-fidelity")
    measuring(one)
    cut = command("patches", "cut the patches of table 2, and other crops as ground truth")
    cut.add_argument("photographs", type=Path, help="folder with SOURCES.csv and validation/")
    cut.add_argument("--side", type=int, default=128, metavar="N",
                     help="side of a patch in pixels; photographs of less than twice that are"
                     " left out (default: 128)")  # fmt: skip
    cut.add_argument("-o", dest="folder", type=Path, required=True, help="folder to write")
    encode = command("encode", "make a model of every patch by a space")
    encode.add_argument("folder", type=Path, help="what patches wrote")
    encode.add_argument("spaces", metavar="LABEL=SPACE", nargs="+", type=labeled)
    encode.add_argument("--patches", default="average", metavar="KIND",
                        help="code of a patch: average or medoid (default: average)")  # fmt: skip
    encode.add_argument("--program", default="solidtex-encode", help="path of solidtex-encode")
    two = command("held-out", "table 2: patches beside the models in FOLDER/models/LABEL")
    two.add_argument("folder", type=Path, help="what patches and encode wrote")
    measuring(two)
    two.add_argument("--picture", metavar="PNG", type=Path,
                     help="also show patches, from nearest to farthest by the last method: patch,"
                     " ground truth, a slice of each method")  # fmt: skip
    sheet = command("sheet", "figure 6: an exemplar beside a slice of each model, with SIFID")
    sheet.add_argument("exemplar", type=Path)
    sheet.add_argument("models", metavar="LABEL=MODEL", nargs="+", type=labeled)
    sheet.add_argument("-o", dest="output", metavar="PNG", type=Path, required=True)
    sheet.add_argument("--resolution", type=int, default=256, metavar="N",
                       help="reduce the exemplar to a shorter side of N pixels (default: 256)"
                       )  # fmt: skip
    measuring(sheet)
    return p


def labeled(text: str) -> tuple[str, Path]:
    label, equals, file = text.partition("=")
    if not equals or not label:
        raise argparse.ArgumentTypeError(f"found {text}, expected LABEL=FILE")
    return label, Path(file)


def random_slices(model: Path, args: argparse.Namespace, side: int) -> np.ndarray:
    """Randomly oriented slices [slice, row, column, channel], each of another seed and place.

    They contain z if --upright says so, or the model's training: encoded models do not tell.
    """
    training = model_file.read(model).document.get("training", {})
    upright = args.upright or "z" not in training.get("directions", "xyz")
    rng = np.random.default_rng(0)
    found = []
    for seed in range(args.slices):
        if upright:
            angle = rng.uniform(0, 2 * np.pi)
            right, down = np.array([np.cos(angle), np.sin(angle), 0]), np.array([0, 0, -1.0])
        else:
            right, down = np.linalg.qr(rng.standard_normal((3, 3)))[0][:2]
        with engine.open_model(model, seed) as texture:
            found.append(oblique_slice(texture, right, down, side, rng)[..., :3])
    return to_8_bit(np.stack(found))


def photograph(path: Path, resolution: int) -> np.ndarray:
    """An image [row, column, 3] of 0 ... 1."""
    return to_8_bit(values(load_exemplar(path, resolution, LEAST)))[..., :3]


def mean_and_deviation(figures: Iterable[float], digits: int = 2) -> str:
    found = list(figures)
    return f"{np.mean(found):.{digits}f} ± {np.std(found):.{digits}f}"


def sifid_of_slices(metric: FeatureSifid, exemplar: np.ndarray, slices: np.ndarray) -> list[float]:
    truth = metric.features(exemplar[None])
    return [metric.distance(truth, [moments]) for moments in metric.features(slices)]


def variants(args: argparse.Namespace) -> None:
    """Table 1: rows are exemplars, columns the methods in the folder."""
    metric = FeatureSifid(load_squeezenet(args.features))
    models = sorted(args.folder.glob("*/*/model.solidtex"))
    if not models:
        raise OutputError(f"{args.folder}: found no models, expected results of solidtex-fidelity")
    rows: dict[str, dict[str, str]] = {}
    for model in models:
        config = json.loads((model.parent / "result" / "config.json").read_text())
        stored = model.parent / "result" / "exemplar-0.png"
        exemplar = photograph(stored, config["resolution"])
        slices = random_slices(model, args, min(exemplar.shape[:2]))
        found = mean_and_deviation(sifid_of_slices(metric, exemplar, slices))
        rows.setdefault(model.parent.parent.name, {})[model.parent.name] = found
    columns = sorted({name for row in rows.values() for name in row})
    print_table(f"SIFID, {args.slices} slices", columns, rows)


def print_table(corner: str, columns: list[str], rows: dict[str, dict[str, str]]) -> None:
    print(f"| {corner} | " + " | ".join(columns) + " |")
    print("|---" * (len(columns) + 1) + "|")
    for name, row in rows.items():
        print(f"| {name} | " + " | ".join(row.get(column, "-") for column in columns) + " |")


def patches(args: argparse.Namespace) -> None:
    """Write FOLDER/patches/NAME.png and, from another part of the photograph, truth/NAME.png."""
    photographs = args.photographs / "validation"
    with (args.photographs / "SOURCES.csv").open(newline="", encoding="utf-8") as file:
        rows = [row for row in csv.DictReader(file) if row["split"] == "validation"]
    side = args.side
    stones = sorted(row["file"] for row in rows if row["category"] in STONES)
    names = [name for name in stones if shorter_side(photographs / name) >= 2 * side]
    if len(names) < PATCHES:
        raise OutputError(f"{args.photographs}: found {len(names)} stones, expected {PATCHES}")
    for index in np.linspace(0, len(names) - 1, PATCHES).round().astype(int):
        image = photograph(photographs / names[index], 2 * side)
        name = f"{Path(names[index]).stem}.png"
        first, second = image[:side, :side], image[-side:, -side:]
        for folder, crop in (("patches", first), ("truth", second)):
            (args.folder / folder).mkdir(parents=True, exist_ok=True)
            write_whole(args.folder / folder / name, png(crop))


def shorter_side(path: Path) -> int:
    with Image.open(path) as image:
        return min(image.size)


def encode(args: argparse.Namespace) -> None:
    for label, space in args.spaces:
        folder = args.folder / "models" / label
        folder.mkdir(parents=True, exist_ok=True)
        for patch in patches_of(args.folder):
            model = folder / f"{patch.stem}.solidtex"
            if not model.exists():
                command = [args.program, patch, "--space", space, "--patches", args.patches]
                subprocess.run([*command, "-o", model], check=True)


def patches_of(folder: Path) -> list[Path]:
    found = sorted((folder / "patches").glob("*.png"))
    if not found:
        raise OutputError(f"{folder}: found no patches, expected what the command patches wrote")
    return found


@dataclass
class Column:
    """Figures of one method, by measure, and an image, in the order of the patches."""

    figures: dict[str, list[float]]
    images: list[np.ndarray] = field(default_factory=list)

    def add(self, measure: str, value: float) -> None:
        self.figures.setdefault(measure, []).append(value)


def held_out(args: argparse.Namespace) -> None:
    """Table 2: the mean over patches of each measure; a method's figure of a patch is the mean over
    its slices. Ranks by the feature distance stand for those of the user study.
    """
    columns = {"ground truth": Column({})}
    labels = sorted(p.name for p in (args.folder / "models").glob("*") if p.is_dir())
    columns |= {label: Column({}) for label in labels}
    titles: dict[str, str] = {}
    for patch in patches_of(args.folder):
        side = shorter_side(patch)
        reference = photograph(patch, side)
        truth = photograph(args.folder / "truth" / patch.name, side)
        metrics = standard_metrics(reference, features=args.features)
        titles |= {metric.name: metric.title for metric in metrics}
        windows = ParzenWindows(reference[None], truth[None], KERNEL)
        for label, column in columns.items():
            if label == "ground truth":
                crops = truth[None]
            else:
                model = args.folder / "models" / label / f"{patch.stem}.solidtex"
                crops = random_slices(model, args, side)
            column.images.append(crops[0])
            for metric in metrics:
                wanted = metric.features(reference[None])
                found = [metric.distance(wanted, metric.features(crop[None])) for crop in crops]
                column.add(metric.name, float(np.mean(found)))
            likelihoods = [windows.average_log_likelihood(crop[None]) for crop in crops]
            column.add("likelihood", float(np.mean(likelihoods)))
    ranks = rankdata([c.figures["feature_distance"] for c in columns.values()], axis=0)
    for column, row in zip(columns.values(), ranks, strict=True):
        column.figures["rank"] = list(row)
    titles |= {"likelihood": "average log-likelihood", "rank": "rank by feature distance"}
    rows = {
        title: {n: mean_and_deviation(c.figures[m], 3) for n, c in columns.items()}
        for m, title in titles.items()
    }
    print_table(f"{len(patches_of(args.folder))} patches", list(columns), rows)
    if args.picture:
        show_patches(args, columns)
    for first, second in pairwise(labels):
        a, b = (columns[label].figures["feature_distance"] for label in (first, second))
        p = wilcoxon(np.log(a), np.log(b)).pvalue
        print(f"\n{first} and {second}, feature distance: Wilcoxon's p = {p:.2g}")


def show_patches(args: argparse.Namespace, columns: dict[str, Column]) -> None:
    """A column for each shown patch, a row for the patches and one for each method."""
    names = patches_of(args.folder)
    order = np.argsort(list(columns.values())[-1].figures["feature_distance"])
    shown = order[np.linspace(0, len(order) - 1, min(SHOWN, len(order))).round().astype(int)]
    rows = [[photograph(names[i], shorter_side(names[i])) for i in shown]]
    rows += [[column.images[i] for i in shown] for column in columns.values()]
    images = [torch.from_numpy(i).permute(2, 0, 1) for row in rows for i in row]
    picture = sheet_of_rows(images, len(shown)).permute(1, 2, 0)
    write_whole(args.picture, png(picture.numpy()))
    print(f"\n{args.picture}: {', '.join(['patches', *columns])};"
          f" {', '.join(names[i].stem for i in shown)}")  # fmt: skip


def sheet(args: argparse.Namespace) -> None:
    """Figure 6: one column for the exemplar and each model, SIFID below the label."""
    metric = FeatureSifid(load_squeezenet(args.features))
    exemplar = photograph(args.exemplar, args.resolution)
    side = min(exemplar.shape[:2])
    shown = [("exemplar", "", exemplar[:side, :side])]
    for label, model in args.models:
        slices = random_slices(model, args, side)
        found = mean_and_deviation(sifid_of_slices(metric, exemplar, slices))
        print(f"{label}: SIFID {found}")
        shown.append((label, f"SIFID {found}", slices[0]))
    picture = Image.new("RGB", (len(shown) * (side + GAP) - GAP, side + LABEL), "white")
    draw = ImageDraw.Draw(picture)
    for index, (label, text, image) in enumerate(shown):
        left = index * (side + GAP)
        draw.text((left, 0), f"{label}\n{text}", fill="black")
        pixels = np.rint(image * 255).astype(np.uint8)
        picture.paste(Image.fromarray(pixels), (left, LABEL))
    picture.save(args.output)
    print(args.output)


def run(args: argparse.Namespace) -> None:
    {"variants": variants, "patches": patches, "encode": encode, "held-out": held_out,
     "sheet": sheet}[args.command](args)  # fmt: skip


def main(arguments: list[str] | None = None) -> int:
    failures = (*cli.FAILURES, WeightsError, ExemplarError, subprocess.CalledProcessError)
    return cli.run(make_parser(), arguments, run, failures)


if __name__ == "__main__":
    sys.exit(main())
