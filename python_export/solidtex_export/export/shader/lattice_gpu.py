"""Evaluates boxes of the lattice family on the GPU, through the package wgpu."""

from __future__ import annotations

import numpy as np
import wgpu

from solidtex_export.export.file_format.model_file import ModelFile
from solidtex_export.export.places import check_box, check_seed
from solidtex_export.export.shader.lattice import LatticeProgram, Pass, lattice_program
from solidtex_export.generators.regions import Box

LARGEST_BINDING = "max-storage-buffer-binding-size"
UNIFORM_PITCH = 256
"""Alignment that every adapter allows."""


class LatticeGpu:
    """A model on a device. Buffers grow with the largest box."""

    def __init__(self, device: wgpu.GPUDevice, model: ModelFile, seed: int = 0) -> None:
        self.device = device
        self.program: LatticeProgram = lattice_program(model, check_seed(seed))
        usage = wgpu.BufferUsage
        self._weights = device.create_buffer_with_data(
            data=self.program.weights, usage=usage.STORAGE
        )
        module = device.create_shader_module(code=self.program.source)
        self._pipelines = {
            entry: device.create_compute_pipeline(
                layout="auto", compute={"module": module, "entry_point": entry}
            )
            for entry in sorted({step.entry for step in self.program.steps})
        }
        self._uniforms = device.create_buffer(
            size=UNIFORM_PITCH * len(self.program.steps), usage=usage.UNIFORM | usage.COPY_DST
        )
        self._tensors: dict[str, wgpu.GPUBuffer] = {}
        self._bound: list[wgpu.GPUBindGroup] = []

    def eval_box(self, lo: tuple[int, int, int], size: tuple[int, int, int]) -> np.ndarray:
        """Values of voxels: float32 [x, y, z, channel]; raises ValueError for a wrong box."""
        self.submit(lo, size)
        return self.read(size)

    def submit(self, lo: tuple[int, int, int], size: tuple[int, int, int]) -> None:
        """Start the computation of a box. It is done when the device has no more work."""
        lo, size = check_box(lo, size)
        hi = tuple(l + s for l, s in zip(lo, size, strict=True))
        passes = self.program.passes(Box(lo, hi))
        self._grow(passes)
        uniforms = b"".join(p.uniform.ljust(UNIFORM_PITCH, b"\0") for p in passes)
        self.device.queue.write_buffer(self._uniforms, 0, uniforms)
        encoder = self.device.create_command_encoder()
        work = encoder.begin_compute_pass()
        for pass_, bound in zip(passes, self._bound, strict=True):
            work.set_pipeline(self._pipelines[pass_.step.entry])
            work.set_bind_group(0, bound)
            work.dispatch_workgroups(*pass_.workgroups)
        work.end()
        self.device.queue.submit([encoder.finish()])

    def read(self, size: tuple[int, int, int]) -> np.ndarray:
        """Values of the last box."""
        groups = -(-self.program.channels // 4)
        count = 16 * groups * int(np.prod(size))
        data = self.device.queue.read_buffer(self._tensors[self.program.output], 0, count)
        values = np.frombuffer(data, np.float32).reshape(groups, *size, 4)
        joined = values.transpose(1, 2, 3, 0, 4).reshape(*size, 4 * groups)
        return joined[..., : self.program.channels]

    def _grow(self, passes: list[Pass]) -> None:
        usage = wgpu.BufferUsage.STORAGE | wgpu.BufferUsage.COPY_SRC
        if all(p.step.name in self._tensors and 16 * p.elements <= self._tensors[p.step.name].size
               for p in passes):  # fmt: skip
            return
        needed, limit = 16 * max(p.elements for p in passes), self.device.limits[LARGEST_BINDING]
        if needed > limit:
            raise ValueError(
                f"size: found a box that needs {needed} bytes, expected at most {limit}"
            )
        for p in passes:
            self._tensors[p.step.name] = self.device.create_buffer(
                size=16 * p.elements, usage=usage
            )
        self._bound = [self._bind(index, p) for index, p in enumerate(passes)]

    def _bind(self, index: int, pass_: Pass) -> wgpu.GPUBindGroup:
        step = pass_.step
        entries = {
            0: {"buffer": self._uniforms, "offset": UNIFORM_PITCH * index,
                "size": len(pass_.uniform)},
            4: {"buffer": self._tensors[step.name]},
        }  # fmt: skip
        if step.reads_weights:
            entries[1] = {"buffer": self._weights}
        for binding, source in enumerate(step.sources, 2):
            entries[binding] = {"buffer": self._tensors[source]}
        return self.device.create_bind_group(
            layout=self._pipelines[step.entry].get_bind_group_layout(0),
            entries=[{"binding": b, "resource": r} for b, r in entries.items()],
        )
