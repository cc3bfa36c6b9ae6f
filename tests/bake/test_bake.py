"""solidtex-bake as a program: what it writes, bit for bit, and what it refuses."""

import json
import os
import resource
import shutil
import signal
import subprocess
import time
from pathlib import Path

import numpy as np
import pytest

import solidtex

BUILD = Path(os.environ["SOLIDTEX_BUILD"])
BAKE = BUILD / "bin" / "solidtex-bake"
MODEL = "granite-grey"
SIZE, ORIGIN, SEED = (40, 21, 37), (-9, 1 << 30, 5), 3
ARGUMENTS = ["--size", "40,21,37", "--origin", f"-9,{1 << 30},5", "--seed", "3"]


def bake(*arguments: object, model: str = MODEL, **options) -> subprocess.CompletedProcess[str]:
    command = [str(BAKE), model, *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, **options)


def baked(path: Path, *arguments: object) -> np.ndarray:
    result = bake("-o", path, *arguments)
    assert result.returncode == 0, result.stderr
    return np.load(path)


def same_bits(a: np.ndarray, b: np.ndarray) -> bool:
    return a.shape == b.shape and a.dtype == b.dtype and a.tobytes() == b.tobytes()


def eval_box(origin: tuple, size: tuple, seed: int) -> np.ndarray:
    """The same voxels through the C API."""
    return solidtex.Texture(MODEL, seed).eval_box(origin, size)


@pytest.fixture(scope="module")
def expected() -> np.ndarray:
    return eval_box(ORIGIN, SIZE, SEED)


@pytest.mark.parametrize("block", ["", "7", "16", "64"])
@pytest.mark.parametrize("threads", ["1", "3"])
def test_npy_equals_the_api(tmp_path: Path, expected: np.ndarray, block: str, threads: str) -> None:
    more = ["--block", block] if block else []
    values = baked(tmp_path / "a.npy", *ARGUMENTS, "--threads", threads, *more)
    assert same_bits(values, expected)
    assert values.std() > 0.01
    assert os.listdir(tmp_path) == ["a.npy"]


def test_box_of_a_larger_bake(tmp_path: Path, expected: np.ndarray) -> None:
    arguments = ["--size", "48,24,40", "--origin", f"-12,{(1 << 30) - 2},4", "--seed", "3"]
    large = baked(tmp_path / "large.npy", *arguments)
    assert same_bits(np.ascontiguousarray(large[3:43, 2:23, 1:38]), expected)


def test_opposite_faces_of_a_periodic_box_meet(tmp_path: Path) -> None:
    size = 64
    values = baked(tmp_path / "a.npy", "--size", size, "--seed", SEED, "--periodic")
    texture = solidtex.Texture(MODEL, SEED, period=size)
    assert same_bits(values, texture.eval_box((0, 0, 0), (size,) * 3))
    # The box moved by half its size has the old faces in its middle.
    half = size // 2
    moved = texture.eval_box((half,) * 3, (size,) * 3)
    assert same_bits(np.ascontiguousarray(np.roll(values, -half, (0, 1, 2))), moved)
    steps = [np.abs(np.diff(values, axis=axis)).mean() for axis in range(3)]
    for axis, step in enumerate(steps):
        joint = np.abs(values.take(0, axis) - values.take(-1, axis)).mean()
        assert joint < 1.5 * step
    plain = baked(tmp_path / "b.npy", "--size", size, "--seed", SEED)
    assert np.abs(plain[0] - plain[-1]).mean() > 1.5 * steps[0]


def test_model_and_size_have_defaults(tmp_path: Path) -> None:
    result = subprocess.run(
        [BAKE, "--size", "5", "-o", tmp_path / "a.npy"], capture_output=True, text=True
    )
    assert result.returncode == 0, result.stderr
    assert same_bits(np.load(tmp_path / "a.npy"), eval_box((0, 0, 0), (5, 5, 5), 0))


def test_vdb_round_trip(tmp_path: Path, expected: np.ndarray) -> None:
    reader = BUILD / "bin" / "solidtex_dump_vdb"
    if not reader.exists():
        pytest.skip("built without OpenVDB")
    result = bake("-o", tmp_path / "a.vdb", *ARGUMENTS, "--block", 16)
    assert result.returncode == 0, result.stderr
    assert "MiB of memory" in result.stderr
    dump = subprocess.run([reader, tmp_path / "a.vdb"], capture_output=True, check=True).stdout
    line, voxels = dump.split(b"\n", 1)
    grid = json.loads(line)
    assert grid["name"] == "albedo"
    assert (tuple(grid["origin"]), tuple(grid["size"])) == (ORIGIN, SIZE)
    assert grid["active"] == np.prod(SIZE)
    assert grid["world"][0] == ORIGIN[0] + 0.5
    assert voxels == expected.tobytes()


def read_image(path: Path) -> np.ndarray:
    import skimage.io

    return skimage.io.imread(path)


def test_png_slices(tmp_path: Path, expected: np.ndarray) -> None:
    folder = tmp_path / "slices"
    assert bake("-o", folder, "--slices", "png", *ARGUMENTS, "--block", 16).returncode == 0
    assert sorted(os.listdir(folder)) == [f"{z:04}.png" for z in range(SIZE[2])]
    for z in (0, 15, 16, SIZE[2] - 1):
        image = read_image(folder / f"{z:04}.png")  # [y][x][channel]
        wanted = np.clip(expected[:, :, z], 0, 1).transpose(1, 0, 2) * 255
        assert np.abs(image - wanted).max() <= 0.501


def test_exr_slices(tmp_path: Path) -> None:
    folder = tmp_path / "slices"
    assert bake("-o", folder, "--slices", "exr", "--size", "9,5,3").returncode == 0
    assert sorted(os.listdir(folder)) == ["0000.exr", "0001.exr", "0002.exr"]
    info = ["oiiotool", "--info", "-v", "--stats", str(folder / "0001.exr")]
    text = subprocess.run(info, capture_output=True, text=True, check=True).stdout
    assert "9 x    5, 3 channel, float openexr" in text and "channel list: R, G, B" in text
    encoded = eval_box((0, 0, 1), (9, 5, 1), 0).astype(np.float64)
    linear = np.where(encoded > 0.04045, ((encoded + 0.055) / 1.055) ** 2.4, encoded / 12.92)
    stats = next(line for line in text.splitlines() if "Stats Avg" in line)
    found = [float(value) for value in stats.split(":")[1].split()[:3]]
    assert np.allclose(found, linear.mean(axis=(0, 1, 2)), atol=1e-5)


def test_preview(tmp_path: Path) -> None:
    result = bake("--size", "16", "--preview", tmp_path / "a.png")
    assert result.returncode == 0, result.stderr
    image = read_image(tmp_path / "a.png").astype(float)
    border = image[:8].reshape(-1, 3)
    assert (border == border[0]).all() and np.ptp(border[0]) == 0  # neutral
    assert image[300:500, 300:500].std() > 5  # the cube
    for y, x in ((40, 790), (40, 1160), (410, 790), (410, 1160)):
        assert image[y : y + 330, x : x + 330].std() > 5  # the slices
    assert os.listdir(tmp_path) == ["a.png"]


def test_existing_files_are_kept_unless_forced(tmp_path: Path) -> None:
    path = tmp_path / "a.npy"
    path.write_text("mine")
    result = bake("-o", path, "--size", 4)
    assert result.returncode == 1 and "--force" in result.stderr
    assert path.read_text() == "mine"
    assert baked(path, "--size", 4, "--force").shape == (4, 4, 4, 3)
    folder = tmp_path / "folder"
    folder.mkdir()
    (folder / "mine.txt").write_text("mine")
    for force in ([], ["--force"]):
        result = bake("-o", folder, "--slices", "png", "--size", 4, *force)
        assert result.returncode == 1 and str(folder) in result.stderr
        assert os.listdir(folder) == ["mine.txt"]


@pytest.mark.parametrize("name", ["a.npy", "a.vdb", "folder"])
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_interruption_leaves_nothing(tmp_path: Path, name: str, number: int) -> None:
    more = ["--slices", "png"] if name == "folder" else []
    size = "2000" if name == "folder" else "2000,100,100"
    command = [BAKE, MODEL, "--size", size, "--block", "16", "-o", tmp_path / name, *more]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as process:
        if name == "a.vdb":
            process.stderr.readline()  # the grids, which live in memory, are being filled
        deadline = time.monotonic() + 60
        while name != "a.vdb" and not os.listdir(tmp_path) and time.monotonic() < deadline:
            time.sleep(0.05)
        time.sleep(0.5)
        process.send_signal(number)
        assert process.wait(60) == 130
        assert "interrupted" in process.stderr.read()
    assert os.listdir(tmp_path) == []


# Limits of a file's size that the values alone could keep to, and the file does not.
@pytest.mark.parametrize(
    ("name", "limit"), [("a.nrrd", 4 * 3 * 30**3), ("a.vdb", 200_000), ("folder", 1000)]
)
def test_a_write_that_fails_is_reported(tmp_path: Path, name: str, limit: int) -> None:
    def limit_files() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))

    more = ["--slices", "png"] if name == "folder" else []
    options = {"preexec_fn": limit_files, "restore_signals": False}
    result = bake("-o", tmp_path / name, "--size", "30", *more, **options)
    assert result.returncode == 1
    assert f"{tmp_path / name}" in result.stderr and ".tmp" not in result.stderr
    assert "cannot write: File too large" in result.stderr
    assert os.listdir(tmp_path) == []


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (["--size", "ten"], 2, "--size: found ten, expected"),
        (["--size", "0"], 2, "--size: found 0, expected"),
        (["--size", "1,2"], 2, "--size: found 1,2, expected"),
        (["--size", "4,4,-4"], 2, "--size: found 4,4,-4, expected"),
        (["--size", "99999999999999999999"], 2, "--size"),
        (["--origin", "1,2"], 2, "--origin: found 1,2, expected"),
        (["--origin", "1,2,3x"], 2, "--origin: found 1,2,3x, expected"),
        (["--seed", "-1"], 2, "--seed"),
        (["--precision", "half"], 2, "--precision"),
        (["--block", "0"], 2, "--block"),
        (["--threads", "0"], 2, "--threads"),
        (["--slices", "gif"], 2, "--slices"),
        (["--slices", "png"], 1, "--slices write a folder"),
        (
            ["--origin", "9000000000,0,0", "--size", "4"],
            1,
            "found 9000000000 along x with --size 4",
        ),
        (["--periodic", "--size", "99"], 1, '--periodic with --size 99: parameter "period" is 99,'),
        (["--size", "1000000"], 1, "needs 10.4 EiB on the disk, "),
    ],
)
def test_refusals_name_the_option(
    tmp_path: Path, arguments: list[str], code: int, message: str
) -> None:
    result = bake("-o", tmp_path / "a.npy", *arguments)
    assert result.returncode == code
    assert message in result.stderr
    assert os.listdir(tmp_path) == []


def test_refusals_of_outputs(tmp_path: Path) -> None:
    assert "nothing to write" in bake().stderr
    assert "ends in .npy, .vdb, " in bake("-o", tmp_path / "a.gif").stderr
    assert "there is no folder" in bake("-o", tmp_path / "no" / "a.npy").stderr
    assert "ends in .png" in bake("--preview", tmp_path / "a.jpg").stderr
    unknown = bake("-o", tmp_path / "a.npy", model="marzipan")
    assert unknown.returncode == 1 and MODEL in unknown.stderr
    assert os.listdir(tmp_path) == []


def test_help_and_version() -> None:
    assert "Examples:" in bake("--help").stdout
    assert bake("--version").stdout.startswith("solidtex-bake ")


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_completion_scripts_name_the_options(shell: str) -> None:
    command = [str(BAKE), "--completion", shell]
    result = subprocess.run(command, capture_output=True, text=True, check=True)
    assert "texels-per-unit" in result.stdout
    assert shell == "bash" or "vertex-color uv" in result.stdout
    if shutil.which(shell):
        subprocess.run([shell, "-n"], input=result.stdout, text=True, check=True)


def test_results_go_to_standard_output_and_remarks_to_standard_error(tmp_path: Path) -> None:
    out = tmp_path / "a.npy"
    plain = bake("--size", 5, "-o", out)
    assert plain.stdout == f"{out}\n" and "done in" in plain.stderr
    quiet = bake("--size", 5, "-o", out, "--force", "--quiet")
    assert quiet.stdout == f"{out}\n" and quiet.stderr == ""
    verbose = bake("--size", 5, "-o", out, "--force", "--verbose")
    assert verbose.stdout == f"{out}\n"
    assert f"solidtex-bake {solidtex.__version__}, {solidtex.target()}" in verbose.stderr
    preview = tmp_path / "a.png"
    result = bake("--size", 5, "-o", out, "--preview", preview, "--force", "--json")
    assert json.loads(result.stdout) == {
        "program": "solidtex-bake",
        "version": solidtex.__version__,
        "files": [str(out), str(preview)],
    }


def test_options_come_from_a_file(tmp_path: Path) -> None:
    (tmp_path / "bake.toml").write_text('size = "5,6,7"\nseed = "3"\nquiet = true\n')
    first, second = tmp_path / "a.npy", tmp_path / "b.npy"
    assert bake("--config", tmp_path / "bake.toml", "-o", first).stderr == ""
    bake("--config", tmp_path / "bake.toml", "--size", "2,2,2", "-o", second)
    assert np.load(first).shape[:3] == (5, 6, 7) and np.load(second).shape[:3] == (2, 2, 2)
    expected = solidtex.Texture(MODEL, seed=3).eval_box((0, 0, 0), (5, 6, 7))
    assert (np.load(first) == expected).all()
    (tmp_path / "bake.toml").write_text("sise = 5\n")
    refused = bake("--config", tmp_path / "bake.toml", "-o", tmp_path / "c.npy")
    assert refused.returncode == 2 and "bake.toml: found an unknown option sise" in refused.stderr
    assert bake("--config", tmp_path / "none.toml", "-o", tmp_path / "c.npy").returncode == 2
