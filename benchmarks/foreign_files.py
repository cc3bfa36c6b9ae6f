"""Gives files that other people made, whole and damaged ones, to the programs that read such files.

Every mesh below the folders is rendered, and every image is encoded, shown as the environment of a
scene, and read as solidtex-train reads it. For example, test files of other libraries in Debian:

    apt-get download assimp-testmodels && dpkg-deb -x assimp-testmodels_*.deb foreign/assimp
    apt-get source pillow tiff libpng1.6 openexr libwebp

What must be true: a program reads the file, or refuses it with exit code 1 and one line that names
it, within seconds and gigabytes.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import signal
import subprocess
import sys
import tempfile
import time
import traceback
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

from writers import REPOSITORY

from solidtex_export.images.exemplar import load_exemplar
from solidtex_export.images.file_kinds import ExemplarError

MESHES = {".ply", ".obj", ".gltf", ".glb", ".stl", ".off"}
IMAGES = {
    *(".png", ".jpg", ".jpeg", ".exr", ".tif", ".tiff", ".bmp", ".tga", ".webp", ".ppm", ".pgm"),
    *(".pbm", ".pnm", ".hdr", ".gif", ".psd", ".dds", ".ico", ".jp2", ".j2k", ".sgi", ".rgb"),
    *(".pcx", ".fli", ".flc", ".eps", ".msp", ".xbm", ".icns", ".mpo", ".fits", ".heic", ".avif"),
}
SCENE = {
    "version": 1,
    "camera": {"position": [0, 0, 5], "look_at": [0, 0, 0], "fov": 40},
    "materials": {"gray": {"type": "diffuse", "color": [0.5, 0.5, 0.5]}},
    "objects": [{"mesh": str(REPOSITORY / "scenes/meshes/ball-cut.ply"), "material": "gray"}],
}
TIMED_OUT = -signal.SIGALRM


@dataclass(frozen=True)
class Limits:
    seconds: int
    bytes: int

    def apply(self) -> None:
        """Limit this process, and what it becomes."""
        resource.setrlimit(resource.RLIMIT_AS, (self.bytes, self.bytes))
        signal.alarm(self.seconds)


@dataclass(frozen=True)
class Reader:
    """`read` gets a file, a folder for output, and where messages go. It returns an exit code."""

    name: str
    endings: set[str]
    read: Callable[[Path, Path, BinaryIO], int]


def readers(build: Path, limits: Limits) -> list[Reader]:
    programs = build / "bin"

    def run(messages: BinaryIO, program: str, *arguments: object) -> int:
        command = [str(programs / program), *map(str, arguments), "-q"]
        return subprocess.run(
            command,
            stdout=subprocess.DEVNULL,
            stderr=messages,
            check=False,
            preexec_fn=limits.apply,
        ).returncode

    def render(messages: BinaryIO, folder: Path, *scene: object) -> int:
        small = ["--size", "16,16", "--spp", 1, "--threads", 1, "-o", folder / "image.png"]
        return run(messages, "solidtex-render", *scene, *small)

    def mesh(file: Path, folder: Path, messages: BinaryIO) -> int:
        return render(messages, folder, file, "--model", "wood-oak")

    def environment(file: Path, folder: Path, messages: BinaryIO) -> int:
        scene = {**SCENE, "environment": {"file": str(file)}}
        (folder / "scene.json").write_text(json.dumps(scene))
        return render(messages, folder, folder / "scene.json")

    def encode(file: Path, folder: Path, messages: BinaryIO) -> int:
        output = folder / "model.solidtex"
        return run(messages, "solidtex-encode", file, "--space", "stones", "-o", output)

    def train(file: Path, folder: Path, messages: BinaryIO) -> int:
        return in_child(lambda: load_exemplar(file, 64, 16), messages, limits)

    return [
        Reader("mesh", MESHES, mesh),
        Reader("encode", IMAGES, encode),
        Reader("environment", IMAGES, environment),
        Reader("train", IMAGES, train),
    ]


def in_child(read: Callable[[], object], messages: BinaryIO, limits: Limits) -> int:
    """Call a Python reader in a process of its own; 1 for its own error, 3 for any other."""
    child = os.fork()
    if child == 0:
        os.dup2(messages.fileno(), 2)
        code = 0
        try:
            limits.apply()
            read()
        except ExemplarError as error:
            print(error, file=sys.stderr)
            code = 1
        except BaseException:
            traceback.print_exc()
            code = 3
        os._exit(code)
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])


@dataclass(frozen=True)
class Outcome:
    file: Path
    what: str
    message: str
    seconds: float


def try_one(reader: Reader, file: Path) -> Outcome:
    with tempfile.TemporaryDirectory() as folder, tempfile.TemporaryFile() as messages:
        begin = time.monotonic()
        code = reader.read(file, Path(folder), messages)
        seconds = time.monotonic() - begin
        messages.seek(0)
        message = messages.read().decode(errors="replace").strip()
        return Outcome(file, judge(code, message, file), message, seconds)


def judge(code: int, message: str, file: Path) -> str:
    """What a run shows: read, refused, or what is wrong."""
    if code == TIMED_OUT:
        return "no answer in time"
    if code < 0:
        return f"signal {-code}"
    if code > 1:
        return f"exit code {code}"
    last = message.splitlines()[-1] if message else ""
    if code == 1 and file.name not in last and "scene.json" not in last:
        return "message without the file's name"
    return "refused" if code else "read"


def files_below(folders: list[Path], endings: set[str]) -> Iterator[Path]:
    for folder in folders:
        for file in sorted(folder.rglob("*")):
            if file.suffix.lower() in endings and file.is_file():
                yield file


def main() -> int:
    p = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    p.add_argument("folders", nargs="+", type=Path, metavar="FOLDER")
    p.add_argument("--only", metavar="READER", action="append", help="mesh, encode, ...")
    p.add_argument("--seconds", type=int, default=60, help="for one file (default 60)")
    p.add_argument("--gigabytes", type=int, default=8, help="of addresses (default 8)")
    p.add_argument("--messages", action="store_true", help="print why files are refused")
    p.add_argument("--build", type=Path, default=REPOSITORY / "build")
    args = p.parse_args()
    os.environ["OMP_NUM_THREADS"] = "1"
    findings = 0
    print("reader       files   read  refused  findings  slowest")
    for reader in readers(args.build, Limits(args.seconds, args.gigabytes << 30)):
        if args.only and reader.name not in args.only:
            continue
        outcomes = [try_one(reader, file) for file in files_below(args.folders, reader.endings)]
        counts = Counter(outcome.what for outcome in outcomes)
        found = len(outcomes) - counts["read"] - counts["refused"]
        slowest = max((outcome.seconds for outcome in outcomes), default=0)
        print(
            f"{reader.name:12} {len(outcomes):5} {counts['read']:6} {counts['refused']:8}"
            f" {found:9} {slowest:6.1f} s"
        )
        for outcome in outcomes:
            if outcome.what not in ("read", "refused"):
                print(f"  {outcome.what}: {outcome.file}\n    {outcome.message[-600:]}")
            elif args.messages and outcome.what == "refused":
                print(f"    {outcome.message}")
        findings += found
    print(f"findings: {findings}")
    return 1 if findings else 0


if __name__ == "__main__":
    sys.exit(main())
