"""solidtex-bake without enough memory or disk: a sentence that says so, and nothing left behind."""

import os
import re
import resource
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).resolve().parents[2]
BAKE = Path(os.environ["SOLIDTEX_BUILD"]) / "bin" / "solidtex-bake"
VASE = ["--mesh", REPOSITORY / "scenes" / "meshes" / "vase.ply", "--to"]
SIZE = r"\d+(\.\d)? (bytes|[KMGTPE]iB)"
MIB = 1 << 20


def bake(folder: Path, *arguments: object, **limits: int) -> subprocess.CompletedProcess[str]:
    """Runs in the folder, under limits such as `AS=100 << 20`."""

    def limit() -> None:
        for name, value in limits.items():
            resource.setrlimit(getattr(resource, f"RLIMIT_{name}"), (value, value))

    command = [str(BAKE), *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, cwd=folder, preexec_fn=limit)


def refusal(folder: Path, *arguments: object, **limits: int) -> str:
    """The message of a bake that fails, which is all that it leaves."""
    before = sorted(os.listdir(folder))
    result = bake(folder, *arguments, **limits)
    assert result.returncode == 1, result.stderr
    assert sorted(os.listdir(folder)) == before
    *_, message = result.stderr.splitlines()
    assert message.startswith("solidtex-bake: ")
    return message


OUTPUTS = {
    "npy": (["-o", "a.npy"], "on the disk"),
    "vdb": (["-o", "a.vdb"], "of memory"),
    "png": (["-o", "a", "--slices", "png"], "on the disk"),
    "exr": (["-o", "a", "--slices", "exr"], "on the disk"),
}


@pytest.mark.parametrize("kind", OUTPUTS)
def test_an_output_without_room_is_refused_before_the_first_voxel(
    tmp_path: Path, kind: str
) -> None:
    output, of_what = OUTPUTS[kind]
    size = 20000 if kind == "vdb" else 8000  # 8000: a machine has the memory of a slice
    message = refusal(tmp_path, "porous-rock", "--size", size, *output)
    needed = f"at least {SIZE}" if kind in ("png", "exr") else SIZE  # those are compressed
    assert re.search(f"a(.npy|.vdb)?: needs {needed} {of_what}, {SIZE} are ", message)
    if kind == "vdb":
        assert "needs 89.1 TiB" in message and ".npy" in message and "--slices" in message


@pytest.mark.parametrize("kind", ["png", "exr"])
def test_a_slice_without_room_is_refused(tmp_path: Path, kind: str) -> None:
    message = refusal(tmp_path, "--size", "1048576,1048576,1", *OUTPUTS[kind][0])
    assert re.search(f"needs 36.0 TiB of memory, {SIZE} are available; .zarr and .npy", message)


@pytest.mark.parametrize("kind", OUTPUTS)
def test_a_limit_of_file_sizes_is_refused_with_both_numbers(tmp_path: Path, kind: str) -> None:
    message = refusal(tmp_path, "--size", 64, *OUTPUTS[kind][0], FSIZE=1000)
    needed = SIZE if kind == "npy" else f"at least {SIZE}"
    assert re.search(rf"needs {needed} in one file, 1000 bytes are allowed \(ulimit -f\)", message)


def test_the_header_of_an_npy_counts(tmp_path: Path) -> None:
    values, header = 4 * 4 * 4 * 3 * 4, 128
    message = refusal(tmp_path, "--size", 4, "-o", "a.npy", FSIZE=values + header - 1)
    assert "a.npy: needs 896 bytes in one file, 895 bytes are allowed" in message
    assert bake(tmp_path, "--size", 4, "-o", "a.npy", FSIZE=values + header).returncode == 0
    assert (tmp_path / "a.npy").stat().st_size == values + header


@pytest.mark.parametrize(
    "output", [["--preview", "a.png"], [*VASE, "uv", "--size", 64, "-o", "a.exr"]]
)
def test_a_signal_of_a_file_too_large_is_a_message(tmp_path: Path, output: list) -> None:
    if "uv" in output:
        cube = tmp_path / "flat.obj"
        corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\n"
        cube.write_text(corners + "f 1/1 2/2 3/3\n")
        output = ["--mesh", cube, *output[2:]]
    message = refusal(tmp_path, "granite-speckled", *output, FSIZE=1000)
    assert re.search(r"a\.(png|exr): cannot write: File too large", message)


@pytest.mark.parametrize(
    "arguments",
    [
        ["--size", 192, "-o", "a.vdb"],
        ["--size", "2000,2000,4", "--slices", "exr", "-o", "a"],
        ["--size", "256,256,64", "-o", "a.npy"],
        ["--preview", "a.png"],
    ],
    ids=["vdb", "slices", "npy", "preview"],
)
def test_memory_that_runs_out_is_a_message(tmp_path: Path, arguments: list) -> None:
    message = refusal(tmp_path, "--threads", 1, *arguments, AS=160 * MIB)
    assert re.search(f"out of memory: |needs {SIZE} of memory, {SIZE} are available", message)


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """A disk of 1 MiB."""
    folder = tmp_path / "disk"
    folder.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=1m", "none", folder]
    if os.geteuid() != 0 or subprocess.run(mount, capture_output=True).returncode != 0:
        pytest.skip("may not mount a disk")
    yield folder
    subprocess.run(["umount", folder], check=True)


@pytest.mark.parametrize("kind", OUTPUTS)
def test_a_small_disk_is_refused_before_the_first_voxel(small_disk: Path, kind: str) -> None:
    message = refusal(small_disk, "--size", 128, *OUTPUTS[kind][0])
    needed = SIZE if kind == "npy" else f"at least {SIZE}"
    assert re.search(f"needs {needed} on the disk, 1.0 MiB are free there", message)


@pytest.mark.parametrize("kind", ["vdb", "png", "exr"])
def test_a_disk_that_becomes_full_is_a_message(small_disk: Path, kind: str) -> None:
    size = {"vdb": "50", "png": "64,64,124", "exr": "32,32,99"}[kind]
    message = refusal(small_disk, "--size", size, *OUTPUTS[kind][0])
    assert re.search(r": a(.vdb|/0\d\d\d.(png|exr)): cannot write: No space left", message)


WARNING = rf"a(\.zarr|\.vdb|): takes up to {SIZE} on the disk, {SIZE} are free there; "


@pytest.mark.parametrize("kind", ["vdb", "png", "exr"])
def test_a_compressed_output_that_may_not_fit_is_said_at_the_start(
    small_disk: Path, kind: str
) -> None:
    """How small it becomes is not known before."""
    size = {"vdb": "45,45,45", "png": "64,64,100", "exr": "32,32,90"}[kind]
    result = bake(small_disk, "--size", size, *OUTPUTS[kind][0])
    assert re.match(WARNING + "a bake that fills it stops and leaves nothing\n", result.stderr)
    assert result.stderr.count("takes up to") == 1


def test_a_store_that_may_not_fit_is_said_and_goes_on_with_more_room(small_disk: Path) -> None:
    """Between the room that it needs at least and the most that it can take."""
    store = ["granite-grey", "--size", "64,64,32", "--shard-size", "32", "--format", "zarr"]
    store += ["-o", "a.zarr"]
    (small_disk / "filler").write_bytes(bytes(MIB // 10))
    failed = bake(small_disk, *store)
    assert re.match(
        WARNING + "where it becomes full the bake stops, and the same command goes on when there "
        "is room\n",
        failed.stderr,
    )
    assert failed.returncode == 1 and "No space left" in failed.stderr.splitlines()[-1]
    assert not list(small_disk.rglob(".*"))
    subprocess.run(["mount", "-o", "remount,size=4m", small_disk], check=True)
    kept = {path: path.stat().st_mtime_ns for path in small_disk.rglob("*/c/*/*/*/*")}
    done = bake(small_disk, *store)
    assert done.returncode == 0 and "takes up to" not in done.stderr
    assert kept and all(path.stat().st_mtime_ns == time for path, time in kept.items())


def test_a_checkpoint_on_a_full_disk_is_a_message(small_disk: Path, tmp_path: Path) -> None:
    (small_disk / "filler").write_bytes(bytes(MIB))
    job = ["granite-grey", *VASE, "vertex-color", "-o", tmp_path / "a.ply", "--checkpoint", "state"]
    assert "state: cannot write: No space left" in refusal(small_disk, *job)
    assert not (tmp_path / "a.ply").exists()


def test_a_read_only_disk_is_a_message(small_disk: Path) -> None:
    subprocess.run(["mount", "-o", "remount,ro", small_disk], check=True)
    for output in (*(output for output, _ in OUTPUTS.values()), ["--preview", "a.png"]):
        assert "cannot write: Read-only file system" in refusal(small_disk, "--size", 4, *output)


def test_a_name_as_long_as_the_file_system_allows(tmp_path: Path) -> None:
    name = "a" * 251 + ".npy"
    assert bake(tmp_path, "--size", 4, "-o", name).returncode == 0
    assert os.listdir(tmp_path) == [name]
    assert "File name too long" in refusal(tmp_path, "--size", 4, "-o", "a" + name)


@pytest.mark.parametrize(
    ("name", "arguments"),
    [
        ("A.NPY", ["--size", 4]),
        ("A.VDB", ["--size", 4]),
        ("A.PNG", []),
        ("A.PLY", [*VASE, "vertex-color", "--texels-per-unit", 1]),
        ("A.EXR", ["--mesh", "flat.obj", "--to", "uv", "--size", 16]),
    ],
)
def test_extensions_in_capitals(tmp_path: Path, name: str, arguments: list) -> None:
    corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\n"
    (tmp_path / "flat.obj").write_text(corners + "f 1/1 2/2 3/3\n")
    option = "--preview" if name == "A.PNG" else "-o"
    result = bake(tmp_path, "granite-speckled", *arguments, option, name)
    assert result.returncode == 0, result.stderr
    assert sorted(os.listdir(tmp_path)) == sorted([name, "flat.obj"])


def test_a_model_in_capitals(tmp_path: Path) -> None:
    shutil.copy(REPOSITORY / "models" / "granite-grey.solidtex", tmp_path / "A.SOLIDTEX")
    result = bake(tmp_path, "A.SOLIDTEX", "--size", 4, "-o", "a.npy")
    assert result.returncode == 0, result.stderr
