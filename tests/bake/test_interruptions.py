"""Bakes of a Zarr store that are killed, lose power or find no room: the same command goes on."""

import errno
import os
import resource
import shutil
import signal
import subprocess
import time
from collections.abc import Callable
from pathlib import Path

import pytest

BUILD = Path(os.environ["SOLIDTEX_BUILD"])
BAKE = BUILD / "bin" / "solidtex-bake"
FAULTS = next((BUILD / "tests" / "faults").glob("libsolidtex_faults.*"), None)
ARGUMENTS = [BAKE, "granite-grey", "--size", "96,32,20", "--shard-size", "32", "-o", "a.zarr"]
STEP = 5
"""Every fifth call is tried; which ones differs between the kinds of faults."""

needs_faults = pytest.mark.skipif(FAULTS is None, reason="solidtex_faults is not built")


def bake(folder: Path, call: int | None = None, action: str | int = "", **more: object):
    environment = dict(os.environ, SOLIDTEX_FAULT_COUNT=str(folder / "count"))
    if call is not None:
        environment |= {"SOLIDTEX_FAULT_CALL": str(call), "SOLIDTEX_FAULT_ACTION": str(action)}
    if FAULTS:
        environment["LD_PRELOAD"] = str(FAULTS)
    return subprocess.run(
        ARGUMENTS, cwd=folder, env=environment, capture_output=True, text=True, **more
    )


def content(store: Path) -> dict[str, bytes]:
    return {str(p.relative_to(store)): p.read_bytes() for p in store.rglob("*") if p.is_file()}


def temporaries(folder: Path) -> list[Path]:
    return list(folder.rglob(".*"))


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> tuple[dict[str, bytes], int]:
    """An uninterrupted bake, and how many calls it makes."""
    folder = tmp_path_factory.mktemp("whole")
    result = bake(folder)
    assert result.returncode == 0, result.stderr
    count = int((folder / "count").read_text()) if FAULTS else 0
    return content(folder / "a.zarr"), count


def goes_on(folder: Path, expected: dict[str, bytes]) -> str:
    result = bake(folder)
    assert result.returncode == 0, result.stderr
    assert content(folder / "a.zarr") == expected
    assert not temporaries(folder)
    return result.stderr


@needs_faults
@pytest.mark.parametrize("action", ["kill", "power"])
def test_it_goes_on_after_any_last_call(tmp_path: Path, whole: tuple, action: str) -> None:
    expected, count = whole
    assert count > 50
    for call in range(1 if action == "kill" else 3, count + 1, STEP):
        folder = tmp_path / str(call)
        folder.mkdir()
        assert bake(folder, call, action).returncode == -signal.SIGKILL
        messages = goes_on(folder, expected)
        assert "made again" not in messages, call  # what has its name is complete
        shutil.rmtree(folder)


@needs_faults
@pytest.mark.parametrize("error", [errno.ENOSPC, errno.EACCES, errno.EROFS, errno.EIO])
def test_a_call_that_fails_ends_with_a_sentence(tmp_path: Path, whole: tuple, error: int) -> None:
    expected, count = whole
    for call in range(1 + error % STEP, count + 1, 3 * STEP):
        folder = tmp_path / str(call)
        folder.mkdir()
        result = bake(folder, call, error)
        assert result.returncode == 1, (call, result.stderr)
        *_, message = result.stderr.splitlines()
        assert message.startswith("solidtex-bake: a.zarr"), (call, message)
        assert os.strerror(error) in message and ".tmp" not in message, (call, message)
        assert not temporaries(folder), call
        goes_on(folder, expected)
        shutil.rmtree(folder)


@needs_faults
def test_a_bake_that_failed_at_once_leaves_no_folder(tmp_path: Path) -> None:
    for call in (1, 2, 3):
        assert bake(tmp_path, call, errno.ENOSPC).returncode == 1
        assert os.listdir(tmp_path) == ["count"]


def spoil_byte(path: Path) -> None:
    data = bytearray(path.read_bytes())
    data[100] ^= 1
    path.write_bytes(data)


def spoil_index(path: Path) -> None:
    data = bytearray(path.read_bytes())
    data[-10] ^= 1
    path.write_bytes(data)


def cut_short(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-1])


def lengthen(path: Path) -> None:
    path.write_bytes(b"x" + path.read_bytes())


@pytest.mark.parametrize("spoil", [spoil_byte, spoil_index, cut_short, lengthen, Path.unlink])
@pytest.mark.parametrize("level", [0, 1])
def test_a_damaged_shard_is_made_again(
    tmp_path: Path, whole: tuple, level: int, spoil: Callable[[Path], object]
) -> None:
    expected, _ = whole
    assert bake(tmp_path).returncode == 0
    others = [tmp_path / "a.zarr" / str(level) / "c/0/0/0" / str(x) for x in (0, 2)]
    times = [path.stat().st_mtime_ns for path in others]
    spoil(tmp_path / "a.zarr" / str(level) / "c/0/0/0/1")
    messages = goes_on(tmp_path, expected)
    assert "2 of 3 shards are there and intact" in messages
    assert ("it is made again" in messages) == (spoil is not Path.unlink)
    assert [path.stat().st_mtime_ns for path in others] == times


def test_a_complete_store_is_left_alone(tmp_path: Path, whole: tuple) -> None:
    assert bake(tmp_path).returncode == 0
    times = {path: path.stat().st_mtime_ns for path in (tmp_path / "a.zarr").rglob("*")}
    assert "3 of 3 shards are there and intact" in goes_on(tmp_path, whole[0])
    assert {path: path.stat().st_mtime_ns for path in (tmp_path / "a.zarr").rglob("*")} == times


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_signals_leave_what_is_done(tmp_path: Path, number: signal.Signals) -> None:
    command = [BAKE, "granite-grey", "--size", "1024", "--shard-size", "32", "-o", "a.zarr"]
    command += ["--depth", "8"]  # has room on the disk
    with subprocess.Popen(command, cwd=tmp_path, stderr=subprocess.PIPE, text=True) as running:
        while not list(tmp_path.glob("a.zarr/0/c/0/*/*/0")):
            assert running.poll() is None
            time.sleep(0.01)
        running.send_signal(number)
        _, messages = running.communicate()
    assert running.returncode == 130
    assert messages == (
        "solidtex-bake: interrupted, a.zarr keeps what is done: the same command goes on from "
        "there\n"
    )
    assert not temporaries(tmp_path)


def test_a_limit_on_files_is_a_sentence(tmp_path: Path, whole: tuple) -> None:
    def limit() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (150_000, 150_000))

    largest = max(len(data) for name, data in whole[0].items() if "/c/" in name)
    assert largest > 150_000
    result = bake(tmp_path, preexec_fn=limit)
    assert result.returncode == 1
    assert result.stderr.splitlines()[-1].startswith("solidtex-bake: a.zarr/0/c/0/0/0/")
    assert "File too large" in result.stderr
    assert not temporaries(tmp_path)
    goes_on(tmp_path, whole[0])


def test_two_bakes_of_one_shard_are_refused(tmp_path: Path) -> None:
    command = [BAKE, "granite-grey", "--size", "512", "--shard-size", "512", "-o", "a.zarr"]
    with subprocess.Popen(command, cwd=tmp_path, stderr=subprocess.DEVNULL) as running:
        while not list(tmp_path.glob("a.zarr/0/c/0/0/0/.0.*")):
            assert running.poll() is None
            time.sleep(0.01)
        second = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
        running.terminate()
    assert second.returncode == 1
    assert "a.zarr/0/c/0/0/0/0: another process is writing it" in second.stderr
    assert running.returncode == 130
