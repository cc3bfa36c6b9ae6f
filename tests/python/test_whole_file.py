"""Files are replaced as a whole, whatever a killed process has left beside them."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from solidtex_export.whole_file import replacing, write_whole

HALF = """
import os, sys
from pathlib import Path
from solidtex_export.whole_file import replacing
with replacing(Path(sys.argv[1])) as temporary:
    temporary.write_bytes(b"half")
    os.kill(os.getpid(), 9)
"""


def hidden(folder: Path) -> list[str]:
    return [path.name for path in folder.iterdir() if path.name.startswith(".")]


def test_what_a_killed_process_left_is_removed(tmp_path: Path) -> None:
    target = tmp_path / "a.bin"
    subprocess.run([sys.executable, "-c", HALF, target], check=False)
    assert len(hidden(tmp_path)) == 1
    write_whole(target, b"whole")
    assert target.read_bytes() == b"whole" and not hidden(tmp_path)


def test_a_reused_process_number_is_not_taken_for_its_owner(tmp_path: Path) -> None:
    target = tmp_path / "a.bin"
    with pytest.raises(RuntimeError), replacing(target) as temporary:
        name = temporary.name
        raise RuntimeError
    start = name.removesuffix(".tmp.bin").rpartition("-")[2]
    assert str(os.getpid()) in name and int(start) > 1
    (tmp_path / name.replace(f"-{start}.", "-1.")).write_bytes(b"half")
    with replacing(target) as temporary:
        assert hidden(tmp_path) == [temporary.name]
        temporary.write_bytes(b"whole")
    assert not hidden(tmp_path)


def test_a_file_that_another_process_writes_is_left_to_it(tmp_path: Path) -> None:
    target = tmp_path / "a.bin"
    with replacing(target) as temporary:
        write_whole(tmp_path / "b.bin", b"other")
        code = "import sys, pathlib; from solidtex_export.whole_file import write_whole as w;"
        code += " w(pathlib.Path(sys.argv[1]), b'theirs')"
        subprocess.run([sys.executable, "-c", code, target], check=True)
        assert hidden(tmp_path) == [temporary.name]
        temporary.write_bytes(b"mine")
    assert target.read_bytes() == b"mine"
