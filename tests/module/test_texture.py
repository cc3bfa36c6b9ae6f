"""The Python module: the same bits as the programs, in the caller's arrays, with errors that name
what is wrong."""

import os
import pickle
import signal
import subprocess
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
import torch

import solidtex
from solidtex import Texture

REPOSITORY = Path(__file__).resolve().parents[2]
BUILD = Path(os.environ["SOLIDTEX_BUILD"])
FIELD, SAMPLER, MAPS = "granite-grey", "granite-speckled", "paint-rusted"
ORIGIN, SIZE = (-9, (1 << 30) - 40, 5), (6, 5, 4)


@pytest.fixture(scope="module", params=[FIELD, SAMPLER])
def texture(request: pytest.FixtureRequest) -> Texture:
    return Texture(request.param, seed=3)


def places(count: int = 50) -> np.ndarray:
    return np.random.default_rng(1).uniform(-20, 20, (count, 3)).astype(np.float32)


def same_bits(a: np.ndarray, b: np.ndarray) -> bool:
    return a.shape == b.shape and a.dtype == b.dtype == np.float32 and a.tobytes() == b.tobytes()


def test_facts() -> None:
    paint = Texture(MAPS, seed=9, precision="fast", cache_limit=1 << 20)
    assert paint.name == MAPS and paint.family == "lattice"
    assert paint.channels == ("albedo.r", "albedo.g", "albedo.b", "roughness", "height")
    assert (paint.color_space, paint.seed, paint.precision) == ("srgb", 9, "fast")
    assert Path(paint.path).samefile(REPOSITORY / "models" / f"{MAPS}.solidtex")
    assert paint.metadata["channels"] == list(paint.channels)
    assert paint.parameter_count > 1000
    assert Texture(SAMPLER).family == "sampler"
    assert MAPS in repr(paint) and "roughness" in repr(paint)
    assert f"VERSION {solidtex.__version__} " in (REPOSITORY / "CMakeLists.txt").read_text()
    assert solidtex.target()


def test_models_are_listed_by_name(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    shipped = sorted(p.stem for p in (REPOSITORY / "models").glob("*.solidtex"))
    assert solidtex.models() == shipped
    (tmp_path / "own stone.solidtex").symlink_to(REPOSITORY / "models" / f"{FIELD}.solidtex")
    monkeypatch.setenv("SOLIDTEX_MODEL_PATH", str(tmp_path))
    assert solidtex.models() == sorted([*shipped, "own stone"])
    assert all(Texture(name).channels for name in ("own stone", FIELD))


def test_box_has_the_bits_of_the_baker(texture: Texture, tmp_path: Path) -> None:
    origin, size = (",".join(map(str, v)) for v in (ORIGIN, SIZE))
    command = [BUILD / "bin" / "solidtex-bake", texture.path, "--seed", "3", "--origin", origin]
    subprocess.run([*command, "--size", size, "-o", tmp_path / "a.npy"], check=True)
    voxels = texture.eval_box(ORIGIN, SIZE)
    assert same_bits(voxels, np.load(tmp_path / "a.npy"))
    assert voxels.std() > 0.01


def test_points_at_voxel_centers_have_the_bits_of_the_box(texture: Texture) -> None:
    grid = np.stack(np.meshgrid(*map(np.arange, SIZE), indexing="ij"), axis=-1) + 0.5
    assert same_bits(texture.eval_points(grid, ORIGIN), texture.eval_box(ORIGIN, SIZE))


def test_out_is_written_in_place(texture: Texture) -> None:
    points, channels = places(), len(texture.channels)
    expected = texture.eval_points(points)
    room = np.full((len(points), channels), np.nan, np.float32)
    assert texture.eval_points(points, out=room) is room and same_bits(room, expected)
    tensor = torch.zeros(len(points), channels)
    assert texture.eval_points(points, out=tensor) is tensor
    assert same_bits(tensor.numpy(), expected)
    part = np.zeros((3, *SIZE, channels), np.float32)
    texture.eval_box(ORIGIN, SIZE, out=part[1])
    assert same_bits(part[1], texture.eval_box(ORIGIN, SIZE)) and not part[::2].any()
    assert expected.flags.owndata and expected.flags.writeable
    assert torch.from_dlpack(expected).data_ptr() == expected.ctypes.data


def test_arrays_of_any_library_are_accepted(texture: Texture) -> None:
    points = places(24)
    expected = texture.eval_points(points)
    for other in (
        points.tolist(),
        points.astype(np.float64),
        np.asfortranarray(points),
        np.repeat(points, 2, axis=0)[::2],
        torch.from_numpy(points),
        torch.from_numpy(points.astype(np.float64)),
    ):
        assert same_bits(texture.eval_points(other), expected)
    shaped = texture.eval_points(points.reshape(2, 3, 4, 3))
    assert same_bits(shaped.reshape(expected.shape), expected) and shaped.shape[:3] == (2, 3, 4)
    assert same_bits(texture.eval_points(points[0]), expected[0])
    frozen = points.copy()
    frozen.flags.writeable = False
    assert same_bits(texture.eval_points(frozen), expected)
    assert texture.eval_points(np.zeros((0, 3))).shape == (0, len(texture.channels))
    assert texture.eval_box((0, 0, 0), (2, 0, 1)).shape == (2, 0, 1, len(texture.channels))


def test_origin_is_added_in_double_precision(texture: Texture) -> None:
    far = (1e9 + 0.25, -1e9, 7.5)
    near = np.float32([[0.5, 0.125, 0.25]])
    moved = texture.eval_points(near + np.float32([1, 0, 0]), (far[0] - 1, *far[1:]))
    assert same_bits(texture.eval_points(near, np.array(far)), moved)


def test_footprints(texture: Texture) -> None:
    points = places(20)
    plain = texture.eval_points(points)
    assert same_bits(texture.eval_points(points, radii=0), plain)
    radii = np.linspace(0, 6, 20, dtype=np.float32)
    mixed = texture.eval_points(points, radii=radii)
    assert same_bits(texture.eval_points(points, radii=torch.from_numpy(radii)), mixed)
    assert same_bits(texture.eval_points(points[9], radii=radii[9]), mixed[9])
    assert same_bits(mixed[0], plain[0]) and not same_bits(mixed[9], plain[9])
    wide = texture.eval_points(points, radii=np.inf)
    assert same_bits(wide, np.broadcast_to(texture.mean(), wide.shape).copy())
    box = texture.eval_box((0, 0, 0), (64, 64, 64)).reshape(-1, 3)
    assert np.abs(np.sqrt(np.square(box).mean(axis=0)) - texture.mean()).max() < 0.05


def test_footprints_with_axes(texture: Texture) -> None:
    points = places(20)
    radii = np.linspace(0, 6, 20, dtype=np.float32)
    cubes = radii[:, None, None] * np.eye(3, dtype=np.float32)
    filtered = texture.eval_points(points, radii=radii)
    assert same_bits(texture.eval_points(points, axes=cubes), filtered)
    assert same_bits(texture.eval_points(points, axes=torch.from_numpy(cubes)), filtered)
    assert same_bits(texture.eval_points(points[9], axes=cubes[9]), filtered[9])
    line = np.float32([[0, 9, 0], [0, 0, 0], [0, 0, 0]])
    along = texture.eval_points(points, axes=line)
    assert same_bits(along, texture.eval_points(points, axes=np.stack([line] * 20)))
    assert not same_bits(along, texture.eval_points(points, axes=np.roll(line, 1, axis=1)))
    # Rows are the half-edges: nothing is averaged across this one.
    steps = points[:, None] + np.linspace(-9, 9, 64)[None, :, None] * np.float32([0, 1, 0])
    mean = np.square(texture.eval_points(steps)).mean(axis=1)
    assert np.abs(np.square(along) - mean).mean() < 0.25 * np.sqrt(mean.var(axis=0)).mean() + 0.02


def test_gradients_are_derivatives(texture: Texture) -> None:
    # So short that most steps cross no edge, so long that rounding counts little.
    points, step = places(40), 0.002
    for footprint in ({}, {"radii": 1.5}, {"axes": np.diag([3, 1, 0.5])}):
        values, gradients = texture.eval_gradients(points, ORIGIN, **footprint)
        assert same_bits(values, texture.eval_points(points, ORIGIN, **footprint))
        assert gradients.shape == (*values.shape, 3)
        for axis in range(3):
            move = step * np.eye(3)[axis]
            ends = [
                texture.eval_points(points, tuple(np.add(ORIGIN, sign * move)), **footprint)
                for sign in (-1, 1)
            ]
            error = np.abs((ends[1] - ends[0]) / (2 * step) - gradients[..., axis])
            assert np.median(error) < 0.005 * np.abs(gradients).max()
    one, slope = texture.eval_gradients(points[7], ORIGIN, **footprint)
    assert same_bits(one, values[7]) and same_bits(slope, gradients[7])


def test_threads_share_a_texture(texture: Texture) -> None:
    points = [places(500)[i::4].copy() for i in range(4)]
    expected = [texture.eval_points(part) for part in points]
    with ThreadPoolExecutor(4) as pool:
        for _ in range(5):
            found = list(pool.map(texture.eval_points, points))
            assert all(same_bits(a, b) for a, b in zip(found, expected, strict=True))


def test_ctrl_c_cancels_a_query_without_the_interpreter_lock() -> None:
    """A second Python thread sees the first values appear, so the lock is free, and then presses
    Ctrl-C: what is missing shows that the query has stopped."""
    texture = Texture(FIELD)
    out = np.full((512, 256, 256, 3), np.nan, np.float32)
    seen = out[::16, ::16, ::16]
    started = threading.Event()

    def press() -> None:
        started.wait()
        while np.isnan(seen).all():
            time.sleep(0.001)
        os.kill(os.getpid(), signal.SIGINT)

    thread = threading.Thread(target=press)
    thread.start()
    with pytest.raises(KeyboardInterrupt):
        started.set()
        texture.eval_box((0, 0, 0), out.shape[:3], out=out)
        time.sleep(60)  # where the query was over before the signal came
    thread.join()
    assert np.isnan(seen).any() and not np.isnan(seen).all()


def test_a_handler_may_query_and_the_query_goes_on() -> None:
    texture = Texture(SAMPLER)
    size = (96, 96, 96)
    expected, seen = texture.eval_box((0, 0, 0), size), []
    room = np.full_like(expected, np.nan)

    def handler(*_: object) -> None:
        seen.append(texture.eval_box((0, 0, 0), (24, 24, 24)))

    def ring() -> None:
        while np.isnan(room[::8, ::8, ::8]).all():
            time.sleep(0.001)
        os.kill(os.getpid(), signal.SIGUSR1)

    before = signal.signal(signal.SIGUSR1, handler)
    thread = threading.Thread(target=ring)
    thread.start()
    texture.eval_box((0, 0, 0), size, out=room)
    thread.join()
    signal.signal(signal.SIGUSR1, before)
    assert same_bits(room, expected)
    assert len(seen) == 1 and same_bits(seen[0], expected[:24, :24, :24].copy())


def test_closing_waits_for_the_queries() -> None:
    texture = Texture(SAMPLER)
    expected = texture.eval_box((0, 0, 0), (40, 40, 40))
    room = np.full_like(expected, np.nan)
    thread = threading.Thread(target=texture.eval_box, args=((0, 0, 0), (40, 40, 40)),
                              kwargs={"out": room})  # fmt: skip
    thread.start()
    while np.isnan(room[0, 0, 0, 0]):
        time.sleep(0.0005)
    texture.close()
    texture.close()
    thread.join()
    assert same_bits(room, expected)
    with pytest.raises(solidtex.InvalidArgument, match="texture: found it closed"):
        texture.eval_points([[0, 0, 0]])
    assert "closed" in repr(texture)


def test_models_open_from_bytes_and_pickles(tmp_path: Path) -> None:
    path = REPOSITORY / "models" / f"{FIELD}.solidtex"
    expected = Texture(FIELD, seed=5).eval_box((0, 0, 0), (2, 2, 2))
    with Texture(path, 5) as texture:
        copy = pickle.loads(pickle.dumps(texture))
        assert copy.seed == 5
        for one in (texture, copy, Texture.from_bytes(path.read_bytes(), 5)):
            assert same_bits(one.eval_box((0, 0, 0), (2, 2, 2)), expected)
    assert not same_bits(Texture(path, 6).eval_box((0, 0, 0), (2, 2, 2)), expected)
    odd = tmp_path / "grün.solidtex"
    odd.write_bytes(path.read_bytes())
    assert Texture(odd).path == str(odd)
    with pytest.raises(TypeError, match="pickled"):
        pickle.dumps(Texture.from_bytes(path.read_bytes()))


def test_statistics() -> None:
    texture = Texture(FIELD)
    texture.eval_points(places(10) * 0.01 + 3)
    stats = texture.statistics()
    assert stats.misses == stats.bricks == 1 and stats.resident_bytes == stats.peak_bytes > 0
    assert stats.points == 10 and stats.voxels == 0 and stats.brick_nanoseconds > 0
    texture.eval_points(places(10) * 0.01 + 3, radii=np.ones(10) * 0)
    texture.eval_box((0, 0, 0), (2, 3, 4))
    later = texture.statistics()
    assert later.hits > stats.hits and later.misses == 1
    assert later.points == 20 and later.voxels == 24


def test_threads_of_its_own() -> None:
    texture = Texture(SAMPLER, threads=2)
    assert same_bits(texture.eval_points(places()), Texture(SAMPLER).eval_points(places()))
    with pytest.raises(ValueError, match="threads: found 5000, expected 0 to 1024"):
        Texture(SAMPLER, threads=5000)


def writable(*shape: int) -> np.ndarray:
    return np.zeros(shape, np.float32)


def test_a_period_repeats_every_bit_in_boxes_and_at_points() -> None:
    with Texture(FIELD, seed=3, period=64) as texture:
        assert texture.period == 64
        tile = texture.eval_box((0, 0, 0), (64, 64, 64))
        x, y, z = np.arange(-7, 70) % 64, np.arange(20), np.arange(130, 150) % 64
        box = texture.eval_box((-7, 64, 130), (77, 20, 20))
        assert same_bits(box, np.ascontiguousarray(tile[np.ix_(x, y, z)]))
        points = texture.eval_points(places(), (0, 0, 0))
        assert same_bits(points, texture.eval_points(places(), (64, -128, 640)))
        assert not same_bits(points, texture.eval_points(places(), (32, 0, 0)))
    with Texture(FIELD, seed=3) as endless:
        assert not same_bits(tile, endless.eval_box((0, 0, 0), (64, 64, 64)))
    with pytest.raises(solidtex.InvalidArgument, match="is 12, expected a multiple of 32 texels"):
        Texture(FIELD, period=12)
    with pytest.raises(solidtex.InvalidArgument, match="expected 0 for a model of the sampler"):
        Texture(SAMPLER, period=64)


def test_refusals_name_what_is_wrong(tmp_path: Path) -> None:
    texture = Texture(SAMPLER)
    frozen = writable(4, 3)
    frozen.flags.writeable = False
    points = places(4)
    both = places(4)
    cases = [
        (lambda: texture.eval_points(writable(4, 2)), r"points: found shape \(4, 2\)"),
        (lambda: texture.eval_points(3.0), "points: found shape"),
        (lambda: texture.eval_points("abc"), "points: found str"),
        (lambda: texture.eval_points(points + 1j), "points: found .*complex"),
        (
            lambda: texture.eval_points(points, radii=torch.zeros(1, requires_grad=True)),
            "radii: found",
        ),
        (lambda: texture.eval_points([[np.nan, 0, 0]]), "point"),
        (lambda: texture.eval_points([[0, 0, 0]], (1, 2)), "origin: found"),
        (lambda: texture.eval_points(points, radii=np.ones(3)), r"radii: found shape \(3,\)"),
        (lambda: texture.eval_points(points, radii=-1), "radi"),
        (lambda: texture.eval_points(points, axes=np.ones((4, 3))), r"axes: found shape \(4, 3\)"),
        (lambda: texture.eval_points(points, axes=np.full((3, 3), np.nan)), "axis 0 of point 0"),
        (lambda: texture.eval_points(points, radii=1, axes=np.eye(3)), "found both"),
        (lambda: texture.eval_points(points, out=writable(4, 4)), r"out: found shape \(4, 4\)"),
        (lambda: texture.eval_points(points, out=np.zeros((4, 3))), "out: found another type"),
        (lambda: texture.eval_points(points, out=writable(3, 4).T), "out: found gaps"),
        (lambda: texture.eval_points(points, out=frozen), "out: found a read-only"),
        (lambda: texture.eval_points(points, out=[[0] * 3] * 4), "out: found list"),
        (lambda: texture.eval_points(both, out=both), "out: found the memory of points"),
        (lambda: texture.eval_box((0, 0), (1, 1, 1)), "origin: found"),
        (lambda: texture.eval_box((0, 0, 0.5), (1, 1, 1)), "whole numbers"),
        (lambda: texture.eval_box((0, 0, 0), (1, -1, 1)), r"size: found \(1, -1, 1\)"),
        (lambda: texture.eval_box((1 << 40, 0, 0), (1, 1, 1)), "origin"),
        (lambda: Texture(FIELD, seed=-1), "seed: found -1"),
        (lambda: Texture(FIELD, threads=-1), "threads: found -1, expected 0 to 1024"),
        (lambda: texture.eval_box((1 << 63, 0, 0), (1, 1, 1)), "whole numbers of 64 bits"),
        (lambda: Texture(FIELD, precision="half"), "precision: found 'half'"),
        (lambda: Texture(FIELD, cache_limit=1 << 64), "cache_limit: found"),
        (lambda: Texture("a\0b"), "model: found a null byte"),
    ]
    for call, message in cases:
        with pytest.raises(ValueError, match=message) as caught:
            call()
        assert isinstance(caught.value, solidtex.InvalidArgument), caught.value


@pytest.mark.parametrize("edge", [100_000, 1 << 40, (1 << 63) - 1])
def test_boxes_that_no_memory_holds_are_refused(edge: int) -> None:
    with pytest.raises(MemoryError, match=rf"values: found no memory .*{edge}") as caught:
        Texture(FIELD).eval_box((0, 0, 0), (edge,) * 3)
    assert isinstance(caught.value, solidtex.OutOfMemory)


def test_arguments_of_a_wrong_type() -> None:
    texture = Texture(FIELD)
    with pytest.raises(TypeError, match="progress: found 5, expected a function"):
        texture.eval_box((0, 0, 0), (1, 1, 1), progress=5)
    with pytest.raises(TypeError, match="progress: found 5, expected a function"):
        texture.eval_points([0, 0, 0], progress=5)
    with pytest.raises(TypeError):
        solidtex.load(FIELD, seed=1.5)


def test_invalid_models_are_refused(tmp_path: Path) -> None:
    with pytest.raises(OSError, match="granite-grey") as caught:
        Texture("marzipan")
    assert isinstance(caught.value, solidtex.FileError)
    broken = tmp_path / "broken.solidtex"
    broken.write_bytes((REPOSITORY / "models" / f"{FIELD}.solidtex").read_bytes()[:-4])
    with pytest.raises(solidtex.ModelError, match=r"broken\.solidtex"):
        Texture(broken)
    with pytest.raises(ValueError, match="in memory"):
        Texture.from_bytes(b"nothing")


@pytest.mark.parametrize("name", [FIELD, SAMPLER])
def test_a_query_reports_its_progress_and_is_cancelled_by_it(name: str) -> None:
    texture = Texture(name)
    expected = texture.eval_box((0, 0, 0), (96, 96, 96))
    reported: list[float] = []
    found = Texture(name).eval_box((0, 0, 0), (96, 96, 96), progress=reported.append)
    assert same_bits(found, expected)
    assert reported == sorted(reported) and 0 <= reported[0] <= reported[-1] <= 1
    with pytest.raises(solidtex.Cancelled):
        texture.eval_box((0, 0, 0), (96, 96, 96), progress=lambda done: True)
    with pytest.raises(solidtex.Cancelled):
        Texture(name).eval_points(places(100000), progress=lambda done: True)

    def fail(done: float) -> None:
        raise LookupError(f"at {done}")

    with pytest.raises(LookupError, match=r"at 0\.0"):
        texture.eval_box((0, 0, 0), (96, 96, 96), progress=fail)
    assert texture.statistics().peak_scratch_bytes > 0
