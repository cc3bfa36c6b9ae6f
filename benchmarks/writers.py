"""Every program that writes files, as small jobs for benchmarks/kills.py and failing_calls.py."""

from __future__ import annotations

import csv
import json
import os
import re
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image

REPOSITORY = Path(__file__).resolve().parents[1]
SAMPLER = [
    "generator.sizes.octaves=4",
    "generator.sizes.hidden_layers=3",
    "generator.sizes.width=8",
    "grain.short_octaves=1",
    "critic.widths=[4,6]",
    "critic.batch=2",
    "projected_critic.head_width=4",
]


@dataclass(frozen=True)
class Job:
    """A command whose files appear in an empty folder. IN is the folder of its inputs."""

    name: str
    command: str
    outputs: tuple[str, ...]
    force: str = "--force"  # replaces outputs; empty: they are never replaced
    state: tuple[str, ...] = ()  # what an interrupted job leaves, for the same command
    seconds: bool = False  # outputs hold the time that the job took

    @property
    def program(self) -> str:
        return self.command.split()[0]

    def arguments(self, inputs: Path) -> list[str]:
        return self.command.replace("IN/", f"{inputs}/").split()[1:]

    @property
    def resumes(self) -> bool:
        return bool(self.state)


def _bake(name: str, options: str, *outputs: str, **more: object) -> Job:
    return Job(name, f"solidtex-bake IN/model.solidtex {options}", outputs, **more)  # type: ignore[arg-type]


BOX, CUBE = "--size 12,8,4", "--mesh IN/cube.obj --threads 2"
TRAIN = (
    "solidtex-train IN/photo.png -o out --preset sampler --steps 6 --size 32 --device cpu \
--resolution 48 "
    + " ".join(f"--set {setting}" for setting in SAMPLER)
)
TRAINED = ("out/checkpoint.pt",)
JOBS = [
    *(
        _bake(kind, f"{BOX} -o a.{kind}", f"a.{kind}")
        for kind in ("npy", "vdb", "nvdb", "nrrd", "raw", "vti", "vol", "tif", "dds", "ktx2")
    ),
    _bake("nhdr", f"{BOX} -o a.nhdr", "a.nhdr", "a.raw"),
    _bake("flipbook", f"{BOX} --format flipbook --channels albedo -o a.png", "a.png", "a.json"),
    _bake("imagej", f"{BOX} --format imagej -o a.tif", "a.tif"),
    _bake("slices png", f"{BOX} --slices png -o slices", "slices", force=""),
    _bake("slices exr", f"{BOX} --slices exr -o slices", "slices", force=""),
    _bake(
        "zarr", "--size 40,20,8 --shard-size 16 -o a.zarr", "a.zarr", force="", state=("a.zarr",)
    ),
    _bake("mesh vertices", f"{CUBE} --to vertex-color -o a.ply", "a.ply"),
    _bake("mesh atlas", f"{CUBE} --to uv --size 32 -o a.exr", "a.exr"),
    _bake("mesh maps", f"{CUBE} --maps albedo --size 32 -o maps", "maps", force=""),
    _bake("mesh glb", f"{CUBE} --size 32 -o a.glb", "a.glb"),
    _bake("mesh volume", f"{CUBE} --to volume --texels-per-unit 6 -o a.vdb", "a.vdb"),
    _bake(
        "mesh checkpoint",
        f"{CUBE} --to uv --size 128 --checkpoint state -o a.exr",
        "a.exr",
        state=("state",),
    ),
    *(
        Job(
            f"render {kind}",
            "solidtex-render IN/cube.obj --model IN/model.solidtex --size 12,8 --spp 1 "
            f"--threads 2 -o a.{kind}",
            (f"a.{kind}",),
        )
        for kind in ("png", "exr")
    ),
    Job(
        "render checkpoint",
        "solidtex-render IN/cube.obj --model IN/model.solidtex --size 48,32 --spp 16 "
        "--threads 2 --checkpoint state --checkpoint-every 0.1 -o a.exr",
        ("a.exr",),
        state=("state",),
    ),
    Job("mix", "solidtex-mix pebbles:stone-0 pebbles:stone-1 -o a.solidtex", ("a.solidtex",)),
    Job(
        "mix walk",
        "solidtex-mix pebbles:stone-0 pebbles:stone-1 --animate 2 -o a#.solidtex",
        ("a0.solidtex", "a1.solidtex"),
    ),
    Job("encode", "solidtex-encode IN/photo.png --space pebbles -o a.solidtex", ("a.solidtex",)),
    Job("detect", "solidtex-detect pebbles IN/photo.png --patch 0,0,32,32 -o a.png", ("a.png",)),
    Job("train", TRAIN, TRAINED, "", ("out",), seconds=True),
    Job(
        "train-space",
        "solidtex-train-space IN/photos/list.csv --preset IN/space.toml --steps 4 --device cpu "
        "-o out",
        TRAINED,
        "",
        ("out",),
        seconds=True,
    ),
    Job("export", "solidtex-export IN/trained -o a.solidtex --license CC0-1.0", ("a.solidtex",)),
    Job(
        "export-space", "solidtex-export-space IN/space -o a.solidtex-space", ("a.solidtex-space",)
    ),
    Job("export-onnx", "solidtex-export-onnx IN/model.solidtex -o a.onnx", ("a.onnx",)),
    Job(
        "export-shader",
        "solidtex-export-shader IN/model.solidtex --weights texture -o a.glsl",
        ("a.glsl", "a.weights.bin", "a.weights.exr"),
    ),
    Job("view", "solidtex-view IN/model.solidtex -o a.html", ("a.html",)),
    Job("solids", "solidtex-solids marble -o . --size 16", ("marble.png",)),
    Job(
        "measure",
        "solidtex-measure IN/volume.npy --voxel-size 1um --axes x --without permeability "
        "--representative none -o a.json",
        ("a.json",),
        seconds=True,
    ),
    Job(
        "evaluate",
        "solidtex-eval IN/model.solidtex IN/photo.png --json a.json",
        ("a.json",),
    ),
]


def find(names: list[str]) -> list[Job]:
    """Return the jobs of these names, or all."""
    known = {job.name: job for job in JOBS}
    for name in names:
        if name not in known:
            raise SystemExit(f"found no job {name}, expected one of {', '.join(known)}")
    return [known[name] for name in names] or JOBS


def make_inputs(folder: Path) -> Path:
    """Write what the jobs read, except results of trainings."""
    from solidtex_export.export import random_models
    from solidtex_export.export.file_format import model_file
    from solidtex_export.spaces.random_space import Sizes, random_space

    random = np.random.default_rng(1)
    (folder / "photos").mkdir(parents=True)
    pixels = random.integers(60, 160, (136, 144, 3), np.uint8)
    rows = [["split", "file", "licence", "source"]]
    for i, step in enumerate((2, 5, 9)):
        pixels[::step] = (200, 120, 60)
        Image.fromarray(pixels).save(folder / "photos" / f"p{i}.png")
        rows.append(["train", f"p{i}.png", "CC0-1.0", "drawn"])
    with (folder / "photos/list.csv").open("w", newline="") as file:
        csv.writer(file).writerows(rows)
    Image.fromarray(pixels[:96, :96]).save(folder / "photo.png")
    (folder / "space.toml").write_text(_small_space())
    model_file.write(folder / "model.solidtex", random_models.sampler_model(4, 3, 7))
    space = random_space(Sizes(family="sampler", name="pebbles"), seed=3)
    (folder / "pebbles.solidtex-space").write_bytes(space.encode())
    np.save(folder / "volume.npy", np.indices((12,) * 3).sum(0) % 3 > 0)
    (folder / "cube.obj").write_text(_cube())
    return folder


def _small_space() -> str:
    from solidtex_export.settings import read_toml
    from solidtex_export.spaces import settings

    presets = Path(settings.__file__).parents[1] / "presets" / "spaces"
    tables = read_toml(presets / "sampler.toml")
    tables["sampler"] = tables["sampler"] | {"octaves": 4, "hidden_layers": 3, "width": 8}
    tables["slicing"] = tables["slicing"] | {"size": 40, "batch": 2}
    tables |= {"code": 4, "style_width": 8}
    plain = [f"{k} = {_toml(v)}" for k, v in tables.items() if not isinstance(v, dict)]
    for name, table in tables.items():
        if isinstance(table, dict):
            plain += [f"[{name}]", *(f"{k} = {_toml(v)}" for k, v in table.items())]
    return "\n".join(plain)


def _toml(value: object) -> str:
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{k} = {_toml(v)}" for k, v in value.items()) + " }"
    return json.dumps(value)


def _cube() -> str:
    """A closed cube whose faces have an atlas of their own."""
    corners = [(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
    faces = ["0132", "4675", "0451", "2376", "0264", "1573"]
    text = "".join("v {} {} {}\n".format(*corner) for corner in corners)
    for i, face in enumerate(faces):
        left, low = i % 3 / 3 + 0.02, i // 3 / 2 + 0.02
        for u, v in ((0, 0), (0.28, 0), (0.28, 0.4), (0, 0.4)):
            text += f"vt {left + u} {low + v}\n"
        text += "f " + " ".join(f"{int(c) + 1}/{4 * i + k + 1}" for k, c in enumerate(face)) + "\n"
    return text


@dataclass
class Result:
    code: int  # negative: the signal that ended the program
    messages: str


class Running:
    """A program that has been started."""

    def __init__(self, process: subprocess.Popen[bytes], pid: int, messages: Path) -> None:
        self.process, self.pid, self.messages = process, pid, messages

    def wait(self) -> Result:
        if self.process.pid == self.pid:
            code = self.process.wait()
        else:
            assert self.process.stdout
            code = int(self.process.stdout.readline())
        return Result(code, self.messages.read_text(errors="replace"))


class Programs:
    """Starts the programs of a build, and Python's from one process that has loaded torch."""

    def __init__(self, build: Path, inputs: Path, preload: Path | None = None) -> None:
        self.build, self.inputs = build, inputs
        models = f"{inputs}:{REPOSITORY / 'models'}"
        self.environment = dict(os.environ, SOLIDTEX_MODEL_PATH=models, OMP_NUM_THREADS="1")
        if preload:
            self.environment["LD_PRELOAD"] = str(preload)
        self.server: subprocess.Popen[bytes] | None = None

    def start(self, job: Job, folder: Path, *more: str, **variables: str) -> Running:
        """Start the job in a folder; messages go to a file beside it."""
        messages = folder.with_suffix(".messages")
        arguments = [*job.arguments(self.inputs), *more]
        program = self.build / "bin" / job.program
        if program.exists():
            with messages.open("wb") as file:
                process = subprocess.Popen(
                    [program, *arguments], cwd=folder, env=self.environment | variables,
                    stdout=subprocess.DEVNULL, stderr=file,
                )  # fmt: skip
            return Running(process, process.pid, messages)
        return self._fork(job, arguments, folder, messages, variables)

    def _fork(
        self, job: Job, arguments: list[str], folder: Path, messages: Path, variables: dict
    ) -> Running:
        if self.server is None:
            command = [sys.executable, "-B", str(Path(__file__).with_name("fork_server.py"))]
            pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
            self.server = subprocess.Popen(command, env=self.environment, **pipes)  # type: ignore[call-overload]
        request = [job.program, arguments, str(folder), str(messages), variables]
        assert self.server.stdin and self.server.stdout
        self.server.stdin.write(json.dumps(request).encode() + b"\n")
        self.server.stdin.flush()
        return Running(self.server, int(self.server.stdout.readline()), messages)

    def run(self, job: Job, folder: Path, *more: str, **variables: str) -> Result:
        folder.mkdir(exist_ok=True)
        return self.start(job, folder, *more, **variables).wait()

    def close(self) -> None:
        if self.server and self.server.stdin:
            self.server.stdin.close()
            self.server.wait()

    def prepare(self, jobs: list[Job]) -> None:
        """Make the inputs of these jobs that are results of trainings, once."""
        for name, result in (("train", "trained"), ("train-space", "space")):
            needed = any(f"IN/{result}" in job.command.split() for job in jobs)
            if not needed or (self.inputs / result).exists():
                continue
            folder = self.inputs / f"{result}.folder"
            done = self.run(find([name])[0], folder)
            if done.code:
                raise SystemExit(f"{name}: exit code {done.code}: {done.messages}")
            (folder / "out").rename(self.inputs / result)


def contents(job: Job, folder: Path) -> dict[str, bytes]:
    """Return the bytes of the job's outputs. Of a checkpoint, the weights alone."""
    found = {}
    for output in job.outputs:
        path = folder / output
        files = [path] if path.is_file() else sorted(path.rglob("*"))
        for file in files:
            if file.is_file():
                found[str(file.relative_to(folder))] = _comparable(file, job.seconds)
    return found


def _comparable(file: Path, seconds: bool) -> bytes:
    data = file.read_bytes()
    if file.suffix == ".vdb":  # the file format has a random number
        return re.sub(rb"[0-9a-f]{8}(-[0-9a-f]{4}){3}-[0-9a-f]{12}", b"", data)
    if not seconds:
        return data
    if file.suffix == ".json":
        document = json.loads(data)
        return json.dumps({k: v for k, v in document.items() if "second" not in k}).encode()
    import torch

    tensors = _tensors(torch.load(file, weights_only=True))
    return b"".join(key.encode() + tensors[key].numpy().tobytes() for key in sorted(tensors))


def _tensors(state: object, at: str = "") -> dict:
    """Return all tensors of a checkpoint by their places."""
    import torch

    if isinstance(state, torch.Tensor):
        return {at: state}
    if not isinstance(state, dict | list | tuple):
        return {}
    pairs = state.items() if isinstance(state, dict) else enumerate(state)
    return {k: v for key, value in pairs for k, v in _tensors(value, f"{at}.{key}").items()}


def leftovers(job: Job, folder: Path) -> list[str]:
    """Return the files that the job should not have left: neither output nor state."""
    allowed = {*job.outputs, *job.state}
    return [
        name
        for path in folder.rglob("*")
        if path.is_file()
        for name in [str(path.relative_to(folder))]
        if path.name.startswith(".")
        or not any(name == a or name.startswith(f"{a}/") for a in allowed)
    ]
