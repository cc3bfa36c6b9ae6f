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
from solidtex_export.measuring.voxels import METERS

matplotlib.use("Agg")

COLORS = {"x": "C0", "y": "C1", "z": "C2"}  # of a curve by its axis, of the picture's too
SIGNED = "euler_density"  # the figure whose values may be negative


def render(document: dict[str, Any], slices: list[NDArray[Any]]) -> str:
    """The report as HTML text; `slices` are the middle slices of the labels, across x, y, z."""
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("solidtex_export.measuring", "."),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
    )
    environment.globals |= {
        "number": number, "heading": heading, "written": written,
    }  # fmt: skip
    skipped = ("two_point", "chord_counts", "reason", "warnings")
    return environment.get_template("report.html.j2").render(
        d=document,
        version=__version__,
        phase_rows=rows(document["phases"], ()),
        axis_rows=rows(document["axes"], skipped),
        picture_rows=picture_rows(document) if "exemplar" in document else [],
        representative=_representative(document),
        slices=_figure(lambda figure: _draw_slices(figure, document, slices), (9, 3.4)),
        curves=_figure(lambda figure: _draw_curves(figure, document), (9, 3)),
    )


def rows(columns: dict[str, dict[str, Any]], skipped: tuple[str, ...]) -> list[list[Any]]:
    """One row a figure: its name, and its value in each column."""
    names = [name for name in next(iter(columns.values()), {}) if name not in skipped]
    return [[name, *(column.get(name) for column in columns.values())] for name in names]


def compared(document: dict[str, Any]) -> list[tuple[str, float | None, float | None]]:
    """Figures of the phase that conducts: the name, the solid's figure, the picture's.

    Chords are those along the axes that both have.
    """
    picture, unit = document["exemplar"], document["voxel_size"]["unit"]
    surface, chord = f"specific_surface_per_{unit}", f"mean_chord_{unit}"
    solid, slices = document["phases"][str(document["phase"])], picture["slices"]
    return [
        (heading(surface), solid[surface], picture[surface]),
        *(
            (f"{heading(chord)} along {axis}", document["axes"][axis][chord], figures[chord])
            for axis, figures in picture["axes"].items()
            if axis in document["axes"]
        ),
        *(
            (f"{heading(key)} in slices across {picture['across']}", slices[key], picture[key])
            for key in (f"euler_density_per_{unit}2", f"mean_pore_radius_{unit}")
            if key in slices
        ),
    ]


def picture_rows(document: dict[str, Any]) -> list[list[str]]:
    """One row a figure: its name, the solid's, the picture's, and their relative difference."""
    titles = document["phase_titles"]
    phase = titles[str(document["phase"])]
    table = []
    for label, figures in document["exemplar"]["phases"].items():
        solid = document["phases"][label]
        difference = _difference(solid["fraction"], figures["fraction"])
        name = f"fraction of phase {titles[label]}"
        table.append([name, *map(_fraction, (solid, figures)), difference])
    for name, ours, theirs in compared(document):
        cells = number(ours), number(theirs), _difference(ours, theirs)
        table.append([f"{name} of phase {phase}", *cells])
    return table


def _difference(ours: float | None, theirs: float | None) -> str:
    """In percent of the picture's figure; "-" where one of them has none."""
    return f"{100 * (ours / theirs - 1):+.1f} %" if ours is not None and theirs else "-"


def _representative(document: dict[str, Any]) -> list[tuple[str, str, str, list[list[str]]]]:
    """One of the volume and of the picture each: title, name of a piece, diagram, table."""
    unit = document["voxel_size"]["unit"]
    parts = (
        ("Representative volumes", "cube", document),
        ("Representative areas of the picture", "square", document.get("exemplar", {})),
    )
    return [
        (title, piece, _cubes_figure(found, unit), cube_rows(found))
        for title, piece, figures in parts
        if (found := figures.get("representative"))
    ]


def cube_rows(found: list[dict[str, Any]]) -> list[list[str]]:
    """One row an edge: the edge, the number of cubes, and mean and deviation of each figure."""
    edge = next(name for name in found[0] if name.startswith("edge_") and name != "edge_voxels")
    names = cube_figures(found)
    counted = next(name for name in ("cubes", "squares") if name in found[0])
    table = [[heading(edge), "edge (voxels)", counted, *map(heading, names)]]
    for row in found:
        figures = [_with_deviation(row[name]) for name in names]
        table.append([number(row[edge]), str(row["edge_voxels"]), str(row[counted]), *figures])
    return table


def cube_figures(found: list[dict[str, Any]]) -> list[str]:
    """Names of the figures that have a mean and a deviation."""
    return [name for name, value in found[0].items() if isinstance(value, dict)]


def _with_deviation(figure: dict[str, Any]) -> str:
    mean, deviation = number(figure["mean"]), figure["deviation"]
    return mean if deviation is None else f"{mean} ± {number(deviation)}"


def _fraction(figures: dict[str, Any]) -> str:
    """The fraction of a phase with its deviation."""
    return _with_deviation(
        {"mean": figures["fraction"], "deviation": figures["fraction_deviation"]}
    )


def number(value: Any) -> str:
    if value is None:
        return "-"
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def heading(name: str) -> str:
    """Turn mean_chord_um into "mean chord (µm)", specific_surface_per_um into 1/µm."""
    words = name.split("_")
    if "per" in words:
        at = words.index("per")
        return f"{' '.join(words[:at])} (1/{written(words[at + 1])})"
    if words[-1] == "mD" or words[-1].rstrip("23") in METERS:
        return f"{' '.join(words[:-1])} ({written(words[-1])})"
    return " ".join(words)


def written(unit: str) -> str:
    """A unit as it is printed: um3 is µm³."""
    return unit.replace("um", "µm").translate(str.maketrans("23", "²³"))


def _figure(draw: Any, size: tuple[float, float]) -> str:
    """A diagram as the base64 text of a PNG."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=size, layout="constrained")
    draw(figure)
    data = io.BytesIO()
    figure.savefig(data, format="png", dpi=110)
    return base64.b64encode(data.getvalue()).decode()


def _draw_slices(figure: Any, document: dict[str, Any], slices: list[NDArray[Any]]) -> None:
    voxel, unit = document["voxel_size"]["value"], written(document["voxel_size"]["unit"])
    low, high = min(s.min() for s in slices), max(s.max() for s in slices)
    for axes, pixels, name in zip(figure.subplots(1, 3), slices, "xyz", strict=True):
        width, height = (length * voxel for length in pixels.shape)
        extent = (0, width, height, 0)
        axes.imshow(
            pixels.T, cmap="gray", vmin=low, vmax=high, interpolation="nearest", extent=extent
        )
        across, down = (other for other in "xyz" if other != name)
        axes.set_title(f"middle slice across {name}", fontsize=9)
        axes.set_xlabel(f"{across} ({unit})", fontsize=8)
        axes.set_ylabel(f"{down} ({unit})", fontsize=8)
        axes.locator_params(nbins=5)
        axes.tick_params(labelsize=7)


def _draw_curves(figure: Any, document: dict[str, Any]) -> None:
    voxel, unit = document["voxel_size"]["value"], written(document["voxel_size"]["unit"])
    correlation, chords, sizes = figure.subplots(1, 3)
    curves = [(name, name, axis, "-") for name, axis in document["axes"].items()]
    if picture := document.get("exemplar"):
        curves += [(f"picture, {name}", name, axis, "--") for name, axis in picture["axes"].items()]
    for label, name, axis, style in curves:
        line = {"label": label, "color": COLORS[name], "linestyle": style, "linewidth": 1}
        values = axis["two_point"]
        correlation.plot(np.arange(len(values)) * voxel, values, **line)
        counts = np.array(axis["chord_counts"], float)
        if counts.sum() > 0:
            lengths = np.arange(1, len(counts) + 1) * voxel
            chords.plot(lengths, counts / counts.sum() / voxel, **line)
    correlation.set(xlabel=f"distance ({unit})", ylabel="S2")
    correlation.legend(fontsize=7)
    chords.set(xlabel=f"chord ({unit})", ylabel=f"density (1/{unit})")
    openings = [("balls", document, "-")]
    if picture:
        openings += [
            (f"disks across {picture['across']}", picture["slices"], "-."),
            ("picture, disks", picture, "--"),
        ]
    for label, figures, style in openings:
        if found := figures.get("pore_sizes"):
            radii = found[f"radius_{document['voxel_size']['unit']}"]
            line = {"label": label, "color": "black", "linestyle": style, "linewidth": 1}
            sizes.plot(radii, found["fraction_covered"], **line)
            sizes.legend(fontsize=7)
    sizes.set(xlabel=f"pore radius ({unit})", ylabel="covered by openings this large")


def _cubes_figure(found: list[dict[str, Any]], unit: str) -> str:
    """A diagram a figure, three beside each other."""
    names = cube_figures(found)
    lines = -(-len(names) // 3)

    def draw(figure: Any) -> None:
        places = figure.subplots(lines, 3, squeeze=False).ravel()
        for axes, name in zip(places, names, strict=False):
            draw_cubes(axes, found, name, f"edge_{unit}")
        for axes in places[len(names) :]:
            axes.set_axis_off()

    return _figure(draw, (9, 2.8 * lines))


def draw_cubes(axes: Any, found: list[dict[str, Any]], name: str, edge: str) -> None:
    """Mean and deviation of a figure against the edge of the cubes; one cube has no deviation."""
    edges = [row[edge] for row in found]
    axes.plot(edges, [row[name]["mean"] for row in found], color="C0", linewidth=1)
    for row in found:
        mean, deviation = row[name]["mean"], row[name]["deviation"]
        bars = None
        if deviation is not None:
            below = deviation if name.startswith(SIGNED) else min(deviation, mean)
            bars = [[below], [deviation]]
        axes.errorbar(
            row[edge], mean, bars, color="C0", marker="o", markersize=4, linewidth=1, capsize=2,
            markerfacecolor="white" if bars is None else "C0",
        )  # fmt: skip
    axes.set_xscale("log")
    axes.set_xticks(edges, [f"{value:.4g}" for value in edges], fontsize=8)
    axes.set_xticks([], minor=True)
    axes.margins(x=0.1)
    axes.set(xlabel=heading(edge), ylabel=heading(name))
