"""Lattice models in WGSL compute passes: Mesa's software GPU computes what the engine computes."""

import base64
import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import wgpu
from shader_gpu import device, run_wgpu

from solidtex import Texture
from solidtex_export.commands import export_shader
from solidtex_export.export import random_models
from solidtex_export.export.file_format import model_file
from solidtex_export.export.file_format.checks import ModelFileError
from solidtex_export.export.file_format.model_file import ModelFile
from solidtex_export.export.shader.lattice import lattice_program
from solidtex_export.export.shader.lattice_gpu import LatticeGpu
from solidtex_export.export.verification import noise

MODELS = Path(__file__).resolve().parents[2] / "models"
BOUND = 5e-4
SEED = 2**63 + 7
BOXES = [
    ((0, 0, 0), (9, 8, 7)),
    ((-37, 5, -3), (8, 9, 10)),
    ((31, -33, 64), (1, 1, 1)),
    ((2**30 - 3, -(2**30), 12345), (3, 2, 5)),
]


def graph_model(nodes: list[dict[str, Any]], channels: int = 3) -> ModelFile:
    graph = {"nodes": nodes, "output": nodes[-1]["name"]}
    model = ModelFile(random_models.document("field", graph), {})
    model.document["channels"] = model.document["channels"][:channels]
    return model


def noise_model(distribution: str, channels: int = 3) -> ModelFile:
    node = {"name": "z", "op": "noise", "level": 0, "channels": channels}
    return graph_model([node | {"distribution": distribution}])


def phase_model() -> ModelFile:
    model = noise_model("normal")
    nodes = [*model.document["field"]["nodes"], {"name": "p", "op": "softmax", "inputs": ["z"]}]
    return graph_model(nodes)


# Made before a device is: PyTorch cannot load all of itself beside Mesa's LLVM.
CASES = {
    "every operation": random_models.every_operation_model(),
    "small": random_models.lattice_model(3, 2, 3),
    "softmax": phase_model(),
    "paint-rusted": model_file.read(MODELS / "paint-rusted.solidtex"),
}
SAMPLER = random_models.sampler_model(4, 3, 8)


@pytest.mark.parametrize("case", CASES)
def test_values(case: str) -> None:
    """At odd sizes and far origins, with buffers that an earlier box left."""
    model = CASES[case]
    gpu = LatticeGpu(device(), model, SEED)
    with Texture.from_bytes(model_file.serialize(model), SEED) as texture:
        for lo, size in BOXES:
            found, expected = gpu.eval_box(lo, size), texture.eval_box(lo, size)
            assert found.shape == expected.shape
            assert np.ptp(expected) > 0 or size == (1, 1, 1)
            error = np.abs(found - expected).max() / max(1.0, float(np.abs(expected).max()))
            print(f"{case}, {lo}, {size}: {error:.1e}")
            assert error <= BOUND


@pytest.mark.parametrize(("lo", "size"), BOXES)
def test_noise_is_bit_identical(lo: tuple[int, int, int], size: tuple[int, int, int]) -> None:
    hi = tuple(l + s for l, s in zip(lo, size, strict=True))
    found = LatticeGpu(device(), noise_model("uniform"), SEED).eval_box(lo, size)
    expected = noise.block("solidtex-1", "uniform", SEED, 0, 3, lo, hi)
    np.testing.assert_array_equal(found, np.moveaxis(expected, 0, -1).astype(np.float32))


def test_all_32_bits_of_the_noise() -> None:
    points = np.random.default_rng(0).integers(-(2**31), 2**31, (500, 4)).astype(np.int32)
    program = lattice_program(noise_model("uniform", channels=1), SEED)
    main = """
@group(1) @binding(0) var<storage, read> points: array<vec4<i32>>;
@group(1) @binding(1) var<storage, read_write> words: array<vec4<u32>>;
@compute @workgroup_size(64) fn main(@builtin(global_invocation_id) id: vec3<u32>) {
  if (id.x >= arrayLength(&points)) { return; }
  let p = bitcast<vec4<u32>>(points[id.x]);
  let key = weights[0];
  words[id.x].x = noise_bits(p.x, p.y, p.z, key.x, key.y, key.z, key.w);
}
"""
    code = program.source.replace("@binding(1) var<storage, read> weights",
                                  "@binding(0) var<storage, read> weights")  # fmt: skip
    code = code.replace("@binding(0) var<uniform> step", "@binding(1) var<uniform> step") + main
    words = run_wgpu(code, program.weights, [points], len(points)).view(np.uint32)[:, 0]
    expected = noise.solidtex_1_bits(SEED, 0, 0, *points[:, :3].T.astype(np.uint32))
    np.testing.assert_array_equal(words, expected)


def test_exported_files_are_enough(tmp_path: Path) -> None:
    """A program with the three files alone fills the brick three bricks further along z."""
    source = tmp_path / "small.solidtex"
    source.write_bytes(model_file.serialize(CASES["small"]))
    output, size, brick = tmp_path / "small.wgsl", 8, (0, 0, -3)
    arguments = [source, "-o", output, "--size", size, "--seed", SEED]
    assert export_shader.main([str(a) for a in arguments]) == 0
    listed = json.loads(output.with_suffix(".passes.json").read_text())
    module = device().create_shader_module(code=output.read_text())
    storage = wgpu.BufferUsage.STORAGE | wgpu.BufferUsage.COPY_SRC
    weights = device().create_buffer_with_data(
        data=output.with_suffix(".weights.bin").read_bytes(), usage=storage
    )
    tensors = {
        p["tensor"]: device().create_buffer(size=16 * p["elements"], usage=storage)
        for p in listed["passes"]
    }
    for p in listed["passes"]:
        uniform = bytearray(base64.b64decode(p["uniform"]))
        if noise_ := p.get("noise"):
            lo = [l + b * (size >> noise_["level"])
                  for l, b in zip(noise_["lo"], brick, strict=True)]  # fmt: skip
            struct.pack_into("<3i", uniform, 16, *lo)
        data = device().create_buffer_with_data(data=uniform, usage=wgpu.BufferUsage.UNIFORM)
        bound = {0: data, 4: tensors[p["tensor"]]}
        bound |= {1: weights} if p["reads_weights"] else {}
        bound |= {2 + i: tensors[name] for i, name in enumerate(p["sources"])}
        pipeline = device().create_compute_pipeline(
            layout="auto", compute={"module": module, "entry_point": p["entry"]}
        )
        entries = [{"binding": b, "resource": {"buffer": buffer}} for b, buffer in bound.items()]
        encoder = device().create_command_encoder()
        work = encoder.begin_compute_pass()
        work.set_pipeline(pipeline)
        group = device().create_bind_group(
            layout=pipeline.get_bind_group_layout(0), entries=entries
        )
        work.set_bind_group(0, group)
        work.dispatch_workgroups(*p["workgroups"])
        work.end()
        device().queue.submit([encoder.finish()])
    values = np.frombuffer(device().queue.read_buffer(tensors[listed["output"]]), np.float32)
    with Texture(source, SEED) as texture:
        expected = texture.eval_box([size * b for b in brick], [size] * 3)
    found = values.reshape(size, size, size, 4)[..., : len(listed["channels"])]
    np.testing.assert_allclose(found, expected, atol=BOUND)


def test_refusals() -> None:
    unknown = noise_model("uniform")
    unknown.document["field"]["nodes"].append({"name": "w", "op": "warp", "inputs": ["z"]})
    published = noise_model("uniform")
    published.document["noise"]["scheme"] = "solidtexturenets"
    for model, message in (
        (unknown, "node w: found the operation 'warp', expected one of noise, "),
        (published, "noise scheme: found 'solidtexturenets', expected 'solidtex-1'"),
        (SAMPLER, "found a model of the sampler family"),
    ):
        with pytest.raises(ModelFileError, match=message):
            lattice_program(model)


def test_boxes_that_are_none_are_refused() -> None:
    model = noise_model("uniform")
    with pytest.raises(ValueError, match="seed: found -1"):
        LatticeGpu(device(), model, -1)
    gpu = LatticeGpu(device(), model, SEED)
    for lo, size, message in (
        ((0, 0, 0), (0, 1, 1), "size: found .* expected three whole numbers above 0"),
        ((0.5, 0, 0), (1, 1, 1), "origin: found .* expected three whole numbers"),
        ((2**40, 0, 0), (1, 1, 1), "origin: found .* expected voxels between"),
        ((0, 0, 0), (4096, 4096, 4096), "size: found a box that needs .* expected at most"),
    ):
        with pytest.raises(ValueError, match=message):
            gpu.eval_box(lo, size)  # type: ignore[arg-type]
