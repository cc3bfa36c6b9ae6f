"""Results of each pair of exemplar and preset: the figures of the page, kept in a JSON file.

The file stands beside the page. The page can grow from command to command while models, reports and
full images, which are large, are kept elsewhere or deleted.
"""

from __future__ import annotations

import json
import math
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from solidtex_export.export.file_format import model_file
from solidtex_export.export.verification.model_output import OutputError
from solidtex_export.research.fidelity.cell import Cell
from solidtex_export.training.result import first_difference
from solidtex_export.whole_file import write_whole


@dataclass(frozen=True)
class Outcome:
    """Result of one pair: either `failure` or all the others.

    `multiples`: distance of all slices by metric, relative to self-distance; `axes` and `oblique`:
    the same of axis slices and of oblique ones; `copied`: the largest coherence of a
    correspondence map; `solid`: errors of the 3D statistics, by statistic; `training`: what the
    plan said about it; `preset`: the one that was trained.
    """

    failure: str | None = None
    seconds: float = 0.0
    steps: int = 0
    multiples: dict[str, float | None] | None = None
    axes: dict[str, float | None] | None = None
    oblique: dict[str, float | None] | None = None
    copied: float = 0.0
    repeats: bool = False
    solid: dict[str, float] | None = None
    training: dict[str, Any] | None = None
    preset: str | None = None

    @property
    def figures(self) -> dict[str, float | None]:
        assert self.multiples is not None
        return self.multiples


@dataclass
class Outcomes:
    """All results, and the errors of a second block of each true solid."""

    pairs: dict[str, dict[str, Outcome]]
    """Exemplar -> preset -> result."""
    true_solids: dict[str, dict[str, float]]

    def of(self, cell: Cell) -> Outcome | None:
        return self.pairs.get(cell.entry.name, {}).get(cell.method)

    def take(self, cell: Cell) -> None:
        """Add the results in the cell's files, if it was run."""
        if cell.failure.exists():
            words = " ".join(cell.failure.read_text().split())
            self._set(cell, Outcome(failure=words))
        elif cell.finished:
            self._set(cell, _outcome(cell))
            if cell.entry.solid:
                self.true_solids[cell.entry.name] = _solid_errors(cell)["true"]

    def _set(self, cell: Cell, outcome: Outcome) -> None:
        self.pairs.setdefault(cell.entry.name, {})[cell.method] = outcome

    def write(self, path: Path) -> None:
        pairs = {
            exemplar: {method: asdict(o) for method, o in row.items()}
            for exemplar, row in self.pairs.items()
        }
        document = {"pairs": pairs, "true_solids": self.true_solids}
        write_whole(path, (json.dumps(_plain(document), indent=1) + "\n").encode())


def read_outcomes(path: Path) -> Outcomes:
    """Read a file that `write` made; empty if there is none."""
    if not path.exists():
        return Outcomes({}, {})
    try:
        document = json.loads(path.read_text())
        pairs = {
            exemplar: {method: _restored(values) for method, values in row.items()}
            for exemplar, row in document["pairs"].items()
        }
        solids = {name: _infinite(v) for name, v in document["true_solids"].items()}
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise OutputError(
            f"{path}: found no outcomes ({error}), expected what {path.stem}.md was made from"
        ) from error
    return Outcomes(pairs, solids)


def check_folder(cell: Cell) -> None:
    """Refuse results in the folder of a pair about which the plan says something else."""
    if difference := _difference(cell.trained_by, cell):
        raise OutputError(
            f"{cell.folder}: {difference}, as the plan says; choose another -o, or delete this"
            " folder and train it with --again"
        )


def check_outcome(cell: Cell, outcome: Outcome | None, figures: Path) -> None:
    """The same of the table's record of a pair."""
    if difference := _difference(outcome.training if outcome else None, cell):
        raise OutputError(
            f"{figures}: {cell.entry.name}, {cell.method}: {difference}, as the plan says; choose"
            " another --table, or train it with --again"
        )


def _difference(trained_by: dict[str, Any] | None, cell: Cell) -> str | None:
    """None also for results of older versions, which have no record."""
    return None if trained_by is None else first_difference(trained_by, cell.settings)


def _multiples(views: list[dict[str, Any]]) -> dict[str, float | None] | None:
    """Mean over views of the relative distances by metric, None where a view has none."""
    if not views:
        return None
    return {metric: _mean([view[metric]["multiple"] for view in views]) for metric in views[0]}


def _mean(values: list[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return sum(known) / len(known) if len(known) == len(values) else None


def _outcome(cell: Cell) -> Outcome:
    evaluation = json.loads(cell.evaluation.read_text())
    training = model_file.read(cell.model).document["training"]
    distances = next(iter(evaluation["distances"].values()))  # of the colors
    views = distances["views"]
    tests = [evaluation["repetition"][key] for key in ("block", "far blocks")]
    return Outcome(
        seconds=training["seconds"],
        steps=training["step"],
        multiples=_multiples([distances["overall"]]),
        axes=_multiples([view for name, view in views.items() if name != "oblique"]),
        oblique=_multiples([view for name, view in views.items() if name == "oblique"]),
        copied=max(evaluation["copying"]["views"].values()),
        repeats=any(found and found["repeats"] for found in tests),
        solid=_solid_errors(cell)["model"] if cell.entry.solid else None,
        training=cell.trained_by,
        preset=training.get("preset"),
    )


def _solid_errors(cell: Cell) -> dict[str, dict[str, float]]:
    errors: dict[str, dict[str, float]] = json.loads(cell.solid_errors.read_text())
    return errors


def _restored(values: dict[str, Any]) -> Outcome:
    solid = values.get("solid")
    return Outcome(**{**values, "solid": None if solid is None else _infinite(solid)})


def _plain(value: Any) -> Any:
    """Replace infinite errors (a missing phase) by null, since JSON has no infinity."""
    if isinstance(value, dict):
        return {key: _plain(v) for key, v in value.items()}
    return None if isinstance(value, float) and math.isinf(value) else value


def _infinite(errors: dict[str, float | None]) -> dict[str, float]:
    return {name: math.inf if value is None else value for name, value in errors.items()}
