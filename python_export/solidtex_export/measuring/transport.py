"""Connectivity, diffusivity and permeability of a phase along an axis."""

from __future__ import annotations

from typing import Any, Literal

from solidtex_export.measuring.geometry import Mask
from solidtex_export.measuring.voxels import VoxelSize

SQUARE_METERS_PER_DARCY = 9.869233e-13
Boundary = Literal["open", "periodic"]
PARTS = ("diffusivity", "permeability")


def measure_transport(
    mask: Mask,
    axis: int,
    boundary: Boundary,
    voxel_size: VoxelSize,
    parts: tuple[str, ...] = PARTS,
    refinement: int = 1,
    title: str = "",
) -> dict[str, Any]:
    """The figures of a phase along an axis; `reason` says why flow and diffusion are zero.

    `title` names the phase there.
    """
    from solidtex import transport

    fraction = transport.conducting_fraction(mask, axis, boundary)
    result: dict[str, Any] = {"conducting_fraction": fraction, "reason": None, "warnings": []}
    if fraction == 0:
        phase = f"phase {title}" if title else "the phase"
        result["reason"] = (
            f"no path of {phase} leads through the volume along {'xyz'[axis]}: permeability and"
            " diffusivity are 0; measure another phase by --phase, another axis by --axes, or a"
            " larger volume"
        )
    if "diffusivity" in parts:
        found = transport.diffusivity(mask, axis, boundary) if fraction else None
        value = found.value if found else 0.0
        result["relative_diffusivity"] = value
        result["formation_factor"] = 1 / value if value else None
        result["tortuosity"] = float(mask.mean()) / value if value else None
        _warn(result, "diffusivity", found)
    if "permeability" in parts:
        found = (
            transport.permeability(mask, axis, boundary, refinement=refinement)
            if fraction
            else None
        )
        value = (found.value if found else 0.0) * voxel_size.meters**2
        result["permeability_m2"] = value
        result["permeability_mD"] = value / SQUARE_METERS_PER_DARCY * 1e3
        _warn(result, "permeability", found)
    return result


def _warn(result: dict[str, Any], what: str, found: Any) -> None:
    if found is not None and not found.has_converged:
        result["warnings"].append(f"{what}: the solver stopped after {found.steps} steps unsettled")
