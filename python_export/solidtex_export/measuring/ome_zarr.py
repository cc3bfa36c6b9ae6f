"""Images of OME-Zarr, versions 0.4 and 0.5: https://ngff.openmicroscopy.org."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from solidtex_export.measuring.voxels import VolumeError, Voxel, voxel_of

WRITER = "solidtex"  # attribute of the stores of solidtex-bake


@dataclass
class _Image:
    """Finest level of an image, as the attributes of its group say."""

    level: str
    units: dict[str, str]
    """Unit of each axis, in the order of the array's."""
    scales: list[list[float]]
    """Each has an edge for each axis; the voxel has the product of them."""
    channels: tuple[str, ...]
    """Names; empty if one has none."""


def read_image(path: Path) -> tuple[NDArray[Any], Voxel | None, tuple[str, ...]]:
    """Return the finest level [x, y, z] or [x, y, z, channel], its voxel and its channels' names.

    The package zarr reads it; ModuleNotFoundError if it is not there.
    """
    import zarr

    group = zarr.open(path, mode="r")
    attributes = dict(group.attrs)
    ome: Any = attributes.get("ome", attributes)
    if not isinstance(group, zarr.Group) or "multiscales" not in ome:
        raise VolumeError(
            f"{path}: found no multiscales in the attributes, expected an OME-Zarr image of version"
            " 0.4 or 0.5; save its values [x, y, z] as .npy by numpy.save"
        )
    try:
        image = _image(ome)
    except (AttributeError, LookupError, TypeError) as error:
        raise ValueError(f"damaged attributes: {error!r}") from error
    level = group.get(image.level)
    if not isinstance(level, zarr.Array) or level.ndim != len(image.units):
        raise VolumeError(
            f"{path}: found no array {image.level} with {len(image.units)} axes, expected that of"
            " the finest level; write or copy the folder again"
        )
    for scale in image.scales:
        if len(scale) != level.ndim:
            raise VolumeError(
                f"{path}: coordinateTransformations: found a scale of {len(scale)} numbers,"
                f" expected {level.ndim}, one for each axis; write the attributes again"
            )
    if WRITER in attributes:  # other programs leave out shards of zeros
        _check_whole(path, level, path / image.level)
    values = _values(path, level, list(image.units))
    edges = dict(zip(image.units, np.prod(image.scales, axis=0).tolist(), strict=True))
    voxel = voxel_of([edges[axis] for axis in "xyz"], [image.units[axis] for axis in "xyz"])
    return values, voxel, image.channels


def _image(ome: Any) -> _Image:
    image = ome["multiscales"][0]
    finest = image["datasets"][0]
    units = {str(axis["name"]): str(axis.get("unit", "")) for axis in image["axes"]}
    parts = [*finest["coordinateTransformations"], *image.get("coordinateTransformations", [])]
    scales = [[float(edge) for edge in part["scale"]] for part in parts if "scale" in part]
    channels = tuple(c.get("label") for c in ome.get("omero", {}).get("channels", []))
    names = tuple(map(str, channels)) if all(channels) else ()
    return _Image(str(finest["path"]), units, scales or [[1.0] * len(units)], names)


def _check_whole(path: Path, level: Any, folder: Path) -> None:
    """Refuse an interrupted bake, whose missing shards would read as zeros."""
    edges = level.shards or level.chunks
    expected = math.prod(-(-n // edge) for n, edge in zip(level.shape, edges, strict=True))
    found = sum(file.name.isdigit() for file in folder.rglob("*") if file.is_file())
    if found < expected:
        raise VolumeError(
            f"{path}: found {found} of {expected} shards, expected all; run the same solidtex-bake"
            " command again, which goes on with it"
        )


def _values(path: Path, level: Any, axes: list[str]) -> NDArray[Any]:
    lengths = dict(zip(axes, level.shape, strict=True))
    kept = [axis for axis in "xyzc" if axis in lengths]
    others = [axis for axis in axes if axis not in kept]
    if kept[:3] != list("xyz") or any(lengths[axis] != 1 for axis in others):
        found = ", ".join(f"{length} along {axis}" for axis, length in lengths.items())
        raise VolumeError(
            f"{path}: axes: found {found}, expected x, y and z, and channels c; save one volume"
            " [x, y, z] of it as .npy by numpy.save"
        )
    order = [axes.index(axis) for axis in (*others, *kept)]
    values: NDArray[Any] = np.asarray(level).transpose(order)
    return values[(0,) * len(others)]
