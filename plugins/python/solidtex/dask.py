"""Bakes on a cluster of Dask, and volumes as arrays of Dask. Needs dask, distributed and zarr 3."""

# Dask has few types.
# mypy: allow-untyped-calls, disable-error-code="no-any-return"
from __future__ import annotations

import itertools
import logging
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

import dask.array
import distributed
import numpy as np
import zarr

from solidtex.arguments import Floats
from solidtex.errors import Cancelled, InvalidArgument
from solidtex.store import (
    Index3,
    Store,
    Volume,
    bake_shard,
    is_complete,
    open_store,
    origin_of,
    per_axis,
    size_of,
)
from solidtex.texture import Precision, Texture

TASKS_PER_THREAD = 3
"""Tasks at the scheduler: enough that no worker waits, few enough for any number of shards."""

_log = logging.getLogger(__name__)


class Baked(NamedTuple):
    """Outcome of a bake."""

    made: int
    """Shards that were made."""
    kept: int
    """Shards that were there and intact."""


def bake(
    model: str | Texture,
    store: Store,
    size: int | Sequence[int],
    *,
    client: distributed.Client | None = None,
    origin: Sequence[int] = (0, 0, 0),
    seed: int = 0,
    precision: Precision = "full",
    shard_size: int = 128,
    storage_options: Mapping[str, Any] | None = None,
    retries: int = 3,
    progress: Callable[[int, int], object] | None = None,
    patience: float = 300,
) -> Baked:
    """Bake a volume to a Zarr store with levels of detail, one task for each shard.

    After an interruption the same call makes only what is missing or damaged.

    model: Path or name, or an open texture, which also gives seed and precision. Every worker
        opens the file at the same path, and refuses another one.
    store: Path that all workers see, URL of fsspec such as "s3://bucket/a.zarr", or a store of
        zarr, such as zarr.storage.ObjectStore for obstore.
    size: Voxels along x, y and z, or one number for all.
    client: Client of the cluster. By default the current one.
    shard_size: Voxels along the edges of a shard: 16, 32, 64, 128, 256 or 512. A task needs the
        memory of about five shards.
    storage_options: Options of fsspec.
    retries: How often a task that fails is tried again. Tasks of a worker that dies are begun
        again by others.
    progress: Called with the numbers of finished shards and of all.
    patience: Seconds to wait for a scheduler that is away.
    """
    if isinstance(model, Texture):
        seed, precision, model = model.seed, model.precision, model.path
    extent = size_of(size)
    volume = Volume(model, extent, origin_of(origin, extent), seed, precision, shard_size)
    open_store(store, volume, storage_options)
    task = partial(_bake_shard, volume, store, storage_options)
    crew = _Crew(client or distributed.get_client(), task, retries, patience)
    counts = [0, 0]
    for made in crew.run(volume.positions):
        counts[made] += 1
        if progress:
            progress(sum(counts), volume.shard_count)
    return Baked(made=counts[True], kept=counts[False])


def _bake_shard(
    volume: Volume, store: Store, storage_options: Mapping[str, Any] | None, position: Index3
) -> bool:
    """Make a shard unless it is there and intact. Return True if it was made."""
    volume = replace(volume)  # checks this machine's model
    options = dict(storage_options) if storage_options else None
    group = zarr.open_group(store, mode="r+", storage_options=options)
    if is_complete(group, volume, position):
        return False
    bake_shard(group, volume, position, threads=distributed.get_worker().state.nthreads)
    return True


class _Crew:
    """Runs one task for each position, also when workers die and the scheduler restarts."""

    def __init__(
        self,
        client: distributed.Client,
        task: Callable[[Index3], bool],
        retries: int,
        patience: float,
    ) -> None:
        self._client, self._task, self._retries = client, task, retries
        self._patience = patience
        self._has_workers = True
        self._running: dict[distributed.Future[Any], Index3] = {}

    def run(self, positions: Iterator[Index3]) -> Iterator[bool]:
        last_seen = time.monotonic()
        while True:
            for position in itertools.islice(positions, max(self._room(), 0)):
                self._submit(position)
            if not self._running:
                return
            finished = self._finished()
            if finished or self._client.status == "running":
                last_seen = time.monotonic()
            elif time.monotonic() - last_seen > self._patience or self._client.status == "closed":
                raise Cancelled("the scheduler is gone; the same call goes on from what is done")
            for future in finished:
                position = self._running.pop(future)
                if future.status in ("cancelled", "lost"):  # with a scheduler that is no more
                    self._submit(position)
                else:
                    yield future.result()

    def _room(self) -> int:
        workers = self._client.scheduler_info(n_workers=-1).get("workers", {}).values()
        if self._has_workers and not workers:
            _log.warning("the scheduler has no worker, the bake waits for one")
        self._has_workers = bool(workers)
        threads = sum(worker["nthreads"] for worker in workers)
        return TASKS_PER_THREAD * max(threads, 1) - len(self._running)

    def _submit(self, position: Index3) -> None:
        future = self._client.submit(
            self._task, position, pure=False, retries=self._retries, key=None
        )
        self._running[future] = position

    def _finished(self) -> list[distributed.Future[Any]]:
        """Futures that are not pending, after at most a second."""
        deadline = time.monotonic() + 1
        while time.monotonic() < deadline:
            finished = [future for future in self._running if future.status != "pending"]
            if finished:
                return finished
            time.sleep(0.02)
        return []


def array(
    model: str | Texture,
    size: int | Sequence[int],
    *,
    origin: Sequence[int] = (0, 0, 0),
    seed: int = 0,
    precision: Precision = "full",
    chunk: int | Sequence[int] = 128,
) -> dask.array.Array:
    """Volume as an array of Dask, `[x][y][z][channel]`, evaluated chunk by chunk when needed.

    chunk: Voxels of a chunk along x, y and z, or one number for all. A chunk is evaluated whole,
        so chunks that are flat along an axis suit slices across it.
    """
    texture = model if isinstance(model, Texture) else Texture(model, seed, precision)
    extent = size_of(size)
    corner = origin_of(origin, extent)
    edges = per_axis("chunk", chunk)
    if min(edges) < 1:
        raise InvalidArgument(f"chunk: found {chunk}, expected numbers above 0")
    chunks = dask.array.core.normalize_chunks(edges, shape=extent)
    return dask.array.map_blocks(
        partial(_block, texture, corner),
        chunks=(*chunks, (len(texture.channels),)),
        dtype=np.float32,
        meta=np.empty((0, 0, 0, 0), np.float32),
        name=f"solidtex-{texture.name}-{dask.base.tokenize(texture.path, seed, corner, edges)}",
    )


def _block(
    texture: Texture, origin: Index3, block_info: Mapping[None, Mapping[str, Any]]
) -> Floats:
    places = block_info[None]["array-location"][:3]
    corner = [start + first for (start, _), first in zip(places, origin, strict=True)]
    return texture.eval_box(corner, [end - start for start, end in places])
