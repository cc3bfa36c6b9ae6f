"""Edges of voxels and their units, as an option or a file says them."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

METERS = {"nm": 1e-9, "um": 1e-6, "mm": 1e-3, "cm": 1e-2, "m": 1.0}
WORDS = {"nano": "nm", "micro": "um", "milli": "mm", "centi": "cm", "": "m"}
SPELLINGS = {"µm": "um", "μm": "um", "micron": "um", "microns": "um"} | {
    prefix + meter: unit
    for prefix, unit in WORDS.items()
    for meter in ("meter", "meters", "metre", "metres")
}
UNKNOWN = {"", "pixel", "pixels", "voxel", "voxels"}  # with edges of 1: the file has no size
NUMBER = r"\s*[-+.\deE]+\s*"
SIDES_ALIKE = 1e-3  # relative difference up to which the sides of a voxel are the same
OPTION = "--voxel-size"


class VolumeError(Exception):
    """A volume cannot be measured. The message says why and what to do."""


@dataclass(frozen=True)
class VoxelSize:
    """Edge of a cubic voxel, in the unit the user gave."""

    value: float
    unit: str

    @property
    def meters(self) -> float:
        return self.value * METERS[self.unit]

    def __str__(self) -> str:
        return f"{self.value:g} {self.unit}"


@dataclass(frozen=True)
class Voxel:
    """Edges of a voxel along x, y and z, as a file says them."""

    edges: tuple[float, ...]
    unit: str
    """One of METERS; else what the file says in its place, or "" if it says nothing."""
    is_z_assumed: bool = False
    """Whether the file says nothing of z, so that z is taken as x."""

    def __str__(self) -> str:
        edges = self.edges[:1] if self._is_cubic else self.edges
        lengths = " x ".join(f"{edge:g}" for edge in edges)
        if self.unit in METERS:
            return f"{lengths} {self.unit}"
        return f"{lengths} in {self.unit}" if self.unit else f"{lengths} without a unit"

    @property
    def is_length(self) -> bool:
        return self.unit in METERS

    @property
    def _is_cubic(self) -> bool:
        return max(self.edges) - min(self.edges) <= SIDES_ALIKE * max(self.edges)

    def check_cubic(self, what: str) -> None:
        """Refuse other boxes. Every figure here is for cubic voxels."""
        if not self._is_cubic:
            raise VolumeError(
                f"{what}: found voxels of {self}, expected cubes: resample the volume to one voxel"
                " size first, for instance with scipy.ndimage.zoom, labels with order=0"
            )

    def cubic(self, what: str) -> VoxelSize:
        """Its one edge."""
        if not self.is_length:
            edge = f"{self.edges[0]:g}"
            example = f"{edge}um or {edge}mm" if not self.unit and self._is_cubic else "2.25um"
            raise VolumeError(
                f"{what}: found voxels of {self}, expected a unit of length in the metadata of"
                f" ImageJ, OME, NRRD or VTK; give {OPTION} LENGTH, such as {OPTION} {example}"
            )
        self.check_cubic(what)
        return VoxelSize(float(self.edges[0]), self.unit)


def parse_voxel_size(text: str) -> VoxelSize:
    """Parse "2.25um", or three of them that are the same, as in 2um,2um,2um or 2,2,2um."""
    parts = text.split(",")
    if len(parts) not in (1, 3):
        raise VolumeError(
            f"{OPTION}: found {len(parts)} lengths in {text!r}, expected 1, such as 2.25um"
        )
    if all(re.fullmatch(NUMBER, part) for part in parts[:-1]):
        unit = re.sub(NUMBER, "", parts[-1], count=1)
        parts = [*(part + unit for part in parts[:-1]), parts[-1]]
    sizes = [_parse_length(part) for part in parts]
    units = {unit for _, unit in sizes}
    if len(units) > 1:
        raise VolumeError(
            f"{OPTION}: found the units {', '.join(sorted(units))}, expected one; voxels are"
            " cubes: give their edge once, such as 2.25um"
        )
    return Voxel(tuple(value for value, _ in sizes), units.pop()).cubic(OPTION)


def _parse_length(text: str) -> tuple[float, str]:
    match = re.fullmatch(rf"({NUMBER})(\S*)\s*", text)
    try:
        value = float(match[1]) if match else None
    except ValueError:
        value = None
    if match is None or value is None:
        raise VolumeError(f"{OPTION}: found {text!r}, expected a number and a unit, as 2.25um")
    if not match[2]:
        raise VolumeError(
            f"{OPTION}: found {text!r} without a unit, expected one of {', '.join(METERS)},"
            " such as 2.25um"
        )
    unit = unit_of(match[2])
    if unit not in METERS:
        raise VolumeError(
            f"{OPTION}: found the unit {match[2]!r}, expected one of {', '.join(METERS)}; convert"
            " the length, and write um for micrometers"
        )
    if not 0 < value < float("inf"):
        raise VolumeError(f"{OPTION}: found {value:g}, expected a number above 0, as 2.25um")
    return value, unit


def unit_of(text: str) -> str:
    """The unit as METERS spells it, if it is one of them. ImageJ writes µm as an escape too."""
    text = re.sub(r"\\u([0-9a-fA-F]{4})", lambda found: chr(int(found[1], 16)), text.strip())
    return SPELLINGS.get(text, SPELLINGS.get(text.lower(), text))


def voxel_of(
    edges: Sequence[float], units: Sequence[str], is_z_assumed: bool = False
) -> Voxel | None:
    """Its edges in the unit of x, as they are if a unit is no length.

    None if an edge is no length, or if the file has the edges that programs write for unknown ones.
    """
    if not all(0 < edge < float("inf") for edge in edges):
        return None
    names = [unit_of(unit) for unit in units]
    scales = relative_lengths(units)
    if scales:
        lengths = tuple(edge * scale for edge, scale in zip(edges, scales, strict=True))
        return Voxel(lengths, names[0], is_z_assumed)
    if set(names) <= UNKNOWN and all(edge == 1 for edge in edges):
        return None
    said = names[0] if len(set(names)) == 1 else ", ".join(name or "no unit" for name in names)
    return Voxel(tuple(edges), said, is_z_assumed)


def relative_lengths(units: Sequence[str]) -> list[float]:
    """Lengths of the units, relative to the first one; none if one is not known."""
    known = [METERS.get(unit_of(unit)) for unit in units]
    meters = [length for length in known if length]
    return [length / meters[0] for length in meters] if len(meters) == len(known) else []
