"""Rates of both families on a GPU, in one command under ten minutes.

    python benchmarks/gpu.py --json gpu.json

Measures the exported shaders through wgpu, and the ONNX graphs through ONNX Runtime's providers and
through PyTorch. What is not installed is skipped with a sentence. On a software adapter sizes are
small. Prints a table: milliseconds for all of a row's voxels or points, their rate, milliseconds
for 256^3 voxels at that rate, and the largest difference of a channel from the engine (without the
Python module solidtex: from the float64 reference).

Noise is computed by the shaders; the ONNX graphs receive it, from the device's memory, and the
time of computing it is not in theirs.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from itertools import product
from pathlib import Path

import numpy as np
from timing import seconds_of_calls

from solidtex_export.export.file_format import model_file
from solidtex_export.export.file_format.checks import ModelFileError
from solidtex_export.export.file_format.model_file import ModelFile
from solidtex_export.export.verification import engine, reference
from solidtex_export.generators.regions import Box

MODELS = Path(__file__).resolve().parents[1] / "models"
CHECKED_POINTS = 256
CHECKED_EDGE = 8
RANGE = 300.0
"""Texels from the origin, of points."""
WHOLE = 256**3


@dataclass(frozen=True)
class Sizes:
    edge: int
    """Voxels along each side of the measured cube."""
    brick: int
    """Along each side of what is computed at once."""
    points: int


GPU, SOFTWARE = Sizes(256, 128, 2**21), Sizes(16, 16, 1024)


@dataclass(frozen=True)
class Row:
    model: str
    family: str
    runtime: str
    precision: str
    count: int
    """Voxels or points."""
    milliseconds: float
    difference: float

    @property
    def rate(self) -> float:
        return self.count / self.milliseconds * 1e3


@dataclass(frozen=True)
class Measured:
    """What a runtime prepared: a call computes `count` voxels or points and waits for them."""

    runtime: str
    precision: str
    call: Callable[[], object]
    count: int
    checked: Callable[[], np.ndarray]
    """Values of the first CHECKED_EDGE^3 voxels of the cube, or CHECKED_POINTS points."""


Found = Iterator[Measured | str]
"""What runtimes prepared, and sentences about what is skipped."""


def main() -> None:
    args = parse()
    rows: list[Row] = []
    for path in args.models:
        # The engine checks files; without it these are trusted.
        try:
            model = model_file.read(path) if has_engine() else model_file.loaded(path.read_bytes())
        except (OSError, ModelFileError) as error:
            raise SystemExit(f"gpu.py: {error}") from error
        expected = expected_values(model)
        for runtime in (shaders, onnx_runtime, pytorch):
            for found in runtime(model, args):
                if isinstance(found, str):
                    print(f"{model.document['name']}: {found}")
                    continue
                try:
                    rows.append(row(model, found, expected, args.seconds))
                    print_row(rows[-1], is_first=len(rows) == 1)
                except Exception as error:  # of a driver: the others are still measured
                    print(f"{model.document['name']}: {found.runtime} fails: {error}")
    if args.json:
        machine = {"processor": platform.processor() or platform.machine(), "values": source()}
        document = machine | {"rows": [asdict(r) | {"rate": r.rate} for r in rows]}
        args.json.write_text(json.dumps(document, indent=1) + "\n")


def parse() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    shipped = [MODELS / f"{name}.solidtex" for name in ("granite-grey", "stone-grey")]
    parser.add_argument("--models", type=Path, nargs="+", default=shipped)
    parser.add_argument("--json", type=Path, help="file to write the rows to")
    parser.add_argument("--seconds", type=float, default=5, help="for each row (default 5)")
    parser.add_argument("--edge", type=int, help="voxels along the cube")
    parser.add_argument("--brick", type=int, help="voxels computed at once, along each axis")
    parser.add_argument("--points", type=int, help="points computed at once")
    return parser.parse_args()


def sizes(args: argparse.Namespace, is_gpu: bool) -> Sizes:
    base = GPU if is_gpu else SOFTWARE
    edge = base.edge if args.edge is None else args.edge
    brick = min(base.brick, edge) if args.brick is None else args.brick
    points = base.points if args.points is None else args.points
    found = Sizes(edge, brick, points)
    is_small = found.brick < CHECKED_EDGE or found.points < CHECKED_POINTS
    if is_small or found.edge < found.brick or found.edge % found.brick:
        raise SystemExit(
            f"gpu.py: found --edge {found.edge}, --brick {found.brick}, --points {found.points};"
            f" expected an edge of whole bricks of at least {CHECKED_EDGE} and at least"
            f" {CHECKED_POINTS} points"
        )
    return found


def row(model: ModelFile, measured: Measured, expected: np.ndarray, seconds: float) -> Row:
    measured.call()  # compiles, allocates
    times = seconds_of_calls(measured.call, seconds, "wall", 1)
    difference = float(np.abs(measured.checked() - expected).max())
    family = "sampler" if is_sampler(model) else "lattice"
    return Row(
        model.document["name"], family, measured.runtime, measured.precision, measured.count,
        1e3 * min(times), difference,
    )  # fmt: skip


def print_row(found: Row, is_first: bool) -> None:
    if is_first:
        print("| model | runtime | precision | count | ms | a second | 256^3, ms | difference |")
        print("|---|---|---|--:|--:|--:|--:|--:|")
    whole = f"{1e3 * WHOLE / found.rate:.0f}" if found.family == "lattice" else "-"
    values = (
        found.model, found.runtime, found.precision, found.count, f"{found.milliseconds:.2f}",
        f"{found.rate:.3g}", whole, f"{found.difference:.1e}",
    )  # fmt: skip
    print("|", " | ".join(map(str, values)), "|", flush=True)


def is_sampler(model: ModelFile) -> bool:
    return bool(model.document["family"] == "sampler")


def points_of(count: int) -> np.ndarray:
    return np.random.default_rng(1).uniform(-RANGE, RANGE, (count, 3)).astype(np.float32)


def box_of(origin: tuple[int, int, int], edge: int) -> Box:
    return Box(origin, tuple(o + edge for o in origin))


def has_engine() -> bool:
    try:
        engine.open_bytes(b"")
    except engine.EngineError:
        return False
    except Exception:  # of the engine, which refuses an empty file
        return True
    return True


def source() -> str:
    return "engine" if has_engine() else "float64 reference"


def expected_values(model: ModelFile) -> np.ndarray:
    points, cube = points_of(CHECKED_POINTS), box_of((0, 0, 0), CHECKED_EDGE)
    if has_engine():
        with engine.open_bytes(model_file.serialize(model)) as texture:
            if is_sampler(model):
                return np.asarray(texture.eval_points(points))
            return np.asarray(texture.eval_box(cube.lo, cube.size))
    if is_sampler(model):
        return reference.evaluate_points(model, points.astype(np.float64))
    return reference.evaluate_box(model, cube.lo, cube.size)


# Shaders


def shaders(model: ModelFile, args: argparse.Namespace) -> Found:
    try:
        from shader_gpu import device
    except ImportError as error:
        yield f"shaders are skipped: {error} (pip install wgpu)"
        return
    try:
        info = device().adapter.info
    except (AssertionError, RuntimeError) as error:
        yield f"shaders are skipped: {error}"
        return
    size = sizes(args, info["adapter_type"] != "CPU")
    name = f"shader, {info['device']}"
    yield from (sampler_shaders if is_sampler(model) else lattice_shader)(model, size, name)


def sampler_shaders(model: ModelFile, size: Sizes, name: str) -> Found:
    from shader_gpu import MAINS, WgpuWork, wait

    from solidtex_export.export.shader.emitter import PRECISIONS
    from solidtex_export.export.shader.shader import shader

    points = np.pad(points_of(size.points), ((0, 0), (0, 1)))
    points[:CHECKED_POINTS, :3] = points_of(CHECKED_POINTS)
    origins = np.zeros((size.points, 4), np.int32)
    for precision in PRECISIONS:
        made = shader(model, ".wgsl", "solid", "buffer", precision, corrects_means=has_engine())
        code = made.text + MAINS[".wgsl"].replace("NAME", "solid")
        work = WgpuWork(code, made.data, [points, origins], size.points)

        def call(work: WgpuWork = work) -> None:
            work.submit()
            wait()

        def checked(work: WgpuWork = work) -> np.ndarray:
            return work.read()[:CHECKED_POINTS, :3]

        stored = "float" if precision == "float" else "half weights"
        yield Measured(name, stored, call, size.points, checked)


def lattice_shader(model: ModelFile, size: Sizes, name: str) -> Found:
    from shader_gpu import device, wait

    from solidtex_export.export.shader.lattice_gpu import LatticeGpu

    gpu = LatticeGpu(device(), model)
    steps = range(0, size.edge, size.brick)
    extent = (size.brick,) * 3

    def call() -> None:
        for lo in product(steps, repeat=3):
            gpu.submit(lo, extent)
        wait()

    def checked() -> np.ndarray:
        return gpu.eval_box((0, 0, 0), (CHECKED_EDGE,) * 3)

    yield Measured(name, "float", call, size.edge**3, checked)


# ONNX graphs


def onnx_runtime(model: ModelFile, args: argparse.Namespace) -> Found:
    try:
        import onnx  # noqa: F401

        os.environ.setdefault("ORT_DISABLE_TELEMETRY", "1")
        import onnxruntime
    except ImportError as error:
        yield f"ONNX Runtime is skipped: {error} (pip install onnx onnxruntime)"
        return
    if hasattr(onnxruntime, "preload_dlls"):
        onnxruntime.preload_dlls()  # CUDA of a PyTorch that is installed
    onnxruntime.set_default_logger_severity(3)
    for provider in onnxruntime.get_available_providers():
        if provider != "AzureExecutionProvider":
            yield onnx_session(model, args, provider)


def onnx_session(model: ModelFile, args: argparse.Namespace, provider: str) -> Measured | str:
    import onnxruntime

    is_gpu = provider != "CPUExecutionProvider"
    made, inputs, count = graph(model, sizes(args, is_gpu))
    try:
        session = onnxruntime.InferenceSession(made.SerializeToString(), providers=[provider])
    except Exception as error:  # each provider has its own
        return f"ONNX Runtime, {provider} is skipped: {error}"
    if provider not in session.get_providers():
        return f"ONNX Runtime, {provider} is skipped: it does not start here"
    memory = "cuda" if provider in ("CUDAExecutionProvider", "TensorrtExecutionProvider") else "cpu"
    binding = session.io_binding()
    for name, values in inputs.items():
        there = onnxruntime.OrtValue.ortvalue_from_numpy(np.ascontiguousarray(values), memory, 0)
        binding.bind_ortvalue_input(name, there)
    binding.bind_output("values", memory)

    def call() -> None:
        session.run_with_iobinding(binding)
        binding.synchronize_outputs()

    def checked() -> np.ndarray:
        return first_values(model, binding.copy_outputs_to_cpu()[0])

    return Measured(f"ONNX Runtime, {provider}", "float", call, count, checked)


def graph(model: ModelFile, size: Sizes) -> tuple[object, dict[str, np.ndarray], int]:
    """A graph, its noise, and its number of voxels or points."""
    from solidtex_export.export.onnx.inputs import block_inputs, point_inputs
    from solidtex_export.export.onnx.model import onnx_model

    box = None if is_sampler(model) else box_of((0, 0, 0), size.brick)
    made = onnx_model(model, box)
    metadata = {p.key: p.value for p in made.metadata_props}
    if box is not None:
        return made, block_inputs(metadata, box.lo), size.brick**3
    # Noise of a few points, over and over: the network takes the same time.
    repeats = -(-size.points // CHECKED_POINTS)
    inputs = point_inputs(metadata, points_of(CHECKED_POINTS))
    inputs = {name: np.tile(values, (repeats, 1)) for name, values in inputs.items()}
    return made, inputs, repeats * CHECKED_POINTS


def first_values(model: ModelFile, values: np.ndarray) -> np.ndarray:
    """Of points [point, channel], or of a block [1, channel, x, y, z] as [x, y, z, channel]."""
    if is_sampler(model):
        return values[:CHECKED_POINTS]
    e = CHECKED_EDGE
    return np.moveaxis(values[0, :, :e, :e, :e], 0, -1)


def pytorch(model: ModelFile, args: argparse.Namespace) -> Found:
    try:
        import onnx  # noqa: F401
        import torch
    except ImportError as error:
        yield f"PyTorch is skipped: {error} (pip install onnx torch)"
        return
    if not torch.cuda.is_available():
        yield "PyTorch is skipped: it finds no CUDA device"
        return
    for precision in ("float", "TF32", "half"):
        yield torch_graph(model, args, precision)


def torch_graph(model: ModelFile, args: argparse.Namespace, precision: str) -> Measured:
    """The graph on CUDA; in half precision and TF32 the matrix units compute."""
    import torch
    from torch_graph import TorchGraph

    dtype = torch.float16 if precision == "half" else torch.float32
    layout = torch.channels_last_3d if precision != "float" else torch.contiguous_format

    def moved(tensor: torch.Tensor) -> torch.Tensor:
        given = {"memory_format": layout} if tensor.ndim == 5 else {}
        return tensor.to("cuda", dtype, **given)

    made, inputs, count = graph(model, sizes(args, True))
    network = TorchGraph(made, torch.contiguous_format, moved)
    there = {name: moved(torch.from_numpy(values)) for name, values in inputs.items()}

    def run() -> torch.Tensor:
        torch.backends.cudnn.allow_tf32 = precision == "TF32"
        torch.backends.cuda.matmul.allow_tf32 = precision == "TF32"
        return network(there)

    def call() -> None:
        run()
        torch.cuda.synchronize()

    def checked() -> np.ndarray:
        return first_values(model, run().float().cpu().numpy())

    return Measured(f"PyTorch, {torch.cuda.get_device_name()}", precision, call, count, checked)


if __name__ == "__main__":
    main()
