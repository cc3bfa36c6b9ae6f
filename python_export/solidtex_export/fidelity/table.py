"""The page that compares: Markdown and small pictures, from the files that the cells left."""

from __future__ import annotations

import io
import json
import math
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from solidtex_export.evaluation.report import number
from solidtex_export.fidelity.cell import Cell
from solidtex_export.fidelity.plan import Plan
from solidtex_export.file_format import model_file
from solidtex_export.whole_file import write_whole

THUMBNAIL = 128  # pixels
GAP = 4
QUALITY = 85  # of JPEG
SHORT = {
    "binary_patterns": "patterns",
    "autocorrelation": "autocorr.",
    "fdmse": "FDMSE",
    "sliced_wasserstein": "Wasserstein",
    "sifid": "SIFID",
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
INTRODUCTION = """# Fidelity of the methods

Made by `solidtex-fidelity {plan}`: each method trained {minutes:g} minutes on each exemplar.
Figures of slices are multiples of the exemplar's distance to itself ([evaluation](evaluation.md)):
about 1 is as good as another piece of the material. "copied" is the largest coherence of a
correspondence map. Pictures: the slice normal to x, and an oblique one. Errors in three dimensions:
[solids](solids.md#statistics). Failures are results too, and stay in the table.
"""


def write_table(path: Path, plan: Plan, plan_name: str, rows: list[list[Cell]]) -> None:
    """The page at `path`, pictures in images/STEM beside it; `rows` has the cells by exemplar."""
    images = path.parent / "images" / path.stem
    images.mkdir(parents=True, exist_ok=True)
    parts = [INTRODUCTION.format(plan=plan_name, minutes=plan.minutes)]
    parts += [plan.note + "\n"] if plan.note else []
    parts.append(_overview(plan, rows))
    parts += [_section(cells, images) for cells in rows]
    write_whole(path, ("\n".join(parts) + "\n").encode())


def _overview(plan: Plan, rows: list[list[Cell]]) -> str:
    """Binary patterns of all; the lowest of each row in bold."""
    lines = ["## Binary patterns of all\n", "| | " + " | ".join(plan.methods) + " |"]
    lines.append("|---|" + "---|" * len(plan.methods))
    for cells in rows:
        multiples = [_multiple(cell) for cell in cells]
        lowest = min((m for m in multiples if m is not None), default=None)
        texts = [
            _state(cell) if m is None else f"{m:.2f}"
            for cell, m in zip(cells, multiples, strict=True)
        ]
        marked = [
            f"**{t}**" if m is not None and m == lowest else t
            for t, m in zip(texts, multiples, strict=True)
        ]
        name = cells[0].entry.name
        lines.append(f"| [{name}](#{name}) | " + " | ".join(marked) + " |")
    return "\n".join(lines) + "\n"


def _multiple(cell: Cell) -> float | None:
    return _distances(cell)["binary_patterns"]["multiple"] if cell.finished else None


def _distances(cell: Cell) -> dict[str, Any]:
    """Of the colours, or of the first group of channels."""
    groups = json.loads(cell.judgement.read_text())["distances"]
    return next(iter(groups.values()))["overall"]


def _state(cell: Cell) -> str:
    if cell.failure.exists():
        return "failed"
    return "-" if cell.finished else "not trained"


def _section(cells: list[Cell], images: Path) -> str:
    entry = cells[0].entry
    lines = [f"## {entry.name}\n"]
    done = [cell for cell in cells if cell.finished]
    if done:
        file = images / f"{entry.name}.jpg"
        _save([done[0].folder / "pictures" / "exemplar-0.png"], file)
        lines.append(f"![{entry.name}](images/{images.name}/{file.name})\n")
        lines += _judgements(cells, images)
        lines += _solid_table(done) if entry.solid else []
    for cell in cells:
        if cell.failure.exists():
            words = " ".join(cell.failure.read_text().split())
            lines.append(f"{cell.method} failed: `{words[-300:]}`\n")
    return "\n".join(lines)


def _judgements(cells: list[Cell], images: Path) -> list[str]:
    metrics = list(_distances(next(c for c in cells if c.finished)))
    titles = ["", "minutes", "steps", *(SHORT[m] for m in metrics), "copied", "repeats", ""]
    lines = ["| " + " | ".join(titles) + " |", "|---" * len(titles) + "|"]
    for cell in cells:
        if not cell.finished:
            lines.append(f"| {cell.method} | {_state(cell)} |" + " |" * (len(titles) - 2))
            continue
        picture = images / f"{cell.entry.name}-{cell.method}.jpg"
        views = [cell.folder / "pictures" / f"slice-{view}.png" for view in ("x", "oblique")]
        _save(views, picture)
        texts = [cell.method, *_effort(cell), *_figures(cell, metrics)]
        texts.append(f"![{cell.method}](images/{images.name}/{picture.name})")
        lines.append("| " + " | ".join(texts) + " |")
    return [*lines, ""]


def _effort(cell: Cell) -> list[str]:
    training = model_file.read(cell.model).document["training"]
    return [f"{training['seconds'] / 60:.1f}", str(training["step"])]


def _figures(cell: Cell, metrics: list[str]) -> list[str]:
    document = json.loads(cell.judgement.read_text())
    multiples = [_distances(cell)[metric]["multiple"] for metric in metrics]
    texts = ["-" if m is None else f"{m:.2f}" for m in multiples]
    copied = max(document["copying"]["views"].values())
    tests = [document["repetition"][key] for key in ("block", "far blocks")]
    repeats = any(found and found["repeats"] for found in tests)
    return [*texts, f"{copied:.2f}", "yes" if repeats else "no"]


def _solid_table(cells: list[Cell]) -> list[str]:
    errors = {cell.method: json.loads(cell.solid_errors.read_text()) for cell in cells}
    rows = {method: found["model"] for method, found in errors.items()}
    rows["another block of the true solid"] = next(iter(errors.values()))["true"]
    lines = ["Errors in three dimensions:\n", "| | " + " | ".join(SOLID_COLUMNS.values()) + " |"]
    lines.append("|---" * (len(SOLID_COLUMNS) + 1) + "|")
    for name, found in rows.items():
        values = [found[key] for key in SOLID_COLUMNS]
        texts = ["no phase" if math.isinf(v) else number(v) for v in values]
        lines.append(f"| {name} | " + " | ".join(texts) + " |")
    return [*lines, ""]


def _save(files: list[Path], path: Path) -> None:
    """Pictures side by side, cut to thumbnails."""
    pictures = [np.asarray(Image.open(f).convert("RGB"))[:THUMBNAIL, :THUMBNAIL] for f in files]
    sheet = Image.new("RGB", (len(files) * (THUMBNAIL + GAP) - GAP, THUMBNAIL), "white")
    for index, picture in enumerate(pictures):
        sheet.paste(Image.fromarray(picture), (index * (THUMBNAIL + GAP), 0))
    data = io.BytesIO()
    sheet.save(data, "JPEG", quality=QUALITY)
    write_whole(path, data.getvalue())
