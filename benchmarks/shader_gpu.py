"""Runs exported shaders: through wgpu, and in OpenGL through moderngl.

The tests run them on Mesa's software GPU, benchmarks/gpu.py on the adapter that is there.
"""

from __future__ import annotations

import functools
import os
import subprocess
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import wgpu

from solidtex_export.export.file_format import model_file
from solidtex_export.export.file_format.model_file import ModelFile
from solidtex_export.export.shader.emitter import Precision, Storage
from solidtex_export.export.shader.shader import shader
from solidtex_export.export.verification import engine

if TYPE_CHECKING:
    import moderngl

os.environ.setdefault("XDG_RUNTIME_DIR", tempfile.gettempdir())

GROUP = 64
FAR = 2**24

MAINS = {
    ".wgsl": """
@group(1) @binding(0) var<storage, read> points: array<vec4<f32>>;
@group(1) @binding(1) var<storage, read> origins: array<vec4<i32>>;
@group(1) @binding(2) var<storage, read_write> results: array<vec4<f32>>;
@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
  let i = id.x;
  if (i >= arrayLength(&points)) { return; }
  let color = NAME_at(origins[i].xyz, points[i].xyz, points[i].w);
  results[i] = vec4<f32>(color, 0.0);
}
""",
    ".glsl": """
layout(local_size_x = 64) in;
layout(std430, binding = 1) readonly buffer Points { vec4 points[]; };
layout(std430, binding = 2) readonly buffer Origins { ivec4 origins[]; };
layout(std430, binding = 3) buffer Results { vec4 results[]; };
void main() {
  uint i = gl_GlobalInvocationID.x;
  if (i >= uint(points.length())) return;
  results[i] = vec4(NAME_at(origins[i].xyz, points[i].xyz, points[i].w), 0.0);
}
""",
}


@functools.cache
def device() -> wgpu.GPUDevice:
    adapters = wgpu.gpu.enumerate_adapters_sync()
    able = [a for a in adapters if a.info["backend_type"] in ("Vulkan", "Metal", "D3D12")]
    assert able, "found no Vulkan adapter, expected Mesa's: apt-get install mesa-vulkan-drivers"
    # A GPU before a software adapter.
    best = min(able, key=lambda a: a.info["adapter_type"] == "CPU")
    sizes = ("max-buffer-size", "max-storage-buffer-binding-size")
    return best.request_device_sync(required_limits={size: best.limits[size] for size in sizes})


@functools.cache
def context() -> moderngl.Context:
    import moderngl

    return moderngl.create_standalone_context(backend="egl")


class WgpuWork:
    """`main` of WGSL or SPIR-V, prepared to run once per point.

    Group 0 has the shader's own data, group 1 the inputs and then the results.
    """

    def __init__(
        self, code: str | bytes, data: np.ndarray | None, inputs: Sequence[np.ndarray], count: int
    ) -> None:
        module = device().create_shader_module(code=code)
        self._pipeline = device().create_compute_pipeline(
            layout="auto", compute={"module": module, "entry_point": "main"}
        )
        usage = wgpu.BufferUsage
        buffers = [
            device().create_buffer_with_data(data=np.ascontiguousarray(i), usage=usage.STORAGE)
            for i in inputs
        ]
        self._count = count
        self._results = device().create_buffer(
            size=16 * count, usage=usage.STORAGE | usage.COPY_SRC
        )
        self._bound: dict[int, wgpu.GPUBindGroup] = {}
        groups = [[{"buffer": b} for b in (*buffers, self._results)]]
        groups.insert(0, [] if data is None else [resource(data)])
        for group, resources in enumerate(groups):
            if resources:
                entries = [{"binding": i, "resource": r} for i, r in enumerate(resources)]
                layout = self._pipeline.get_bind_group_layout(group)
                self._bound[group] = device().create_bind_group(layout=layout, entries=entries)

    def submit(self) -> None:
        """Start a run. It is done when the device has no more work."""
        encoder = device().create_command_encoder()
        work = encoder.begin_compute_pass()
        work.set_pipeline(self._pipeline)
        for group, bound in self._bound.items():
            work.set_bind_group(group, bound)
        work.dispatch_workgroups(-(-self._count // GROUP))
        work.end()
        device().queue.submit([encoder.finish()])

    def read(self) -> np.ndarray:
        """Results of the last run: float32 [count, 4]."""
        return np.frombuffer(device().queue.read_buffer(self._results), np.float32).reshape(-1, 4)


def wait() -> None:
    """Until the device has no more work: reading a buffer waits for it."""
    device().queue.read_buffer(_small_buffer())


@functools.cache
def _small_buffer() -> wgpu.GPUBuffer:
    return device().create_buffer(size=16, usage=wgpu.BufferUsage.COPY_SRC)


def run_wgpu(
    code: str | bytes, data: np.ndarray | None, inputs: Sequence[np.ndarray], count: int
) -> np.ndarray:
    work = WgpuWork(code, data, inputs, count)
    work.submit()
    return work.read()


def resource(data: np.ndarray) -> object:
    if data.ndim == 2:
        return {
            "buffer": device().create_buffer_with_data(data=data, usage=wgpu.BufferUsage.STORAGE)
        }
    rows, columns = data.shape[:2]
    texture = device().create_texture(
        size=(columns, rows, 1),
        format="rgba16float" if data.dtype == np.float16 else "rgba32float",
        usage=wgpu.TextureUsage.TEXTURE_BINDING | wgpu.TextureUsage.COPY_DST,
    )
    layout = {"bytes_per_row": data[0].nbytes, "rows_per_image": rows}
    device().queue.write_texture({"texture": texture}, data, layout, (columns, rows, 1))
    return texture.create_view()


def run_opengl(
    code: str, data: np.ndarray | None, inputs: Sequence[np.ndarray], count: int
) -> np.ndarray:
    """Run a GLSL compute shader once per point. Buffer 0 is the shader's own, then the inputs."""
    shader = context().compute_shader(code)
    buffers = [context().buffer(np.ascontiguousarray(i).tobytes()) for i in inputs]
    buffers.append(context().buffer(reserve=16 * count))
    for i, buffer in enumerate(buffers):
        buffer.bind_to_storage_buffer(i + 1)
    if data is not None and data.ndim == 2:
        weights = context().buffer(data.tobytes())
        weights.bind_to_storage_buffer(0)
    elif data is not None:
        size = (data.shape[1], data.shape[0])
        dtype = "f2" if data.dtype == np.float16 else "f4"
        texture = context().texture(size, 4, data.tobytes(), dtype=dtype)
        texture.use(0)
    shader.run(-(-count // GROUP))
    return np.frombuffer(buffers[-1].read(), np.float32).reshape(-1, 4)


class Points:
    """Points near and far, half of them with footprints, and the engine's values."""

    def __init__(self, model: ModelFile, count: int = 1024, seed: int = 0) -> None:
        random = np.random.default_rng(1)
        self.points = np.zeros((count, 4), np.float32)
        self.points[:, :3] = random.uniform(-300, 300, (count, 3))
        self.points[count // 2 :, 3] = 2 ** random.uniform(-4, 10, count // 2)
        self.points[-8:, 3] = np.inf
        self.origins = np.zeros((count, 4), np.int32)
        self.origins[::2] = random.integers(-FAR, FAR, (count // 2, 4))
        with engine.open_bytes(model_file.serialize(model), seed) as texture:
            self.values = np.array([
                texture.eval_points(point[:3], origin.astype(float), radii=point[3])
                for point, origin in zip(self.points, self.origins[:, :3], strict=True)
            ])  # fmt: skip

    @property
    def inputs(self) -> list[np.ndarray]:
        return [self.points, self.origins]

    def errors(self, results: np.ndarray) -> np.ndarray:
        """Largest error of a channel at each point."""
        return np.abs(results[:, :3] - self.values).max(axis=1)


def run_shader(
    model: ModelFile,
    points: Points,
    suffix: str,
    storage: Storage,
    precision: Precision,
    seed: int = 0,
) -> np.ndarray:
    """Export a model to WGSL or GLSL and evaluate points: float32 [count, 4]."""
    made = shader(model, suffix, "solid", storage, precision, seed)
    text = made.text + MAINS[suffix].replace("NAME", "solid")
    arguments = (made.data, points.inputs, len(points.points))
    if suffix == ".wgsl":
        return run_wgpu(text, *arguments)
    return run_opengl("#version 430\n" + text, *arguments)


def compiled(command: Sequence[str], source: str, suffix: str) -> bytes:
    """Compile a source with a command, in which {source} and {output} stand for files."""
    with tempfile.TemporaryDirectory() as folder:
        paths = {"source": f"{folder}/shader{suffix}", "output": f"{folder}/output"}
        Path(paths["source"]).write_text(source)
        done = subprocess.run(
            [part.format(**paths) for part in command],
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, done.stdout + done.stderr
        output = Path(paths["output"])
        return output.read_bytes() if output.exists() else b""
