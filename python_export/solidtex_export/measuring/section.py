"""Figures of the picture that a solid was made from, beside those of the solid's slices."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from solidtex_export.measuring import geometry, representative
from solidtex_export.measuring.geometry import Mask
from solidtex_export.measuring.measure import Settings, choose_phase
from solidtex_export.measuring.phases import Phases, find_phases
from solidtex_export.measuring.voxels import VolumeError

LIKE_SIZE = 1.25  # up to which a picture's edge is like the volume's
SLICES = 16  # of the solid, in which pores are measured as in the picture


@dataclass(frozen=True)
class Section:
    """Pixels [right, down], each as large as a voxel of the solid."""

    name: str
    pixels: NDArray[Any]
    across: str = "z"
    """The axis of the solid that the picture is a section across."""

    @property
    def axes(self) -> str:
        """The solid's axes to the right, and up or down."""
        return "xyz".replace(self.across, "")


def measure_section(
    section: Section, threshold: float | None, settings: Settings, solid: Phases
) -> dict[str, Any]:
    """The figures of a volume, where 2D has them: `phases` has the fraction of every phase.

    Its labels may have other numbers than those of the solid: their order counts. Keys of `phases`
    are labels of the solid. `slices` has figures of the solid's slices that compare with those of
    the picture.
    """
    phases = find_phases(section.pixels, threshold, section.name)
    if len(phases.names) != len(solid.names):
        raise VolumeError(
            f"{section.name}: found {len(phases.names)} labels {', '.join(map(str, phases.names))},"
            f" expected {len(solid.names)} as in the volume:"
            f" {', '.join(map(str, solid.names))}"
        )
    chosen = choose_phase(solid, settings.phase, "the volume")
    voxel, unit = settings.voxel_size.value, settings.voxel_size.unit
    masks = [phases.of(label) for label in phases.names]
    by_phase = [geometry.measure_phase(mask, voxel, unit) for mask in masks]
    place = solid.names.index(chosen)
    mask, figures = masks[place], by_phase[place]
    surface, euler = f"specific_surface_per_{unit}", f"euler_density_per_{unit}2"
    slices = np.moveaxis(solid.of(chosen), "xyz".index(section.across), 0)
    notes = [*phases.notes]
    if min(mask.shape) > LIKE_SIZE * min(solid.labels.shape):
        notes.append(
            f"{section.name}: larger than the volume, whose mean chords are shorter by that: chords"
            " cut by a border do not count. Compare like sizes"
        )
    document: dict[str, Any] = {
        "file": section.name,
        "note": "; ".join(notes),
        "size": list(mask.shape),
        "across": section.across,
        "fraction": figures["fraction"],
        "fraction_deviation": figures["fraction_deviation"],
        "phases": {
            str(label): {key: found[key] for key in ("fraction", "fraction_deviation")}
            for label, found in zip(solid.names, by_phase, strict=True)
        },
        surface: figures[surface] * geometry.SURFACE_OF_SECTIONS,
        euler: figures[euler],
        "axes": {
            name: geometry.measure_axis(mask, i, voxel, unit) for i, name in enumerate(section.axes)
        },
        "slices": {euler: geometry.section_euler(slices) / (slices.size * voxel**2)},
    }
    if settings.pore_sizes:
        _add_pore_sizes(document, mask, slices, voxel, unit)
    if settings.representative != "none":
        document["representative"] = representative.analyze(mask, voxel, unit, {})
    return document


def _add_pore_sizes(
    document: dict[str, Any], mask: Mask, slices: Mask, voxel: float, unit: str
) -> None:
    """Sizes by disks, of the picture and of the solid's slices."""
    radii, covered = geometry.pore_sizes(mask)
    places = np.linspace(0, len(slices) - 1, min(len(slices), SLICES)).round().astype(int)
    of_slices = geometry.disk_sizes(slices[places], radii)
    for figures, found in ((document, covered), (document["slices"], of_slices)):
        figures["pore_sizes"] = {
            f"radius_{unit}": [radius * voxel for radius in radii],
            "fraction_covered": found,
        }
        figures[f"mean_pore_radius_{unit}"] = geometry.mean_radius(radii, found) * voxel
