"""HTML report of the figures of a volume: one file with embedded diagrams."""

from __future__ import annotations

import base64
import io
from typing import Any

import jinja2
import matplotlib
import numpy as np
from numpy.typing import NDArray

from solidtex_export import __version__
from solidtex_export.measuring.volumes import METERS

matplotlib.use("Agg")


def render(document: dict[str, Any], slices: list[NDArray[Any]]) -> str:
    """The report as HTML text; `slices` are the middle slices of the labels, across x, y, z."""
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("solidtex_export.measuring", "."),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
    )
    environment.globals |= {"number": number, "heading": heading}
    skipped = ("two_point", "chord_counts", "reason", "warnings")
    return environment.get_template("report.html.j2").render(
        d=document,
        version=__version__,
        phase_rows=rows(document["phases"], ()),
        axis_rows=rows(document["axes"], skipped),
        slices=_figure(lambda figure: _draw_slices(figure, slices), (9, 3.2)),
        curves=_figure(lambda figure: _draw_curves(figure, document), (9, 3)),
        sizes=_figure(lambda figure: _draw_cubes(figure, document), (9, 3))
        if document.get("representative")
        else None,
    )


def rows(columns: dict[str, dict[str, Any]], skipped: tuple[str, ...]) -> list[list[Any]]:
    """One row a figure: its name, and its value in each column."""
    names = [name for name in next(iter(columns.values()), {}) if name not in skipped]
    return [[name, *(column.get(name) for column in columns.values())] for name in names]


def number(value: Any) -> str:
    if value is None:
        return "-"
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def heading(name: str) -> str:
    """Turn mean_chord_um into "mean chord (um)", specific_surface_per_um into 1/um."""
    words = name.split("_")
    if "per" in words:
        at = words.index("per")
        return f"{' '.join(words[:at])} (1/{words[at + 1]})"
    if words[-1] == "mD" or words[-1].rstrip("23") in METERS:
        return f"{' '.join(words[:-1])} ({words[-1]})"
    return " ".join(words)


def _figure(draw: Any, size: tuple[float, float]) -> str:
    """A diagram as the base64 text of a PNG."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=size, layout="constrained")
    draw(figure)
    data = io.BytesIO()
    figure.savefig(data, format="png", dpi=110)
    return base64.b64encode(data.getvalue()).decode()


def _draw_slices(figure: Any, slices: list[NDArray[Any]]) -> None:
    low, high = min(s.min() for s in slices), max(s.max() for s in slices)
    for axes, pixels, name in zip(figure.subplots(1, 3), slices, "xyz", strict=True):
        axes.imshow(pixels.T, cmap="gray", vmin=low, vmax=high, interpolation="nearest")
        axes.set_title(f"middle slice across {name}", fontsize=9)
        axes.set_axis_off()


def _draw_curves(figure: Any, document: dict[str, Any]) -> None:
    voxel, unit = document["voxel_size"]["value"], document["voxel_size"]["unit"]
    correlation, chords, sizes = figure.subplots(1, 3)
    curves = [(f"{name}", axis, "-") for name, axis in document["axes"].items()]
    if picture := document.get("exemplar"):
        curves += [(f"picture, {name}", axis, "--") for name, axis in picture["axes"].items()]
    for name, axis, style in curves:
        values = axis["two_point"]
        correlation.plot(np.arange(len(values)) * voxel, values, style, label=name, linewidth=1)
        counts = np.array(axis["chord_counts"], float)
        if counts.sum() > 0:
            lengths = np.arange(1, len(counts) + 1) * voxel
            chords.plot(lengths, counts / counts.sum() / voxel, style, label=name, linewidth=1)
    correlation.set(xlabel=f"distance ({unit})", ylabel="S2")
    correlation.legend(fontsize=7)
    chords.set(xlabel=f"chord ({unit})", ylabel=f"density (1/{unit})")
    if found := document.get("pore_sizes"):
        sizes.plot(found[f"radius_{unit}"], found["fraction_covered"], linewidth=1)
    sizes.set(xlabel=f"pore radius ({unit})", ylabel="covered by balls this large")


def _draw_cubes(figure: Any, document: dict[str, Any]) -> None:
    found = document["representative"]
    unit = document["voxel_size"]["unit"]
    names = [name for name in found[0] if isinstance(found[0][name], dict)]
    for axes, name in zip(np.atleast_1d(figure.subplots(1, len(names))), names, strict=True):
        edges = [row[f"edge_{unit}"] for row in found]
        means = [row[name]["mean"] for row in found]
        deviations = [row[name]["deviation"] or 0 for row in found]
        axes.errorbar(edges, means, deviations, marker="o", markersize=3, linewidth=1, capsize=2)
        axes.set(xlabel=f"edge of the cube ({unit})", ylabel=heading(name), xscale="log")
