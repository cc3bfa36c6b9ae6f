"""The report of solidtex-measure: units, and figures against the edge of cubes."""

import pytest

pytest.importorskip("matplotlib")

from matplotlib.figure import Figure

from solidtex_export.measuring import report


def test_units_of_the_report_are_written_as_units() -> None:
    assert report.heading("mean_chord_um") == "mean chord (µm)"
    assert report.heading("integral_range_um3") == "integral range (µm³)"
    assert report.heading("euler_density_per_um3") == "euler density (1/µm³)"
    assert report.heading("permeability_m2") == "permeability (m²)"
    assert report.heading("permeability_mD") == "permeability (mD)"


def cubes(edge: int, count: int, mean: float, deviation: float | None) -> dict:
    figure = {"mean": mean, "deviation": deviation}
    return {"edge_voxels": edge, "edge_um": edge * 2.0, "cubes": count, "permeability_mD": figure}


def test_figures_of_cubes_end_at_zero_and_at_single_cubes() -> None:
    found = [cubes(16, 27, 40.0, 90.0), cubes(32, 8, 50.0, 20.0), cubes(64, 1, 60.0, None)]
    axes = Figure().subplots()
    report.draw_cubes(axes, found, "permeability_mD", "edge_um")
    assert [text.get_text() for text in axes.get_xticklabels()] == ["32", "64", "128"]
    assert len(axes.get_xticks(minor=True)) == 0
    bars = [collection.get_segments()[0][:, 1].tolist() for collection in axes.collections]
    assert bars == [[0, 130], [30, 70]]
    points = [line for line in axes.lines if line.get_marker() == "o"]
    assert [p.get_markerfacecolor() for p in points] == ["C0", "C0", "white"]
    assert report.cube_rows(found)[1:] == [
        ["32", "16", "27", "40 ± 90"],
        ["64", "32", "8", "50 ± 20"],
        ["128", "64", "1", "60"],
    ]
