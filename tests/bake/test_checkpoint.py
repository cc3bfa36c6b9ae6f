"""solidtex-bake --checkpoint: a bake of a mesh that is interrupted goes on with the same bits."""

import os
import signal
import struct
import subprocess
import time
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest
from meshes import cube_obj

REPOSITORY = Path(__file__).resolve().parents[2]
BAKE = Path(os.environ["SOLIDTEX_BUILD"]) / "bin" / "solidtex-bake"
VASE = REPOSITORY / "scenes" / "meshes" / "vase.ply"
SIZE, ROWS = 512, 128
"""Of an atlas, and how many it is baked in at a time."""
ATLAS = ["granite-speckled", "--mesh", "cube.obj", "--to", "uv", "--size", SIZE, "-o", "a.exr"]
VERTICES = ["granite-grey", "--mesh", VASE, "--to", "vertex-color", "--texels-per-unit", 60]
VERTICES += ["-o", "a.ply"]


def command(*arguments: object) -> list[str]:
    return [str(BAKE), *map(str, arguments), "--threads", "1"]


def bake(folder: Path, *arguments: object) -> subprocess.CompletedProcess[str]:
    cube_obj(folder / "cube.obj")
    options = {"capture_output": True, "text": True, "check": False, "cwd": folder}
    return subprocess.run(command(*arguments), **options)


def baked(folder: Path, *arguments: object) -> bytes:
    result = bake(folder, *arguments)
    assert result.returncode == 0, result.stderr
    return Path(folder, result.stdout.strip()).read_bytes()


def interrupted(folder: Path, number: signal.Signals, more: int, *arguments: object) -> str:
    """Ends a bake with a signal when its checkpoint has grown by more bytes."""
    state = folder / "state"
    enough = (state.stat().st_size if state.exists() else 0) + more
    process = subprocess.Popen(command(*arguments), cwd=folder, stderr=subprocess.PIPE, text=True)
    with process:
        while not state.exists() or state.stat().st_size < enough:
            assert process.poll() is None
            time.sleep(0.01)
        process.send_signal(number)
        assert process.wait(10) == (130 if number == signal.SIGINT else -number)
        assert process.stderr
        return process.stderr.read()


@pytest.mark.parametrize("job", [ATLAS, VERTICES], ids=["atlas", "vertices"])
def test_a_resumed_bake_has_the_same_bits(tmp_path: Path, job: list) -> None:
    whole = baked(tmp_path, *job)
    output = tmp_path / job[-1]
    output.unlink()
    job = [*job, "--checkpoint", "state"]
    said = interrupted(tmp_path, signal.SIGINT, 10_000, *job)
    assert "interrupted, state keeps what is done" in said and not output.exists()
    said = interrupted(tmp_path, signal.SIGKILL, 10_000, *job)
    assert "state: goes on from there" in said and not output.exists()
    assert baked(tmp_path, *job) == whole
    assert not (tmp_path / "state").exists()


def mixed(word: int) -> int:
    """The output function of SplitMix64."""
    mask = 2**64 - 1
    word = (word + 0x9E3779B97F4A7C15) & mask
    word = (word ^ (word >> 30)) * 0xBF58476D1CE4E5B9 & mask
    word = (word ^ (word >> 27)) * 0x94D049BB133111EB & mask
    return word ^ (word >> 31)


def fingerprint(data: bytes) -> bytes:
    """Of a part whose length is a multiple of eight bytes."""
    value = mixed(len(data))
    for (word,) in struct.iter_unpack("<Q", data):
        value = mixed(value ^ word)
    return struct.pack("<Q", mixed(value))


def picture(path: Path) -> np.ndarray:
    return oiio.ImageBuf(str(path)).get_pixels(oiio.FLOAT)


def test_complete_parts_are_not_baked_again(tmp_path: Path) -> None:
    job = [*ATLAS, "--checkpoint", "state"]
    cube_obj(tmp_path / "cube.obj")
    interrupted(tmp_path, signal.SIGINT, 2 * ROWS * SIZE * 12, *job)
    state = (tmp_path / "state").read_bytes()
    header = len(b"".join(state.splitlines(keepends=True)[:2]))
    part = np.full(ROWS * SIZE * 3, 0.25, np.float32).tobytes()
    whole_part = part + fingerprint(part)
    second = header + len(whole_part)
    damaged = bytes([state[second] ^ 1])
    (tmp_path / "state").write_bytes(state[:header] + whole_part + damaged + state[second + 1 :])
    baked(tmp_path, *job)
    found = picture(tmp_path / "a.exr")
    assert np.ptp(found[:ROWS]) == 0 < found[0, 0, 0]
    (tmp_path / "a.exr").unlink()
    baked(tmp_path, *ATLAS)
    assert (found[ROWS:] == picture(tmp_path / "a.exr")[ROWS:]).all()


@pytest.fixture(scope="module")
def state(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("state")
    cube_obj(folder / "cube.obj")
    interrupted(folder, signal.SIGINT, 10_000, *ATLAS, "--checkpoint", "state")
    return folder / "state"


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (["--seed", 3], "state: found a checkpoint with the seed 0, expected 3"),
        (["--margin", 3], "the margin 8, expected 3"),
        (["--origin", "1,2,3"], "the origin [0,0,0], expected [1,2,3]"),
        (["--texels-per-unit", 9], "the texels-per-unit 256.0, expected 9.0"),
        (["--precision", "fast"], 'the precision "full", expected "fast"'),
        (["model"], "a checkpoint of another model, or of this one before it was changed"),
        (["mesh"], "a checkpoint of another mesh, or of this one before it was changed"),
        (["kind"], "state: found another file, expected a checkpoint of solidtex-bake"),
        (["header"], "state: found a damaged header"),
        (["place"], "a.exr: found it as --checkpoint and -o, expected two files"),
        (["folder"], "nowhere/state: cannot write: there is no folder nowhere"),
    ],
)
def test_refusals(tmp_path: Path, state: Path, change: list, message: str) -> None:
    content, job = state.read_bytes(), [*ATLAS, "--checkpoint", "state", *change]
    cube = cube_obj(tmp_path / "cube.obj").read_text()
    if change == ["model"]:
        job = ["stone-grey", *job[1:-1]]
    elif change == ["mesh"]:
        (tmp_path / "moved.obj").write_text(cube.replace("v -1.0", "v -1.1", 1))
        job = [name if name != "cube.obj" else "moved.obj" for name in job[:-1]]
    elif change == ["kind"]:
        job, content = job[:-1], b"mine"
    elif change == ["header"]:
        job, content = job[:-1], content.splitlines(keepends=True)[0] + b"{\n"
    elif change in (["place"], ["folder"]):
        job = [*ATLAS, "--checkpoint", "./a.exr" if change == ["place"] else "nowhere/state"]
    (tmp_path / "state").write_bytes(content)
    result = bake(tmp_path, *job)
    assert result.returncode == 1 and message in result.stderr
    assert (tmp_path / "state").read_bytes() == content
    assert not (tmp_path / "a.exr").exists()


def test_only_meshes_have_a_checkpoint(tmp_path: Path) -> None:
    result = bake(tmp_path, "granite-grey", "-o", "a.npy", "--checkpoint", "state")
    assert result.returncode == 2 and "requires --mesh" in result.stderr + result.stdout
