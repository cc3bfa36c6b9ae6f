"""All figures of a volume."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from solidtex_export.measuring import geometry, representative, transport
from solidtex_export.measuring.geometry import Mask
from solidtex_export.measuring.phases import Phases
from solidtex_export.measuring.voxels import VolumeError, VoxelSize

Say = Callable[[str], None]


@dataclass(frozen=True)
class Settings:
    """What is measured, and how."""

    voxel_size: VoxelSize
    phase: int | None = None  # whose pores conduct; None is the lowest label
    boundary: transport.Boundary = "open"
    axes: str = "xyz"
    transport: tuple[str, ...] = transport.PARTS
    pore_sizes: bool = True
    refinement: int = 1  # of voxels, for permeability
    representative: str = "geometry"  # geometry, transport or none


def choose_phase(phases: Phases, wanted: int | None, what: str) -> int:
    phase = phases.names[0] if wanted is None else wanted
    if phase not in phases.names:
        raise VolumeError(
            f"--phase: found {phase}, expected one of the labels of {what}:"
            f" {', '.join(map(str, phases.names))}"
        )
    return phase


def measure_volume(phases: Phases, settings: Settings, say: Say) -> dict[str, Any]:
    """The figures of every phase, and of the chosen one by axis."""
    voxel, unit = settings.voxel_size.value, settings.voxel_size.unit
    phase = choose_phase(phases, settings.phase, "the volume")
    mask = phases.of(phase)
    document: dict[str, Any] = {
        "size": list(mask.shape),
        "voxel_size": {"value": voxel, "unit": unit},
        "phase": phase,
        "phase_titles": {str(label): phases.title(label) for label in phases.names},
        "boundary": settings.boundary,
        "refinement": settings.refinement,
        "phases": _phase_figures(phases, voxel, unit, say),
        "axes": {},
    }
    for name in settings.axes:
        axis = "xyz".index(name)
        say(f"axis {name}: correlation, chords, {', '.join(settings.transport) or 'no transport'}")
        figures = geometry.measure_axis(mask, axis, voxel, unit)
        figures |= transport.measure_transport(
            mask,
            axis,
            settings.boundary,
            settings.voxel_size,
            settings.transport,
            settings.refinement,
            phases.title(phase),
        )
        document["axes"][name] = figures
    if settings.pore_sizes:
        say("pore sizes")
        radii, covered = geometry.pore_sizes(mask)
        document["pore_sizes"] = {
            f"radius_{unit}": [radius * voxel for radius in radii],
            "fraction_covered": covered,
        }
    if settings.representative != "none":
        say("representative volumes")
        further = _transport_figures(settings) if settings.representative == "transport" else {}
        document["representative"] = representative.analyze(mask, voxel, unit, further)
    return document


def _phase_figures(phases: Phases, voxel: float, unit: str, say: Say) -> dict[str, Any]:
    figures = {}
    for label in phases.names:
        say(f"phase {phases.title(label)}: fraction, surface, Euler characteristic, mean breadth")
        figures[str(label)] = geometry.measure_phase(phases.of(label), voxel, unit)
    return figures


def _transport_figures(settings: Settings) -> dict[str, Callable[[Mask], float]]:
    """Diffusivity and permeability of a cube along the first of the axes."""
    axis = "xyz".index(settings.axes[0])

    def figure(part: str, key: str) -> Callable[[Mask], float]:
        return lambda cube: float(
            transport.measure_transport(
                cube, axis, settings.boundary, settings.voxel_size, (part,), settings.refinement
            )[key]
        )

    keys = {"diffusivity": "relative_diffusivity", "permeability": "permeability_mD"}
    return {keys[part]: figure(part, keys[part]) for part in settings.transport}
