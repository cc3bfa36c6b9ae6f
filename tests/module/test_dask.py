"""Volumes on Dask: bakes that outlive workers, schedulers and damage; lazy arrays for analysis."""

import logging
import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import solidtex

distributed = pytest.importorskip("distributed", reason="distributed is not installed")
zarr = pytest.importorskip("zarr", minversion="3", reason="zarr 3 is not installed")
xarray = pytest.importorskip("xarray", reason="xarray is not installed")
import solidtex.dask  # noqa: E402
import solidtex.xarray  # noqa: E402
from solidtex.store import Volume, bake_shard, halved, is_complete, open_store  # noqa: E402

MODEL, ORIGIN, SIZE = "granite-grey", (-9, 1 << 29, 5), (75, 21, 40)
NO_WORKER = "the scheduler has no worker, the bake waits for one"


def program() -> Path:
    path = Path(os.environ["SOLIDTEX_BUILD"]) / "bin" / "solidtex-bake"
    if not path.exists():
        pytest.skip("solidtex-bake is not built")
    return path


@pytest.fixture(scope="module")
def client() -> Iterator[distributed.Client]:
    with (
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, dashboard_address=None
        ) as cluster,
        distributed.Client(cluster) as client,
    ):
        yield client


@pytest.fixture(scope="module")
def expected() -> np.ndarray:
    return solidtex.Texture(MODEL, seed=3).eval_box(ORIGIN, SIZE).transpose(3, 2, 1, 0)


def bake(client: distributed.Client, store: object, **more: object) -> solidtex.dask.Baked:
    settings: dict = {"size": SIZE, "origin": ORIGIN, "seed": 3, "shard_size": 32} | more
    return solidtex.dask.bake(MODEL, store, client=client, **settings)


def test_a_bake_and_what_it_leaves_out(
    client: distributed.Client, tmp_path: Path, expected: np.ndarray
) -> None:
    seen: list[tuple[int, int]] = []
    store = tmp_path / "a.zarr"
    assert bake(client, store, progress=lambda *counts: seen.append(counts)) == (6, 0)
    assert seen == [(i, 6) for i in range(1, 7)]
    group = zarr.open_group(store, mode="r")
    assert np.array_equal(group["0"][:], expected)
    assert group["1"].shape == (3, 20, 11, 38)

    damaged = store / "1/c/0/1/0/2"
    data = bytearray(damaged.read_bytes())
    data[50] ^= 1
    damaged.write_bytes(data)
    (store / "0/c/0/1/0/0").unlink()
    assert bake(client, store) == (2, 4)
    assert np.array_equal(zarr.open_group(store, mode="r")["0"][:], expected)


def test_a_shard_that_is_cut_or_changed_is_not_complete(tmp_path: Path) -> None:
    """A shard of no bytes too, as a power cut may leave it."""
    volume, place = Volume(MODEL, (20, 13, 9), shard_size=16), (0, 0, 0)
    group = open_store(tmp_path / "a.zarr", volume)
    assert not is_complete(group, volume, place)
    bake_shard(group, volume, place)
    shard = tmp_path / "a.zarr/0/c/0/0/0/0"
    whole = shard.read_bytes()
    for length in (0, 1, 4, 16, len(whole) // 2, len(whole) - 52, len(whole) - 1):
        shard.write_bytes(whole[:length])
        assert not is_complete(group, volume, place), length
    for at in (0, len(whole) // 2, -52, -1):
        changed = bytearray(whole)
        changed[at] ^= 64
        shard.write_bytes(changed)
        assert not is_complete(group, volume, place), at
    shard.write_bytes(b"")
    bake_shard(group, volume, place)
    assert shard.read_bytes() == whole and is_complete(group, volume, place)


def test_a_shard_of_zeros_is_complete(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    volume, place = Volume(MODEL, (20, 13, 9), shard_size=16), (1, 0, 0)
    group = open_store(tmp_path / "a.zarr", volume)
    zeros = SimpleNamespace(
        eval_box=lambda _, size: np.zeros((*size, 3), np.float32),
        color_space="srgb",
        channels=("albedo.r", "albedo.g", "albedo.b"),
    )
    monkeypatch.setattr(Volume, "texture", lambda *_: zeros)
    bake_shard(group, volume, place)
    assert is_complete(group, volume, place) and not is_complete(group, volume, (0, 0, 0))


def test_levels_are_those_of_the_program(client: distributed.Client, tmp_path: Path) -> None:
    bake(client, tmp_path / "a.zarr")
    options = ["--size", "75,21,40", f"--origin=-9,{1 << 29},5", "--seed", "3"]
    command = [program(), MODEL, *options, "--shard-size", "32", "-o", tmp_path / "b.zarr"]
    subprocess.run(command, check=True, capture_output=True)
    a, b = (zarr.open_group(tmp_path / name, mode="r") for name in ("a.zarr", "b.zarr"))
    assert sorted(a.array_keys()) == sorted(b.array_keys()) == ["0", "1"]
    for level in a.array_keys():
        assert a[level].metadata == b[level].metadata
        assert np.abs(a[level][:] - b[level][:]).max() < 1e-6
    assert (
        a.attrs["ome"]["multiscales"][0]["datasets"] == b.attrs["ome"]["multiscales"][0]["datasets"]
    )
    refused = subprocess.run(
        [*command[:-1], tmp_path / "a.zarr"], capture_output=True, text=True, check=False
    )
    assert 'found a bake with writer "solidtex.store"' in refused.stderr


def test_another_volume_is_refused(client: distributed.Client, tmp_path: Path) -> None:
    open_store(tmp_path / "a.zarr", Volume(MODEL, SIZE, ORIGIN, 3, shard_size=32))
    with pytest.raises(solidtex.InvalidArgument, match="seed 3, expected 4"):
        bake(client, tmp_path / "a.zarr", seed=4)
    zarr.create_group(tmp_path / "b.zarr")
    with pytest.raises(solidtex.InvalidArgument, match="store of another program"):
        bake(client, tmp_path / "b.zarr")
    with pytest.raises(solidtex.InvalidArgument, match="shard_size: found 48"):
        bake(client, tmp_path / "c.zarr", shard_size=48)
    for size in (0, 1 << 31, (4, 4), (4, 4, -1)):
        with pytest.raises(solidtex.InvalidArgument, match="size: found"):
            bake(client, tmp_path / "c.zarr", size=size)
        with pytest.raises(solidtex.InvalidArgument, match="size: found"):
            solidtex.dask.array(MODEL, size)
    with pytest.raises(solidtex.InvalidArgument, match=r"size: found .*expected three whole"):
        solidtex.dask.array(MODEL, 1.5)  # type: ignore[arg-type]
    with pytest.raises(solidtex.InvalidArgument, match="chunk: found 0, expected numbers above 0"):
        solidtex.dask.array(MODEL, 8, chunk=0)
    with pytest.raises(solidtex.InvalidArgument, match=r"origin: found .*expected voxels from"):
        solidtex.dask.array(MODEL, 8, origin=(2**63, 0, 0))
    with pytest.raises(solidtex.InvalidArgument, match="GiB are free"):
        bake(client, tmp_path / "c.zarr", size=1 << 20)
    zarr.create_array(tmp_path / "d.zarr", shape=(4,), dtype="float32")
    with pytest.raises(solidtex.InvalidArgument, match="found a Zarr array"):
        bake(client, tmp_path / "d.zarr")
    with pytest.raises(solidtex.InvalidArgument, match="origin: found"):
        bake(client, tmp_path / "c.zarr", origin=(0, 0))
    with pytest.raises(solidtex.InvalidArgument, match="expected voxels from"):
        bake(client, tmp_path / "c.zarr", origin=((1 << 30) + 65500, 0, 0))
    assert not (tmp_path / "c.zarr").exists()


def test_what_is_no_store_is_refused(client: distributed.Client, tmp_path: Path) -> None:
    (tmp_path / "folder").mkdir()
    (tmp_path / "folder" / "mine.txt").write_text("mine")
    (tmp_path / "file").write_text("mine")
    for name, found in (("folder", "a folder without zarr.json"), ("file", "a file")):
        with pytest.raises(solidtex.InvalidArgument, match=f"{name}: found {found}"):
            bake(client, tmp_path / name)
    assert os.listdir(tmp_path / "folder") == ["mine.txt"]


def test_a_killed_worker_costs_nothing(
    client: distributed.Client, tmp_path: Path, expected: np.ndarray
) -> None:
    killed: list[int] = []

    def kill_one(done: int, _: int) -> None:
        if done == 2:
            killed.append(next(iter(client.run(os.getpid).values())))
            os.kill(killed[0], signal.SIGKILL)

    baked = bake(client, tmp_path / "a.zarr", progress=kill_one)
    assert sum(baked) == 6 and killed
    assert np.array_equal(zarr.open_group(tmp_path / "a.zarr", mode="r")["0"][:], expected)


class Cluster:
    """A scheduler and a worker, each a process of its own."""

    def __init__(self, port: int) -> None:
        self.port, self.processes = port, []
        self.address = f"tcp://127.0.0.1:{port}"

    def start(self) -> None:
        self.start_scheduler()
        self.start_worker()
        wait_for(self.port)

    def start_scheduler(self) -> None:
        self._start("scheduler", "--host", "127.0.0.1", "--port", str(self.port))

    def start_worker(self) -> None:
        self._start("worker", self.address, "--no-nanny", "--nthreads", "1")

    def _start(self, *command: str) -> None:
        self.processes.append(
            subprocess.Popen(
                [sys.executable, "-m", "dask", *command, "--no-dashboard"],
                stderr=subprocess.DEVNULL,
            )
        )

    def kill(self) -> None:
        for process in self.processes:
            process.kill()
            process.wait()
        self.processes.clear()


def wait_for(port: int) -> None:
    for _ in range(600):
        with socket.socket() as connection:
            if connection.connect_ex(("127.0.0.1", port)) == 0:
                return
        time.sleep(0.1)
    raise TimeoutError(f"nobody answers on port {port}")


def free_port() -> int:
    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        return found.getsockname()[1]


def test_a_scheduler_that_restarts_costs_nothing(tmp_path: Path, expected: np.ndarray) -> None:
    cluster = Cluster(free_port())
    cluster.start()
    restarts: list[int] = []

    def restart(done: int, _: int) -> None:
        if done == 2:
            restarts.append(done)
            cluster.kill()
            cluster.start()

    try:
        # The client waits as long for a new scheduler, whose start is slow on a busy machine.
        with distributed.Client(cluster.address, timeout=120) as client:
            baked = bake(client, tmp_path / "a.zarr", progress=restart)
    finally:
        cluster.kill()
    assert sum(baked) == 6 and restarts
    assert np.array_equal(zarr.open_group(tmp_path / "a.zarr", mode="r")["0"][:], expected)


def test_workers_that_come_later_are_waited_for(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """Workers of Dask end with their scheduler."""
    cluster = Cluster(free_port())
    cluster.start()

    def restart(done: int, _: int) -> None:
        if done == 2:
            cluster.kill()
            cluster.start_scheduler()

    class StartsWorker(logging.Handler):
        def emit(self, record: logging.LogRecord) -> None:
            cluster.start_worker()

    starts_worker = StartsWorker()
    log = logging.getLogger("solidtex.dask")
    log.addHandler(starts_worker)
    try:
        with distributed.Client(cluster.address, timeout=120) as client:
            baked = bake(client, tmp_path / "a.zarr", progress=restart)
    finally:
        log.removeHandler(starts_worker)
        cluster.kill()
    assert sum(baked) == 6
    assert NO_WORKER in caplog.messages


def test_that_no_worker_is_there_is_said_once(caplog: pytest.LogCaptureFixture) -> None:
    """Until there is one, then again."""
    none: dict[str, object] = {"workers": {}}
    one = {"workers": {"tcp://a": {"nthreads": 1}}}
    answers = iter([none, none, one, none, none])
    client = SimpleNamespace(scheduler_info=lambda **_: next(answers))
    crew = solidtex.dask._Crew(client, lambda _: True, 0, 1)
    said = []
    for _ in range(5):
        crew._room()
        said.append(caplog.messages.count(NO_WORKER))
    assert said == [1, 1, 1, 2, 2]


def test_a_scheduler_that_is_gone_ends_the_bake(tmp_path: Path) -> None:
    cluster = Cluster(free_port())
    cluster.start()
    try:
        with (
            distributed.Client(cluster.address, timeout=10) as client,
            pytest.raises(solidtex.Cancelled, match="the same call goes on"),
        ):
            bake(client, tmp_path / "a.zarr", patience=1, progress=lambda *_: cluster.kill())
    finally:
        cluster.kill()


@pytest.fixture(scope="module")
def s3() -> Iterator[str]:
    """Address of a server of S3's protocol, with the bucket "volumes"."""
    pytest.importorskip("moto.server", reason="moto is not installed")
    os.environ |= {"AWS_ACCESS_KEY_ID": "test", "AWS_SECRET_ACCESS_KEY": "test"}
    port = free_port()
    command = [sys.executable, "-m", "moto.server", "-H", "127.0.0.1", "-p", str(port)]
    server = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    address = f"http://127.0.0.1:{port}"
    import boto3

    try:
        wait_for(port)
        settings = {"endpoint_url": address, "region_name": "us-east-1"}
        boto3.client("s3", **settings).create_bucket(Bucket="volumes")
        yield address
    finally:
        server.kill()
        server.wait()


SMALL = (70, 20, 30)
"""Three shards in two levels: each is many requests."""


def test_object_storage_through_fsspec(
    client: distributed.Client, s3: str, expected: np.ndarray
) -> None:
    pytest.importorskip("s3fs", reason="s3fs is not installed")
    options = {"endpoint_url": s3, "key": "test", "secret": "test"}
    url = "s3://volumes/a.zarr"
    assert bake(client, url, size=SMALL, storage_options=options) == (3, 0)
    assert bake(client, url, size=SMALL, storage_options=options) == (0, 3)
    group = zarr.open_group(url, mode="r", storage_options=options)
    assert np.array_equal(group["0"][:], expected[:, :30, :20, :70])


def test_object_storage_through_obstore(
    client: distributed.Client, s3: str, expected: np.ndarray
) -> None:
    obstore = pytest.importorskip("obstore.store", reason="obstore is not installed")
    bucket = obstore.S3Store(
        "volumes",
        prefix="b.zarr",
        endpoint=s3,
        access_key_id="test",
        secret_access_key="test",
        region="us-east-1",
        client_options={"allow_http": True},
    )
    store = zarr.storage.ObjectStore(bucket)
    assert bake(client, store, size=SMALL) == (3, 0)
    assert bake(client, store, size=SMALL) == (0, 3)
    assert np.array_equal(zarr.open_group(store, mode="r")["0"][:], expected[:, :30, :20, :70])


def test_a_lazy_array_has_the_values_of_the_engine(expected: np.ndarray) -> None:
    array = solidtex.dask.array(MODEL, np.array(SIZE), origin=ORIGIN, seed=3, chunk=(32, 8, 32))
    assert array.chunksize == (32, 8, 32, 3)
    assert array.shape == (*SIZE, 3) and array.dtype == np.float32
    part = array[20:50, 5:18, 30:].compute(scheduler="synchronous")
    assert np.array_equal(part.transpose(3, 2, 1, 0), expected[:, 30:, 5:18, 20:50])


def test_xarray_names_what_there_is(expected: np.ndarray) -> None:
    volume = solidtex.xarray.open(MODEL, SIZE, origin=ORIGIN, seed=3, chunk=32)
    at = volume.sel(x=-8.5, y=(1 << 29) + 2.5, z=5.5, channel="albedo.g")
    assert float(at) == expected[1, 0, 2, 0]
    assert volume.solidtex.texture.seed == 3
    light = volume.solidtex.light().compute(scheduler="synchronous")
    low = expected[:, :2, :2, :2].transpose(3, 2, 1, 0).astype(np.float64)
    wanted = np.where(low <= 0.04045, low / 12.92, ((low + 0.055) / 1.055) ** 2.4)
    assert np.abs(light[:2, :2, :2].values - wanted).max() < 1e-6
    half = volume.solidtex.halved().compute(scheduler="synchronous")
    assert half.shape == (38, 11, 20, 3)
    mean = wanted.mean((0, 1, 2))
    encoded = np.where(mean <= 0.0031308, mean * 12.92, 1.055 * mean ** (1 / 2.4) - 0.055)
    assert np.abs(half[0, 0, 0].values - encoded).max() < 1e-6
    assert np.array_equal(half.x[:2], [-8, -6])


def test_xarray_opens_a_level_of_a_store(client: distributed.Client, tmp_path: Path) -> None:
    bake(client, tmp_path / "a.zarr")
    level = solidtex.xarray.open_store(tmp_path / "a.zarr", level=1)
    assert level.dims == ("channel", "z", "y", "x") and level.attrs["seed"] == 3
    assert np.array_equal(level.x[:2], [-8, -6])
    assert level.sel(channel="albedo.r").isel(z=0, y=0, x=0).compute().item() == pytest.approx(
        zarr.open_group(tmp_path / "a.zarr", mode="r")["1"][0, 0, 0, 0]
    )
    half = solidtex.xarray.open_store(tmp_path / "a.zarr").solidtex.halved()
    assert half.shape == level.shape and np.abs(half.values - level.values).max() < 1e-6
    with pytest.raises(solidtex.InvalidArgument, match="no path of its model"):
        level.solidtex.texture  # noqa: B018

    for missing in (-1, 2):
        with pytest.raises(
            solidtex.InvalidArgument, match=f"level: found {missing}, expected 0 to 1"
        ):
            solidtex.xarray.open_store(tmp_path / "a.zarr", level=missing)
    zarr.create_group(tmp_path / "b.zarr")
    with pytest.raises(solidtex.InvalidArgument, match="store of another program"):
        solidtex.xarray.open_store(tmp_path / "b.zarr")
    other = xarray.DataArray(np.zeros(3), dims=("channel",))
    with pytest.raises(solidtex.InvalidArgument, match="no attribute color_space"):
        other.solidtex.light()


def test_xarray_reads_integers_of_the_program(tmp_path: Path) -> None:
    options = ["--size", "6,5,4", "--depth", "8", "-o", str(tmp_path / "a.zarr")]
    subprocess.run([program(), MODEL, *options], check=True, capture_output=True)
    light = solidtex.xarray.open_store(tmp_path / "a.zarr").solidtex.light()
    expected = solidtex.xarray.open(MODEL, (6, 5, 4)).solidtex.light().transpose(*light.dims)
    assert np.abs(light.values - expected.values).max() < 0.01


def test_halves_of_odd_numbers() -> None:
    values = np.arange(3 * 2 * 1 * 1, dtype=np.float32).reshape(3, 2, 1, 1)
    assert halved(values).ravel().tolist() == [1.5, 4.5]
