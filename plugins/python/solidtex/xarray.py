"""Volumes with coordinates and names for analysis. Needs xarray, dask and, for stores, zarr 3."""

# Dask and xarray have few types.
# mypy: allow-untyped-calls
from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
import xarray
import zarr

import solidtex.dask
from solidtex.errors import InvalidArgument
from solidtex.store import encoded_channels, from_light, identity_of, to_light
from solidtex.texture import Precision, Texture


def open(
    model: str,
    size: int | Sequence[int],
    *,
    origin: Sequence[int] = (0, 0, 0),
    seed: int = 0,
    precision: Precision = "full",
    chunk: int = 128,
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
        attrs={"model": texture.path, "seed": seed, "precision": precision, "units": "texel"},
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
    dims = [axis["name"] for axis in image["axes"]]
    coords = {
        dim: first + step * np.arange(extent)
        for dim, first, step, extent in zip(dims, translation, scale, values.shape, strict=True)
        if dim != "c"
    }
    return xarray.DataArray(values, dims=dims, coords=coords, name=image["name"], attrs=identity)


@xarray.register_dataarray_accessor("solidtex")
class Accessor:
    """What DataArrays of open() can do beyond those of others."""

    def __init__(self, volume: xarray.DataArray) -> None:
        self._volume = volume

    @property
    def texture(self) -> Texture:
        """The open model."""
        attributes = self._volume.attrs
        return Texture(attributes["model"], attributes["seed"], attributes["precision"])

    def light(self) -> xarray.DataArray:
        """Colors as linear light. Other channels stay."""
        return self._convert(to_light, self._volume)

    def halved(self) -> xarray.DataArray:
        """Means of light over two voxels along each axis: half the size, encoded as before."""
        pairs = dict.fromkeys("xyz", 2)
        means = self.light().coarsen(pairs, boundary="trim").mean()
        return self._convert(from_light, means)

    def _convert(self, convert: Callable[..., Any], volume: xarray.DataArray) -> xarray.DataArray:
        texture = self.texture
        flags = dict(zip(texture.channels, encoded_channels(texture), strict=True))
        is_encoded = np.array([flags[name] for name in volume.channel.values])
        return volume.copy(data=volume.data.map_blocks(convert, is_encoded, dtype=np.float32))
