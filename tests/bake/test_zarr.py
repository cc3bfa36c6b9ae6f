"""Zarr stores of solidtex-bake, read back by zarr-python; what is refused."""

import json
import os
import subprocess
from pathlib import Path

import numpy as np
import pytest

import solidtex

zarr = pytest.importorskip("zarr", minversion="3", reason="zarr 3 is not installed")

BAKE = Path(os.environ["SOLIDTEX_BUILD"]) / "bin" / "solidtex-bake"
MODEL = "granite-grey"
CAPTURED = {"capture_output": True, "text": True}
ORIGIN, SIZE = (-9, 1 << 29, 5), (75, 40, 70)
ARGUMENTS = ["--size", "75,40,70", "--origin", f"-9,{1 << 29},5", "--shard-size", "32"]


def bake(folder: Path, *arguments: object, model: str = MODEL) -> subprocess.CompletedProcess[str]:
    command = [str(BAKE), model, *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, cwd=folder)


def refusal(folder: Path, *arguments: object, model: str = MODEL) -> str:
    result = bake(folder, *arguments, model=model)
    assert result.returncode in (1, 2), result.stderr
    return result.stderr


def content(store: Path) -> dict[str, bytes]:
    return {str(p.relative_to(store)): p.read_bytes() for p in store.rglob("*") if p.is_file()}


def light(encoded: np.ndarray) -> np.ndarray:
    encoded = encoded.astype(np.float64)
    return np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)


def encoded(light: np.ndarray) -> np.ndarray:
    return np.where(
        light <= 0.0031308, light * 12.92, 1.055 * np.maximum(light, 0) ** (1 / 2.4) - 0.055
    )


def halved(values: np.ndarray) -> np.ndarray:
    """Means of the voxels that there are, two along each axis."""
    for axis in (1, 2, 3):
        first = np.moveaxis(values, axis, 0)
        means = first[::2].copy()
        means[: len(first) // 2] = (first[0 : len(first) // 2 * 2 : 2] + first[1::2]) / 2
        values = np.moveaxis(means, 0, axis)
    return values


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("store")
    result = bake(folder, *ARGUMENTS, "-o", "a.zarr", "--voxel-size", "2um")
    assert result.returncode == 0, result.stderr
    assert result.stdout == "a.zarr\n"
    return folder / "a.zarr"


@pytest.fixture(scope="module")
def expected() -> np.ndarray:
    """Of the engine, as the store has them: [channel][z][y][x]."""
    return solidtex.Texture(MODEL).eval_box(ORIGIN, SIZE).transpose(3, 2, 1, 0)


def test_the_first_level_has_the_values_of_the_engine(store: Path, expected: np.ndarray) -> None:
    array = zarr.open_group(store, mode="r")["0"]
    assert array.shape == (3, 70, 40, 75) and array.dtype == np.float32
    assert array.chunks == (1, 32, 32, 32) and array.shards == (3, 32, 32, 32)
    assert np.array_equal(array[:], expected)


def test_tensorstore_reads_the_same(store: Path, expected: np.ndarray) -> None:
    tensorstore = pytest.importorskip("tensorstore", reason="tensorstore is not installed")
    spec = {"driver": "zarr3", "kvstore": f"file://{store}/0/"}
    array = tensorstore.open(spec, open=True, read=True).result()
    assert np.array_equal(array.read().result(), expected)


def test_each_level_is_the_mean_of_light(store: Path, expected: np.ndarray) -> None:
    group = zarr.open_group(store, mode="r")
    assert sorted(group.array_keys()) == ["0", "1"]
    wanted = encoded(halved(light(expected)))
    assert group["1"].shape == wanted.shape == (3, 35, 20, 38)
    assert np.abs(group["1"][:] - wanted).max() < 1e-6
    plain = halved(expected.astype(np.float64))
    assert np.abs(plain - wanted).max() > 1e-4  # the mean of the encoded values is another


def test_a_file_of_a_shard_is_what_it_covers(store: Path) -> None:
    names = {name for name in content(store) if "/c/" in name}
    places = {f"c/0/{z}/{y}/{x}" for z in range(3) for y in range(2) for x in range(3)}
    assert names == {f"{level}/{place}" for level in (0, 1) for place in places}


def test_metadata_says_where_the_voxels_are(store: Path) -> None:
    attributes = zarr.open_group(store, mode="r").attrs
    (image,) = attributes["ome"]["multiscales"]
    assert attributes["ome"]["version"] == "0.5" and image["name"] == MODEL
    assert [axis["name"] for axis in image["axes"]] == ["c", "z", "y", "x"]
    assert image["axes"][1] == {"name": "z", "type": "space", "unit": "micrometer"}
    scale, translation = image["datasets"][1]["coordinateTransformations"]
    assert scale == {"type": "scale", "scale": [1, 4, 4, 4]}
    centers = [0, 2 * (5 + 1), 2 * (ORIGIN[1] + 1), 2 * (-9 + 1)]
    assert translation == {"type": "translation", "translation": centers}
    labels = [channel["label"] for channel in attributes["ome"]["omero"]["channels"]]
    assert labels == ["albedo.r", "albedo.g", "albedo.b"]


def test_ome_zarr_models_accept_it(store: Path) -> None:
    models = pytest.importorskip("ome_zarr_models.v05", reason="ome-zarr-models is not installed")
    image = models.Image.from_zarr(zarr.open_group(store, mode="r"))
    assert [dataset.path for dataset in image.ome_attributes.multiscales[0].datasets] == ["0", "1"]


def test_threads_and_parts_change_no_byte(store: Path, tmp_path: Path) -> None:
    arguments = [*ARGUMENTS, "-o", "b.zarr", "--voxel-size", "2um"]
    for part in ("2/2", "1/2"):
        assert bake(tmp_path, *arguments, "--threads", 3, "--shard", part).returncode == 0
    assert content(tmp_path / "b.zarr") == content(store)


@pytest.mark.parametrize(
    ("depth", "dtype", "step"),
    [("8", np.uint8, 255), ("16", np.uint16, 65535), ("half", np.float16, 1)],
)
def test_depths(tmp_path: Path, depth: str, dtype: type, step: int) -> None:
    result = bake(tmp_path, "--size", 20, "--depth", depth, "-o", "a.zarr", model="rust-red")
    assert result.returncode == 0, result.stderr
    values = zarr.open_group(tmp_path / "a.zarr", mode="r")["0"][:]
    wanted = solidtex.Texture("rust-red").eval_box((0, 0, 0), (20, 20, 20)).transpose(3, 2, 1, 0)
    assert values.dtype == dtype
    if step == 1:
        assert np.array_equal(values, wanted.astype(np.float16))
    else:
        assert np.abs(values - np.clip(wanted, 0, 1).astype(np.float64) * step).max() < 0.505


def test_linear_colors_of_one_group(tmp_path: Path) -> None:
    options = ["--color-space", "linear", "--channels", "albedo", "--format", "zarr"]
    assert bake(tmp_path, "--size", 9, *options).returncode == 0  # named by the model
    values = zarr.open_group(tmp_path / f"{MODEL}.zarr", mode="r")["0"][:]
    wanted = solidtex.Texture(MODEL).eval_box((0, 0, 0), (9, 9, 9)).transpose(3, 2, 1, 0)
    assert np.abs(values - light(wanted)).max() < 1e-6


@pytest.mark.parametrize(
    ("change", "found"),
    [
        (["--seed", "4"], "seed 0, expected 4"),
        (["--size", "17"], "size [16,16,16], expected [17,17,17]"),
        (["--origin", "0,0,1"], "origin [0,0,0], expected [0,0,1]"),
        (["--depth", "8"], 'data type "float32", expected "uint8"'),
        (["--shard-size", "32"], "shard-size 64, expected 32"),
        (["--voxel-size", "1mm"], 'unit "", expected "mm"'),
    ],
)
def test_another_command_is_refused_by_its_difference(
    tmp_path: Path, change: list[str], found: str
) -> None:
    assert bake(tmp_path, "--size", 16, "-o", "a.zarr").returncode == 0
    before = content(tmp_path / "a.zarr")
    size = [] if "--size" in change else ["--size", "16"]
    message = refusal(tmp_path, *size, "-o", "a.zarr", *change)
    assert f"a.zarr: found a bake with {found}; give another name" in message
    assert content(tmp_path / "a.zarr") == before


def test_another_model_is_refused(tmp_path: Path) -> None:
    assert bake(tmp_path, "--size", 16, "-o", "a.zarr").returncode == 0
    message = refusal(tmp_path, "--size", 16, "-o", "a.zarr", model="rust-red")
    assert "a.zarr: found a bake of another model" in message


def test_what_is_no_store_is_refused(tmp_path: Path) -> None:
    (tmp_path / "file.zarr").write_text("mine")
    assert "file.zarr: found a file" in refusal(tmp_path, "-o", "file.zarr")
    (tmp_path / "folder.zarr").mkdir()
    (tmp_path / "folder.zarr" / "mine.txt").write_text("mine")
    assert "folder.zarr: found a folder without zarr.json" in refusal(
        tmp_path, "-o", "folder.zarr", "--force"
    )
    zarr.create_group(tmp_path / "other.zarr")
    assert "other.zarr: found a Zarr store of another program" in refusal(
        tmp_path, "-o", "other.zarr"
    )
    (tmp_path / "torn.zarr").mkdir()
    (tmp_path / "torn.zarr" / "zarr.json").write_text('{"zarr_form')
    assert "torn.zarr/zarr.json: found a damaged file" in refusal(tmp_path, "-o", "torn.zarr")
    assert not list(tmp_path.rglob(".*"))
    assert (tmp_path / "folder.zarr" / "mine.txt").read_text() == "mine"


USER = 65534  # nobody: root reads what it may not


@pytest.mark.skipif(os.geteuid() != 0, reason="needs root, to become another user")
def test_what_may_not_be_read_is_said(tmp_path: Path) -> None:
    assert bake(tmp_path, "--size", 16, "-o", "a.zarr").returncode == 0
    for path in (tmp_path, *tmp_path.parents[:2], *tmp_path.rglob("*")):
        path.chmod(0o755 if path.is_dir() else 0o644)
    store = tmp_path / "a.zarr"
    command = [str(BAKE), MODEL, "--size", "16", "-o", "a.zarr"]

    def message(unreadable: Path) -> str:
        mode = unreadable.stat().st_mode
        unreadable.chmod(0)
        done = subprocess.run(
            command, cwd=tmp_path, user=USER, group=USER, extra_groups=[], **CAPTURED
        )
        unreadable.chmod(mode)
        assert done.returncode == 1
        return done.stderr

    denied = "Permission denied"
    assert f"a.zarr/zarr.json: cannot read: {denied}" in message(store / "zarr.json")
    assert f"a.zarr/0/zarr.json: cannot read: {denied}" in message(store / "0" / "zarr.json")
    assert f"solidtex-bake: a.zarr/zarr.json: {denied}" in message(store)
    assert f"solidtex-bake: a.zarr/0/zarr.json: {denied}" in message(store / "0")
    shard = store / "0/c/0/0/0/0"
    assert f"a.zarr/0/c/0/0/0/0: {denied}" in message(shard.parent)
    assert f"a.zarr/0/c/0/0/0/0: cannot read: {denied}; it is made again" in message(shard)


def test_arrays_of_another_shape_are_refused(tmp_path: Path) -> None:
    assert bake(tmp_path, "--size", 16, "-o", "a.zarr").returncode == 0
    metadata = tmp_path / "a.zarr" / "0" / "zarr.json"
    document = json.loads(metadata.read_text())
    document["shape"][1] = 17
    metadata.write_text(json.dumps(document))
    told = refusal(tmp_path, "--size", 16, "-o", "a.zarr")
    assert "other metadata in a.zarr/0/zarr.json: shape [3,17,16,16], expected [3,16" in told


def test_damage_that_is_not_made_again_has_its_own_remedy(tmp_path: Path) -> None:
    command = ("--size", 16, "-o", "a.zarr/")  # with the slash of the shell's completion
    assert bake(tmp_path, *command).returncode == 0
    store = tmp_path / "a.zarr"
    for name in ("zarr.json", "0/zarr.json"):
        whole = (store / name).read_bytes()
        (store / name).write_bytes(whole[:200])
        told = refusal(tmp_path, *command)
        assert f"a.zarr/{name}: found a damaged file, expected JSON" in told
        assert ("remove the folder" in told) == (name == "zarr.json")
        (store / name).write_bytes(whole)
    shard = store / "0/c/0/0/0/0"
    shard.unlink()
    shard.mkdir()
    told = refusal(tmp_path, *command)
    assert "a.zarr/0/c/0/0/0/0: found a folder, expected a shard; remove it" in told


@pytest.mark.parametrize(
    ("arguments", "found"),
    [
        (["--size", "0"], "--size: found 0, expected"),
        (["--size", str(1 << 31)], f"--size: found {1 << 31}, expected"),
        (["--origin", f"{(1 << 63) - 1},0,0"], "found 9223372036854775807 along x with --size 128"),
        (["--origin", f"0,{-(1 << 63)},0"], "found -9223372036854775808 along y with --size 128"),
        (["--shard", "0/4"], "--shard: found 0/4, expected I/N"),
        (["--shard", "5/4"], "--shard: found 5/4, expected I/N"),
        (["--shard", "1"], "--shard: found 1, expected I/N"),
        (["--shard-size", "48"], "--shard-size"),
        (["--block", "16"], "--block"),
    ],
)
def test_bad_options_leave_nothing(tmp_path: Path, arguments: list[str], found: str) -> None:
    assert found in refusal(tmp_path, "-o", "a.zarr", *arguments)
    assert not os.listdir(tmp_path)


def test_parts_are_for_stores_only(tmp_path: Path) -> None:
    message = refusal(tmp_path, "--size", 4, "--shard", "1/2", "-o", "a.npy")
    assert "--shard" in message and ".zarr" in message


def test_a_store_beyond_memory_is_refused(tmp_path: Path) -> None:
    message = refusal(tmp_path, "--size", 1 << 20, "-o", "a.zarr")
    assert "a.zarr: needs at least" in message and "on the disk" in message
    assert message.endswith("; --depth 8 takes less\n")
    assert not os.listdir(tmp_path)


def job(
    folder: Path, task: int, first: int, last: int, count: int, **more: str
) -> subprocess.Popen[str]:
    """A local stand-in of Slurm: a job of an array, with its variables."""
    script = Path(__file__).resolve().parents[2] / "setup" / "bake_array.slurm"
    command = [script, MODEL, *ARGUMENTS, "-o", "b.zarr", "--voxel-size", "2um"]
    array = {"ID": task, "MIN": first, "MAX": last, "COUNT": count}
    variables = {f"SLURM_ARRAY_TASK_{name}": str(value) for name, value in array.items()}
    env = os.environ | variables | {"SOLIDTEX_BAKE": str(BAKE)} | more
    return subprocess.Popen(command, cwd=folder, env=env, stderr=subprocess.PIPE, text=True)


def test_a_job_array_of_slurm_makes_the_same_store(store: Path, tmp_path: Path) -> None:
    jobs = [job(tmp_path, task, 5, 7, 3) for task in (5, 6, 7)]
    assert [job.wait() for job in jobs] == [0, 0, 0]
    assert content(tmp_path / "b.zarr") == content(store)


def test_some_parts_of_a_job_array(store: Path, tmp_path: Path) -> None:
    with_gaps = job(tmp_path, 3, 1, 3, 2)
    assert with_gaps.wait() == 2
    assert "found an array with gaps" in with_gaps.communicate()[1]
    assert not (tmp_path / "b.zarr").exists()
    for some in ((1, 3), (2,)):
        for task in some:
            assert job(tmp_path, task, some[0], some[-1], len(some), PARTS="3").wait() == 0
    assert content(tmp_path / "b.zarr") == content(store)
