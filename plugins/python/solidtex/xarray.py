"""Volumes with coordinates and names for analysis. Needs xarray, dask and, for stores, zarr 3."""

# Dask and xarray have few types.
# mypy: allow-untyped-calls, disable-error-code="no-any-return"
from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray
import zarr

import solidtex.dask
from solidtex.errors import InvalidArgument
from solidtex.store import COLOR, from_light, identity_of, to_light
from solidtex.texture import Precision, Texture

ELEMENTWISE: Any = {"dask": "allowed", "keep_attrs": True}
"""Options of apply_ufunc for conversions that arrays of Dask understand, too."""


def open(
    model: str,
    size: int | Sequence[int],
    *,
    origin: Sequence[int] = (0, 0, 0),
    seed: int = 0,
    precision: Precision = "full",
    chunk: int | Sequence[int] = 128,
) -> xarray.DataArray:
    """Volume of a model, evaluated when needed. Coordinates are centers of voxels in texels."""
    texture = Texture(model, seed, precision)
    values = solidtex.dask.array(texture, size, origin=origin, chunk=chunk)
    centers = {
        axis: np.arange(extent) + (start + 0.5)
        for axis, extent, start in zip("xyz", values.shape, origin, strict=False)
    }
    return xarray.DataArray(
        values,
        dims=("x", "y", "z", "channel"),
        coords={**centers, "channel": list(texture.channels)},
        name=texture.name,
        attrs={
            "model": texture.path,
            "seed": seed,
            "precision": precision,
            "units": "texel",
            "color_space": texture.color_space,
        },
    )


def open_store(
    store: Any, level: int = 0, storage_options: Mapping[str, Any] | None = None
) -> xarray.DataArray:
    """Level of a baked store, read when needed."""
    import dask.array

    options = dict(storage_options) if storage_options else None
    group = zarr.open_group(store, mode="r", storage_options=options)
    identity = identity_of(store, group)
    ome: Any = group.attrs["ome"]
    (image,) = ome["multiscales"]
    levels = len(image["datasets"])
    if not 0 <= level < levels:
        raise InvalidArgument(f"level: found {level}, expected 0 to {levels - 1}")
    scale, translation = (
        part[part["type"]] for part in image["datasets"][level]["coordinateTransformations"]
    )
    values = dask.array.from_zarr(group[str(level)])
    dims = ["channel" if axis["name"] == "c" else axis["name"] for axis in image["axes"]]
    coords: dict[str, Any] = {
        dim: first + step * np.arange(extent)
        for dim, first, step, extent in zip(dims, translation, scale, values.shape, strict=True)
    }
    attributes = dict(identity)
    if "channels" in identity:
        coords["channel"] = identity["channels"]
        attributes["color_space"] = identity["color space"].get("albedo", "")
    return xarray.DataArray(values, dims=dims, coords=coords, name=image["name"], attrs=attributes)


@xarray.register_dataarray_accessor("solidtex")
class Accessor:
    """What DataArrays of open() and open_store() can do beyond those of others."""

    def __init__(self, volume: xarray.DataArray) -> None:
        self._volume = volume

    @property
    def texture(self) -> Texture:
        """The open model of a volume of open()."""
        attributes = self._volume.attrs
        if "writer" in attributes:
            raise InvalidArgument("a store has no path of its model: open it by solidtex.Texture")
        return Texture(attributes["model"], attributes["seed"], attributes["precision"])

    def light(self) -> xarray.DataArray:
        """Colors as linear light. Other channels stay; integers become 0 to 1."""
        volume = self._volume
        if np.issubdtype(volume.dtype, np.integer):
            volume = volume.astype(np.float32) / np.float32(np.iinfo(volume.dtype).max)
            volume.attrs = self._volume.attrs
        return xarray.apply_ufunc(to_light, volume, self._is_encoded, **ELEMENTWISE)

    def halved(self) -> xarray.DataArray:
        """Means of light over two voxels along each axis: half the size, encoded as before.

        Where a number of voxels is odd, the last one stays alone.
        """
        pairs = {axis: 2 for axis in "xyz" if axis in self._volume.dims}
        means = self.light().coarsen(pairs, boundary="pad").mean(keep_attrs=True)
        return xarray.apply_ufunc(from_light, means, self._is_encoded, **ELEMENTWISE)

    @property
    def _is_encoded(self) -> xarray.DataArray:
        """Which channels are sRGB-encoded."""
        if "color_space" not in self._volume.attrs:
            raise InvalidArgument(
                "found no attribute color_space, expected a volume of solidtex.xarray.open(), or "
                "of open_store() and a store that names its channels"
            )
        is_srgb = self._volume.attrs["color_space"] == "srgb"
        return self._volume.channel.str.startswith(COLOR) & is_srgb
