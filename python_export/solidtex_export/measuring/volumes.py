"""Volumes from files: TIFF, NumPy, NRRD, VTK and OME-Zarr, with their voxel size."""

from __future__ import annotations

import re
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from solidtex_export.measuring.ome_zarr import read_image
from solidtex_export.measuring.voxels import VolumeError, Voxel, relative_lengths, voxel_of

PHASE_PREFIX = "phase."  # of the channel that has the probability of a phase
SUFFIXES = (".tif", ".tiff", ".npy", ".nrrd", ".nhdr", ".vti", ".zarr")
PRINT_UNITS = {2: "inches by ResolutionUnit", 3: "centimeters by ResolutionUnit"}
OBLIQUE = 1e-3  # cosine between axes above which voxels are no cubes
HINTS = {
    ".npz": "save one array as .npy by numpy.save",
    ".raw": "name the .nhdr of a .raw, which solidtex-bake -o NAME.nhdr writes",
}


@dataclass
class Volume:
    """Values [x, y, z] of a file, and what is known of them."""

    values: NDArray[Any]
    voxel: Voxel | None = None
    channels: tuple[str, ...] = ()
    """Names of the last axis where values are [x, y, z, channel]; empty if the file has none."""
    phases: tuple[str, ...] = ()
    """Names of the labels 0, 1, 2 ...; empty if they are unknown."""
    model: dict[str, Any] | None = None
    """Name, SHA-256, seed and box of the model that it was baked of; None for a file."""
    notes: list[str] = field(default_factory=list)


def read_volume(path: Path) -> Volume:
    """Read a file of one of SUFFIXES."""
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        hint = f"; {HINTS[suffix]}" if suffix in HINTS else ""
        raise VolumeError(
            f"{path}: found {suffix or 'no suffix'}, expected {', '.join(SUFFIXES)} or .solidtex"
            f"{hint}"
        )
    if not (path.is_dir() if suffix == ".zarr" else path.is_file()):
        found = "a folder" if path.is_dir() else "a file" if path.exists() else "no such file"
        expected = "a folder" if suffix == ".zarr" else f"a volume ({', '.join(SUFFIXES)})"
        raise VolumeError(f"{path}: found {found}, expected {expected}; check the path")
    readers = {
        ".npy": _read_numpy,
        ".nrrd": _read_nrrd,
        ".nhdr": _read_nrrd,
        ".vti": _read_vti,
        ".zarr": _read_zarr,
    }
    try:
        volume = readers.get(suffix, _read_tiff)(path)
    except VolumeError:
        raise
    except Exception as error:  # what libraries raise on a damaged file is theirs to choose
        remedy = "a whole one: write or copy it again"
        if "imagecodecs" in str(error):
            remedy = "one without compression; save it so, or pip install imagecodecs"
        raise VolumeError(
            f"{path}: found a file that cannot be read as {suffix}:"
            f" {str(error) or type(error).__name__}; expected {remedy}"
        ) from error
    return three_axes(path, volume)


def three_axes(path: Path, volume: Volume) -> Volume:
    """Leave one value a voxel, and refuse what is no volume."""
    check_numbers(volume.values, str(path))
    shape = volume.values.shape
    if len(shape) == 4 and min(shape[:3]) > 1 and shape[3]:
        _merge_channels(path, volume)
    values = volume.values
    if values.ndim != 3 or min(values.shape) < 2:
        remedy = (
            "stack slices to one array by numpy.stack; a single section is a picture for --exemplar"
            if values.ndim < 3 or 1 in values.shape
            else "leave one value a voxel"
        )
        raise VolumeError(
            f"{path}: found an array of shape {shape}, expected a volume of at least 2 voxels"
            f" along three axes; {remedy}"
        )
    return volume


def check_numbers(values: NDArray[Any], what: str) -> None:
    """Refuse what cannot be compared with a threshold."""
    if values.dtype.kind not in "buif":
        raise VolumeError(
            f"{what}: found values of type {values.dtype}, expected numbers: labels or grays;"
            " convert them by astype"
        )
    if values.dtype.kind == "f" and not np.isfinite(values).all():
        raise VolumeError(
            f"{what}: found values that are not finite, expected numbers; crop the volume, or set"
            " them by numpy.nan_to_num"
        )


def _merge_channels(path: Path, volume: Volume) -> None:
    """Take the most probable phase of each voxel, or the mean of its colors.

    Of channels without names only those that are alike are known to be gray values.
    """
    values = volume.values
    names = volume.channels if len(volume.channels) == values.shape[3] else ()
    phases = [i for i, name in enumerate(names) if name.startswith(PHASE_PREFIX)]
    albedo = [i for i, name in enumerate(names) if name.startswith("albedo.")]
    if len(phases) > 1:
        volume.phases = _phase_names([names[i] for i in phases])
        volume.values = values[..., phases].argmax(axis=3).astype(np.uint8)
        volume.notes.append(f"{path.name}: labels are the most probable phase of each voxel")
    elif albedo:
        volume.values = values[..., albedo].astype(np.float32).mean(axis=3)
        colors = ", ".join(names[i] for i in albedo)
        volume.notes.append(f"{path.name}: gray values are the mean of {colors}")
    elif names or (values == values[..., :1]).all():
        volume.values = values[..., 0]
        if names:
            volume.notes.append(f"{path.name}: gray values are the channel {names[0]}")
    else:
        raise VolumeError(
            f"{path}: found an array of shape {values.shape} whose {values.shape[3]} channels"
            " differ, expected one value a voxel: labels or grays; bake a model of phases with"
            " --labels, other models with --channels, and reduce colors to gray first"
        )


def _phase_names(channels: Sequence[str]) -> tuple[str, ...]:
    return tuple(name.removeprefix(PHASE_PREFIX) for name in channels)


def _read_numpy(path: Path) -> Volume:
    return Volume(np.load(path, allow_pickle=False))


def _read_nrrd(path: Path) -> Volume:
    import nrrd

    values, header = nrrd.read(str(path))
    names = str(header.get("solidtex_channels", "")).split()
    kinds = [*header.get("kinds", []), "domain"]
    if values.ndim == 4 and (names or kinds[0] not in ("domain", "space", "none", "???")):
        values = np.moveaxis(values, 0, 3)
    labels = str(header.get("solidtex_labels", "")).split()
    return Volume(values, _nrrd_voxel(path, header), tuple(names), _phase_names(labels))


def _nrrd_voxel(path: Path, header: Mapping[str, Any]) -> Voxel | None:
    """The voxel of the last three axes: the first of four is that of channels.

    "units" are those of the axes, "space units" those of the space that directions are in.
    """
    directions = header.get("space directions")
    if directions is None:
        sides = [float(side) for side in header.get("spacings", [])][-3:]
        return voxel_of(sides, _three_units(header.get("units"))) if len(sides) == 3 else None
    units = _three_units(header.get("space units", header.get("units")))
    vectors = np.asarray(directions, float)[-3:]
    if vectors.shape != (3, 3):
        return None
    scales = relative_lengths(units)
    if scales:
        vectors, units = vectors * scales, [units[0]] * 3
    sides = np.linalg.norm(vectors, axis=1)
    cosines = vectors @ vectors.T - np.diag(sides**2)
    if (np.abs(cosines) > OBLIQUE * np.outer(sides, sides)).any():
        raise VolumeError(
            f"{path}: space directions: found axes that are not at right angles, expected cubes;"
            " resample the volume to a rectangular grid"
        )
    return voxel_of(sides.tolist(), units)


def _three_units(listed: Sequence[str] | None) -> list[str]:
    """Those of the last three axes; empty where the file lists none."""
    units = list(listed or [])[-3:]
    return units if len(units) == 3 else [""] * 3


def _read_vti(path: Path) -> Volume:
    """All arrays of a file of solidtex-bake; of another one the active array, or the only one."""
    try:
        import pyvista
    except ModuleNotFoundError as error:
        raise _missing_package(path, error) from error

    with warnings.catch_warnings():
        warnings.simplefilter("error", UserWarning)
        try:
            image = pyvista.read(path)
        except UserWarning as error:
            raise ValueError("VTK finds no whole ImageData in it") from error
    arrays, sides = image.point_data, np.array(image.dimensions)
    if not len(arrays):
        arrays, sides = image.cell_data, np.maximum(sides - 1, 1)
    channels, names = _field_words(image, "solidtex_channels"), list(arrays)
    if arrays.active_scalars_name and not channels:
        names = [arrays.active_scalars_name]
    if not names or (len(names) > 1 and not channels):
        raise ValueError(f"found arrays {', '.join(names) or 'none'}, expected one")
    shape = (*sides[::-1], -1)
    values = np.concatenate([np.asarray(arrays[n]).reshape(shape) for n in names], 3)
    values = values.transpose(2, 1, 0, 3)
    return Volume(
        values[..., 0] if values.shape[3] == 1 else values,
        voxel_of(list(image.spacing), _field_words(image, "unit")[:1] * 3 or [""] * 3),
        channels,
        _phase_names(_field_words(image, "solidtex_labels")),
    )


def _field_words(image: Any, key: str) -> tuple[str, ...]:
    return tuple(str(image.field_data[key][0]).split()) if key in image.field_data else ()


def _missing_package(path: Path, error: ModuleNotFoundError) -> VolumeError:
    return VolumeError(
        f"{path}: found no Python package {error.name!r}, expected it (pip install {error.name}),"
        " or a .nrrd file"
    )


def _read_zarr(path: Path) -> Volume:
    try:
        values, voxel, channels = read_image(path)
    except ModuleNotFoundError as error:
        raise _missing_package(path, error) from error
    return Volume(values, voxel, channels)


def _read_tiff(path: Path) -> Volume:
    import tifffile

    with tifffile.TiffFile(path) as file:
        values, axes, notes = _tiff_array(path, file)
        voxel = _tiff_voxel(file)
        text = file.ome_metadata or file.pages.first.description
        names, labels = (_listed(text, key) for key in ("channels", "labels"))
    if values.ndim == 3 and axes[-1] == "S":
        values = values.mean(axis=2)  # one picture in color, refused later
    elif values.ndim == 3:
        values = values.transpose(2, 1, 0)  # pages, rows, columns
    elif values.ndim == 4 and axes[-1] == "S":
        values = values.transpose(2, 1, 0, 3)
    elif values.ndim == 4 and "C" in axes[:2]:
        values = np.moveaxis(values, axes.index("C"), 3).transpose(2, 1, 0, 3)
    return Volume(values, voxel, tuple(names), _phase_names(labels), notes=notes)


def _tiff_array(path: Path, file: Any) -> tuple[NDArray[Any], str, list[str]]:
    """The array of a file, its axes longer than 1 by tifffile's letters, and notes.

    Pages that were written one by one are one array. Of others the first is taken.
    """
    first = file.series[0]
    values = np.squeeze(first.asarray())
    axes = "".join(axis for axis, n in zip(first.axes, first.shape, strict=True) if n > 1)
    shapes = [tuple(n for n in series.shape if n > 1) for series in file.series]
    if len(shapes) == 1:
        return values, axes, []
    if values.ndim == 2 and len(set(shapes)) == 1:
        others = [np.squeeze(series.asarray()) for series in file.series[1:]]
        return np.stack([values, *others]), f"Z{axes}", []
    listed = ", ".join(" x ".join(map(str, shape)) for shape in shapes)
    return values, axes, [f"{path.name}: the first of {len(shapes)} arrays in it: {listed}"]


def _listed(description: str, key: str) -> list[str]:
    """Names that solidtex-bake lists under a key in the description of a TIFF file."""
    found = re.search(rf"^solidtex_{key}=(.*)$", description, re.MULTILINE)
    return found[1].split() if found else []


def _tiff_voxel(file: Any) -> Voxel | None:
    """The voxel by the OME or ImageJ metadata, or what stands in its place; None if nothing does.

    The resolution of other files is often that of a printer, so its unit is not taken as a length.
    """
    if file.is_ome:
        pixels = re.search(r"<(?:\w+:)?Pixels\b[^>]*>", file.ome_metadata or "")
        found = dict(
            re.findall(r'PhysicalSize([XYZ]|[XYZ]Unit)="([^"]*)"', pixels[0] if pixels else "")
        )
        if found.get("X") and found.get("Y"):
            is_z_assumed = not found.get("Z")
            axes = "XYX" if is_z_assumed else "XYZ"
            units = [found.get(f"{axis}Unit", "um") for axis in axes]
            return voxel_of([float(found[axis]) for axis in axes], units, is_z_assumed)
        return None
    metadata = file.imagej_metadata or {}
    tags = file.pages[0].tags
    if "XResolution" not in tags or "YResolution" not in tags:
        return None
    sides = []
    for name in ("XResolution", "YResolution"):
        pixels, per_unit = tags[name].value
        if pixels == 0:
            return None
        sides.append(per_unit / pixels)
    unit = str(metadata.get("unit", ""))
    if file.imagej_metadata is None and "ResolutionUnit" in tags:
        unit = PRINT_UNITS.get(tags["ResolutionUnit"].value, "")
    units = [unit, *(str(metadata.get(f"{axis}unit", unit)) for axis in "yz")]
    spacing = metadata.get("spacing")
    if spacing is None:
        return voxel_of([*sides, sides[0]], [*units[:2], unit], is_z_assumed=True)
    return voxel_of([*sides, float(spacing)], units)
