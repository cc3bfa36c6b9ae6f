"""Writes the comparison page: Markdown and thumbnails, from the results of the cells."""

from __future__ import annotations

import io
import math
from pathlib import Path
from textwrap import fill

import numpy as np
from PIL import Image

from solidtex_export.evaluation.report import number
from solidtex_export.research.fidelity.cell import Cell
from solidtex_export.research.fidelity.outcome import Outcome, Outcomes, read_outcomes
from solidtex_export.research.fidelity.plan import CHOSEN, Entry, Plan
from solidtex_export.research.fidelity.summary import FEATURE_DISTANCE, WIDTH, summary
from solidtex_export.whole_file import write_whole

THUMBNAIL = 128  # pixels
GAP = 4
QUALITY = 85  # of JPEG
SHORT = {
    "binary_patterns": "LBP",
    "autocorrelation": "autocorr.",
    "fdmse": "FDMSE",
    "sliced_wasserstein": "Wasserstein",
    "spectrum": "spectrum",
    "sifid": "SIFID",
    "feature_distance": "features",
    "feature_sifid": "SIFID (SqueezeNet)",
}
OVERVIEWS = {
    "binary_patterns": "LBP distance",
    "spectrum": "Spectrum distance",
    FEATURE_DISTANCE: "Feature distance",
}
SOLID_COLUMNS = {
    "two_point": "two-point",
    "chords_bright": "chords, bright",
    "chords_dark": "chords, dark",
    "volume": "volume",
    "surface": "surface",
    "breadth": "breadth",
    "euler": "Euler",
}
INTRODUCTION = """\
`solidtex-fidelity {plan}` makes this page: it trains each preset for {budget} on each
exemplar. Distances of slices are relative to self-distance ([evaluation](evaluation.md)): at about
1 a slice is as close to the exemplar as another piece of the material. "copied" is the largest
coherence of a correspondence map. The images are the slice normal to x, and an oblique one. Errors
in three dimensions are explained in [solids](solids.md#statistics). Failed trainings stay in the
table.
"""


def write_table(path: Path, plan: Plan, plan_name: str, rows: list[list[Cell]]) -> None:
    """Write the page to `path`, its figures to a JSON file and its images to images/STEM beside it.

    `rows` has the cells by exemplar. The JSON file provides results that the cells' files lack.
    """
    images = path.parent / "images" / path.stem
    images.mkdir(parents=True, exist_ok=True)
    figures = path.with_suffix(".json")
    outcomes = read_outcomes(figures)
    for cell in (c for row in rows for c in row):
        outcomes.take(cell)
        if cell.finished:
            _save_pictures(cell, images)
    parts = [f"# {plan.title}\n"]
    for text in (INTRODUCTION.format(plan=plan_name, budget=plan.budget), plan.note):
        parts += [paragraph + "\n" for paragraph in _paragraphs(text)]
    parts.append(summary(plan, outcomes))
    parts += [overview(plan, outcomes, m) for m in OVERVIEWS if _is_measured(m, outcomes)]
    parts += [_section(plan, entry, outcomes, images.name) for entry in plan.exemplars]
    outcomes.write(figures)
    write_whole(path, ("\n".join(parts) + "\n").encode())


def _paragraphs(text: str) -> list[str]:
    """Paragraphs of Markdown prose, wrapped."""
    return [
        fill(paragraph, WIDTH, break_long_words=False, break_on_hyphens=False)
        for paragraph in text.split("\n\n")
        if paragraph.strip()
    ]


def _is_measured(metric: str, outcomes: Outcomes) -> bool:
    pairs = [outcome for row in outcomes.pairs.values() for outcome in row.values()]
    return any(metric in (outcome.multiples or {}) for outcome in pairs)


def overview(plan: Plan, outcomes: Outcomes, metric: str) -> str:
    """Table of one metric; the lowest of several values in a row is bold."""
    lines = [f"## {OVERVIEWS[metric]}\n", "| | " + " | ".join(plan.methods) + " |"]
    lines.append("|---|" + "---|" * len(plan.methods))
    for entry in plan.exemplars:
        found = outcomes.pairs.get(entry.name, {})
        multiples = {
            method: outcome.figures.get(metric)
            for method, outcome in found.items()
            if outcome.failure is None and method in plan.methods
        }
        lowest = min((m for m in multiples.values() if m is not None), default=None)
        texts = []
        for method in plan.methods:
            m = multiples.get(method)
            text = _state(found.get(method)) if m is None else f"{m:.2f}"
            is_best = len(multiples) > 1 and m is not None and m == lowest
            texts.append(f"**{text}**" if is_best else text)
        lines.append(f"| [{entry.name}](#{entry.name}) | " + " | ".join(texts) + " |")
    return "\n".join(lines) + "\n"


def _state(outcome: Outcome | None) -> str:
    if outcome is None:
        return "not trained"
    return "failed" if outcome.failure else "-"


def _section(plan: Plan, entry: Entry, outcomes: Outcomes, images: str) -> str:
    lines = [f"## {entry.name}\n"]
    found = outcomes.pairs.get(entry.name, {})
    trained = {m: found[m] for m in plan.methods if m in found and not found[m].failure}
    if trained:
        lines.append(f"![{entry.name}](images/{images}/{entry.name}.jpg)\n")
        lines += _metric_table(plan, entry, found, _metrics(trained), images)
        if entry.solid:
            lines += _solid_table(trained, outcomes.true_solids[entry.name])
    for method in (m for m in plan.methods if m in found):
        if words := found[method].failure:
            lines.append(f"{method} failed: `{words}`\n")
    return "\n".join(lines)


def _metrics(trained: dict[str, Outcome]) -> list[str]:
    """Metrics of all cells. Cells that were evaluated before a metric existed lack its value."""
    return [m for m in SHORT if any(m in outcome.figures for outcome in trained.values())]


def _metric_table(
    plan: Plan, entry: Entry, found: dict[str, Outcome], metrics: list[str], images: str
) -> list[str]:
    titles = ["", "minutes", "steps", *(SHORT[m] for m in metrics), "copied", "repeats", ""]
    lines = ["| " + " | ".join(titles) + " |", "|---" * len(titles) + "|"]
    for method in plan.methods:
        outcome = found.get(method)
        if outcome is None or outcome.failure:
            lines.append(f"| {method} | {_state(outcome)} |" + " |" * (len(titles) - 2))
            continue
        values = [outcome.figures.get(metric) for metric in metrics]
        is_chosen = plan.method(method).preset == CHOSEN and outcome.preset
        name = f"{method}: `{outcome.preset}`" if is_chosen else method
        texts = [name, f"{outcome.seconds / 60:.1f}", str(outcome.steps)]
        texts += ["-" if v is None else f"{v:.2f}" for v in values]
        texts += [f"{outcome.copied:.2f}", "yes" if outcome.repeats else "no"]
        texts.append(f"![{method}](images/{images}/{entry.name}-{method}.jpg)")
        lines.append("| " + " | ".join(texts) + " |")
    return [*lines, ""]


def _solid_table(trained: dict[str, Outcome], true: dict[str, float]) -> list[str]:
    rows = {method: outcome.solid or {} for method, outcome in trained.items()}
    rows["another block of the true solid"] = true
    lines = ["Errors in three dimensions:\n", "| | " + " | ".join(SOLID_COLUMNS.values()) + " |"]
    lines.append("|---" * (len(SOLID_COLUMNS) + 1) + "|")
    for name, found in rows.items():
        values = [found[key] for key in SOLID_COLUMNS]
        texts = ["no phase" if math.isinf(v) else number(v) for v in values]
        lines.append(f"| {name} | " + " | ".join(texts) + " |")
    return [*lines, ""]


def _save_pictures(cell: Cell, images: Path) -> None:
    pictures = cell.folder / "pictures"
    _save([pictures / "exemplar-0.png"], images / f"{cell.entry.name}.jpg")
    views = [pictures / f"slice-{view}.png" for view in ("x", "oblique")]
    _save(views, images / f"{cell.entry.name}-{cell.method}.jpg")


def _save(files: list[Path], path: Path) -> None:
    """Write a strip of images, cropped to thumbnails."""
    pictures = [np.asarray(Image.open(f).convert("RGB"))[:THUMBNAIL, :THUMBNAIL] for f in files]
    sheet = Image.new("RGB", (len(files) * (THUMBNAIL + GAP) - GAP, THUMBNAIL), "white")
    for index, picture in enumerate(pictures):
        sheet.paste(Image.fromarray(picture), (index * (THUMBNAIL + GAP), 0))
    data = io.BytesIO()
    sheet.save(data, "JPEG", quality=QUALITY)
    write_whole(path, data.getvalue())
