"""Volumes as Zarr stores with levels of detail, one shard at a time. Needs zarr 3.

The layout is that of solidtex-bake: a shard of level k covers the same voxels as the shard at its
position of any other level, so that no shard needs another.
"""

from __future__ import annotations

import hashlib
import itertools
import math
import operator
import shutil
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any, cast

import numpy as np
import zarr
from numpy.typing import NDArray
from zarr.codecs import BloscCodec, Crc32cCodec
from zarr.core.sync import sync
from zarr.errors import ContainsArrayError

from solidtex._engine import target, version
from solidtex.arguments import Floats, triple
from solidtex.errors import FileError, InvalidArgument
from solidtex.texture import Precision, Texture

LARGEST_CHUNK = 64
COARSEST_LEVEL = 64
COMPRESSION = 2
"""No volume becomes smaller by more than this."""
SMALLEST_SHARD_OF_A_LEVEL = 16
LARGEST_SIZE = 1 << 20
LARGEST_PLACE = (1 << 30) + (1 << 16)
"""Largest magnitude of a coordinate, in texels."""
AXES = ("c", "z", "y", "x")
COLOR = "albedo."
"""Beginning of the names of color channels."""

Index3 = tuple[int, int, int]
Store = Any
"""A path, a URL of fsspec, or a store of zarr."""


def per_axis(name: str, value: int | Sequence[int]) -> Index3:
    """Whole numbers along x, y and z of an argument, which may be one for all."""
    return triple(name, [value] * 3 if np.ndim(value) == 0 else value, operator.index)


def size_of(size: int | Sequence[int]) -> Index3:
    """Voxels along x, y and z of an argument."""
    numbers = per_axis("size", size)
    if not all(1 <= number <= LARGEST_SIZE for number in numbers):
        raise InvalidArgument(
            f"size: found {size}, expected one integer, or three, from 1 to {LARGEST_SIZE}"
        )
    return numbers


def origin_of(origin: Sequence[int], size: Index3) -> Index3:
    """First voxel of an argument, for a volume of `size` voxels."""
    numbers = triple("origin", origin, operator.index)
    for first, extent in zip(numbers, size, strict=True):
        if not -LARGEST_PLACE <= first <= LARGEST_PLACE - extent:
            raise InvalidArgument(
                f"origin: found {numbers} with size {size}, expected voxels from "
                f"{-LARGEST_PLACE} to {LARGEST_PLACE - 1}"
            )
    return numbers


@dataclass(frozen=True)
class Volume:
    """Box of voxels of a model, and the shards that it is baked in."""

    model: str
    size: Index3
    origin: Index3 = (0, 0, 0)
    seed: int = 0
    precision: Precision = "full"
    shard_size: int = 128
    sha256: str = field(default="", compare=False)
    """Of the model's file; a process with another file at its path is refused."""

    def __post_init__(self) -> None:
        origin_of(self.origin, size_of(self.size))
        if self.shard_size not in (16, 32, 64, 128, 256, 512):
            raise InvalidArgument(
                f"shard_size: found {self.shard_size}, expected 16, 32, 64, 128, 256 or 512"
            )
        path = self.texture(threads=1).path
        with open(path, "rb") as file:
            found = hashlib.file_digest(file, "sha256").hexdigest()
        if self.sha256 not in ("", found):
            raise FileError(f"{path}: found another model than where the bake began")
        object.__setattr__(self, "sha256", found)

    def texture(self, threads: int = 0) -> Texture:
        return _open(self.model, self.seed, self.precision, threads)

    @property
    def levels(self) -> range:
        count = 1
        while (
            max(self.level_size(count - 1)) > COARSEST_LEVEL
            and self.shard_size >> count >= SMALLEST_SHARD_OF_A_LEVEL
        ):
            count += 1
        return range(count)

    def level_size(self, level: int) -> Index3:
        x, y, z = (-(-extent // 2**level) for extent in self.size)
        return x, y, z

    @property
    def positions(self) -> Iterator[Index3]:
        """Of all shards, x first."""
        x, y, z = (range(-(-extent // self.shard_size)) for extent in self.size)
        return ((i, j, k) for k, j, i in itertools.product(z, y, x))

    @property
    def shard_count(self) -> int:
        x, y, z = (-(-extent // self.shard_size) for extent in self.size)
        return x * y * z

    def shard_region(self, level: int, position: Index3) -> tuple[slice, slice, slice]:
        """Voxels of the level in a shard, along x, y and z."""
        edge = self.shard_size >> level
        x, y, z = (
            slice(place * edge, min((place + 1) * edge, extent))
            for place, extent in zip(position, self.level_size(level), strict=True)
        )
        return x, y, z

    @property
    def size_in_bytes(self) -> int:
        """Of all levels, before compression."""
        voxels = sum(math.prod(self.level_size(level)) for level in self.levels)
        return 4 * len(self.texture().channels) * voxels

    @property
    def identity(self) -> dict[str, Any]:
        """Settings that the values of the store depend on."""
        identity: dict[str, Any] = {
            "writer": "solidtex.store",
            "version": version(),
            "model": self.sha256,
            "size": list(self.size),
            "origin": list(self.origin),
            "seed": self.seed,
            "precision": self.precision,
            "shard-size": self.shard_size,
        }
        return identity if self.precision == "full" else identity | {"target": target()}


@lru_cache(maxsize=4)
def _open(model: str, seed: int, precision: Precision, threads: int) -> Texture:
    return Texture(model, seed, precision, threads=threads)


def open_store(
    store: Store, volume: Volume, storage_options: Mapping[str, Any] | None = None
) -> zarr.Group:
    """Create a store for the volume, or open one that was begun for the same volume."""
    options = dict(storage_options) if storage_options else None
    try:
        group = zarr.open_group(store, mode="r+", storage_options=options)
    except ContainsArrayError as error:
        raise InvalidArgument(
            f"{store}: found a Zarr array, expected a store of a bake; give another name"
        ) from error
    except (FileNotFoundError, FileExistsError):  # the second of a file
        _check_new(store, volume)
        group = zarr.create_group(
            store,
            attributes={
                "ome": _ome(volume),
                "solidtex": volume.identity | _channels(volume.texture()),
            },
            storage_options=options,
        )
    _check_identity(store, volume, identity_of(store, group))
    channels = len(volume.texture().channels)
    for level in volume.levels:
        if str(level) not in group:
            _create_level(group, volume, level, channels)
    return group


def _check_new(store: Store, volume: Volume) -> None:
    """Refuse what cannot become a store, before anything is written."""
    if not isinstance(store, str | Path) or "://" in str(store):
        return
    path = Path(store)
    if path.exists() and (not path.is_dir() or any(path.iterdir())):
        found = "a folder without zarr.json" if path.is_dir() else "a file"
        raise InvalidArgument(
            f"{store}: found {found}, expected a Zarr store, or no folder; give another name"
        )
    existing = next(folder for folder in path.absolute().parents if folder.exists())
    needed = volume.size_in_bytes // COMPRESSION
    free = shutil.disk_usage(existing).free
    if needed > free:
        raise InvalidArgument(
            f"{store}: needs more than {needed / 2**30:.1f} GiB, {free / 2**30:.1f} GiB are free "
            "there; give a smaller size, or another disk"
        )


def identity_of(store: Store, group: zarr.Group) -> dict[str, Any]:
    """What the bake of a store recorded; other programs' stores are refused."""
    found: object = group.attrs.asdict().get("solidtex")
    if not isinstance(found, dict):
        raise InvalidArgument(f"{store}: found a Zarr store of another program")
    return found


def _check_identity(store: Store, volume: Volume, found: Mapping[str, Any]) -> None:
    for key, value in volume.identity.items():
        if found.get(key) != value:
            raise InvalidArgument(
                f"{store}: found a bake with {key} {found.get(key)!r}, expected {value!r}; "
                "give another name"
            )


def _create_level(group: zarr.Group, volume: Volume, level: int, channels: int) -> None:
    edge = volume.shard_size >> level
    chunk = min(edge, LARGEST_CHUNK)
    group.create_array(
        str(level),
        shape=(channels, *reversed(volume.level_size(level))),
        dtype="float32",
        chunks=(1, chunk, chunk, chunk),
        shards=(channels, edge, edge, edge),
        compressors=[
            BloscCodec(typesize=4, cname="lz4", clevel=5, shuffle="bitshuffle"),
            Crc32cCodec(),
        ],
        fill_value=0,
        dimension_names=AXES,
    )


def _ome(volume: Volume) -> dict[str, Any]:
    datasets = []
    for level in volume.levels:
        scale = float(2**level)
        centers = [origin + scale / 2 for origin in reversed(volume.origin)]
        datasets.append(
            {
                "path": str(level),
                "coordinateTransformations": [
                    {"type": "scale", "scale": [1.0, scale, scale, scale]},
                    {"type": "translation", "translation": [0.0, *centers]},
                ],
            }
        )
    axes = [{"name": name, "type": "channel" if name == "c" else "space"} for name in AXES]
    image = {"name": volume.texture().name, "axes": axes, "datasets": datasets}
    return {"version": "0.5", "multiscales": [image]}


def _channels(texture: Texture) -> dict[str, Any]:
    """What a store says of its values, as solidtex-bake does."""
    return {"channels": list(texture.channels), "color space": {"albedo": texture.color_space}}


def is_complete(group: zarr.Group, volume: Volume, position: Index3) -> bool:
    """All levels of the shard are there, and their checksums match."""
    for level in volume.levels:
        array = _array(group, level)
        try:
            size = sync(array.store_path.store.getsize(_key(array, position)))
        except FileNotFoundError:
            return False
        if size == 0:  # zarr reads it as a shard of zeros
            return False
        x, y, z = volume.shard_region(level, position)
        try:
            array[:, z, y, x]
        except ValueError:  # crc32c
            return False
    return True


def bake_shard(group: zarr.Group, volume: Volume, position: Index3, threads: int = 0) -> None:
    """Evaluate a shard and write all of its levels, the first one last."""
    texture = volume.texture(threads)
    region = volume.shard_region(0, position)
    origin = [o + part.start for o, part in zip(volume.origin, region, strict=True)]
    values = texture.eval_box(origin, [part.stop - part.start for part in region])
    is_encoded = encoded_channels(texture)
    light = [to_light(values, is_encoded)]
    for _ in volume.levels[1:]:
        light.append(halved(light[-1]))
    for level in reversed(volume.levels):
        stored = from_light(light[level], is_encoded) if level else values
        with zarr.config.set({"array.write_empty_chunks": True}):  # zeros too: they are no gap
            array = _array(group, level)
        # At the end of a volume zarr keeps what a shard has, and fails where that is damaged.
        sync(array.store_path.store.delete(_key(array, position)))
        x, y, z = volume.shard_region(level, position)
        array[:, z, y, x] = stored.transpose(3, 2, 1, 0)


def _array(group: zarr.Group, level: int) -> zarr.Array[Any]:
    return cast("zarr.Array[Any]", group[str(level)])


def _key(array: zarr.Array[Any], position: Index3) -> str:
    x, y, z = position
    return f"{array.store_path.path}/{array.metadata.encode_chunk_key((0, z, y, x))}"


def encoded_channels(texture: Texture) -> NDArray[np.bool_]:
    """Which channels are sRGB-encoded."""
    is_srgb = texture.color_space == "srgb"
    return np.array([is_srgb and name.startswith(COLOR) for name in texture.channels])


def to_light(values: Floats, is_encoded: NDArray[np.bool_]) -> Floats:
    """Decode the encoded channels; the last axis is that of channels."""
    low = values / np.float32(12.92)
    high = np.maximum((values + np.float32(0.055)) / np.float32(1.055), 0) ** np.float32(2.4)
    decoded = np.where(values <= np.float32(0.04045), low, high)
    return np.where(is_encoded, decoded, values)


def from_light(light: Floats, is_encoded: NDArray[np.bool_]) -> Floats:
    """Encode the channels that to_light() decodes."""
    high = np.float32(1.055) * np.maximum(light, 0) ** np.float32(1 / 2.4) - np.float32(0.055)
    encoded = np.where(light <= np.float32(0.0031308), light * np.float32(12.92), high)
    return np.where(is_encoded, encoded, light)


def halved(values: Floats) -> Floats:
    """Average two voxels along each axis. Where a number is odd, the last one stays alone."""
    for axis in range(3):
        first = np.moveaxis(values, axis, 0)
        pairs = len(first) // 2 * 2
        means = first[::2].copy()
        means[: pairs // 2] = (first[:pairs:2] + first[1:pairs:2]) / 2
        values = np.moveaxis(means, 0, axis)
    return values
