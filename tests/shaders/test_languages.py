"""Exported shaders in HLSL, Slang, Metal and OSL compute what the engine computes."""

import os
import subprocess
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest
from shader_gpu import compiled, run_wgpu
from test_shaders import (
    COMBINATIONS,
    FLOAT_BOUND,
    NAME,
    REPOSITORY,
    STONE,
    STONE_POINTS,
    check,
)

from solidtex import Texture
from solidtex_export.export.shader.emitter import Precision, Storage
from solidtex_export.export.shader.shader import shader

HERE = Path(__file__).parent
BPY = os.environ.get("SOLIDTEX_BPY", "")

HLSL_MAIN = """
StructuredBuffer<float4> points : register(t0, space1);
StructuredBuffer<int4> origins : register(t1, space1);
RWStructuredBuffer<float4> results : register(u2, space1);
[numthreads(64, 1, 1)] void evaluate(uint3 id : SV_DispatchThreadID) {
  uint count, stride;
  points.GetDimensions(count, stride);
  if (id.x >= count) return;
  float3 color = solidtex_test_at(origins[id.x].xyz, points[id.x].xyz, points[id.x].w);
  results[id.x] = float4(color, 0.0);
}
"""


@pytest.mark.parametrize(("storage", "precision"), COMBINATIONS)
def test_hlsl(storage: Storage, precision: Precision) -> None:
    made = shader(STONE, ".hlsl", NAME, storage, precision)
    binding = "#define SOLIDTEX_REGISTER : register(t0, space0)\n"
    main = HLSL_MAIN.replace("evaluate", "main")
    options = ["-D", "-V", "-S", "comp", "-e", "main", "--hlsl-iomap"]
    command = ["glslangValidator", *options, "{source}", "-o", "{output}"]
    code = compiled(command, binding + made.text + main, ".hlsl")
    results = run_wgpu(code, made.data, STONE_POINTS.inputs, len(STONE_POINTS.points))
    check(STONE_POINTS, results, precision)


@pytest.mark.parametrize("precision", ["float", "half"])
def test_slang(precision: Precision) -> None:
    """Slang's own compiler, for processors: it makes C++ and compiles that."""
    spy = pytest.importorskip("slangpy", reason="the Python package slangpy is not installed")
    made = shader(STONE, ".slang", NAME, "buffer", precision)
    device = spy.Device(type=spy.DeviceType.cpu)
    main = HLSL_MAIN.replace("[numthreads", '[shader("compute")] [numthreads')
    module = device.load_module_from_source("solid", made.text + main)
    program = device.link_program([module], [module.entry_point("evaluate")])
    usage = spy.BufferUsage.shader_resource | spy.BufferUsage.unordered_access

    def buffer(data: np.ndarray) -> object:
        size = data.dtype.itemsize * data.shape[1]
        return device.create_buffer(data=data, struct_size=size, usage=usage)

    points, origins = STONE_POINTS.inputs
    results = buffer(np.zeros_like(points))
    device.create_compute_kernel(program).dispatch(
        thread_count=[len(points), 1, 1],
        vars={
            "points": buffer(points),
            "origins": buffer(origins),
            "results": results,
            f"{NAME}_weights": buffer(made.data),
        },
    )
    check(STONE_POINTS, results.to_numpy().view(np.float32).reshape(-1, 4), precision)


METAL_HEADERS = "#include <fstream>\n#include <string>\n#include <vector>\n"
METAL_MAIN = """
template <class T> std::vector<T> all_of(const char* name) {
  std::ifstream file(name, std::ios::binary);
  std::string bytes((std::istreambuf_iterator<char>(file)), {});
  std::vector<T> values(bytes.size() / sizeof(T));
  std::memcpy(values.data(), bytes.data(), bytes.size());
  return values;
}
int main(int, char** names) {
  const auto data = all_of<ELEMENT>(names[1]);
  const auto points = all_of<float4>(names[2]);
  const auto origins = all_of<glm::ivec4>(names[3]);
  std::ofstream results(names[4], std::ios::binary);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const float4 value(solidtex_test_at(int3(origins[i]), float3(points[i]), points[i].w WEIGHTS),
                       0);
    results.write(reinterpret_cast<const char*>(&value), sizeof value);
  }
}
"""


@pytest.mark.parametrize(("storage", "precision"), [*COMBINATIONS, ("constant", "float")])
def test_metal(storage: Storage, precision: Precision, tmp_path: Path) -> None:
    """As C++ with a stand-in for Metal's header: no compiler of Metal runs here."""
    made = shader(STONE, ".metal", NAME, storage, precision)
    element = "uint2" if (storage, precision) == ("buffer", "half") else "uint4"
    weights = {"buffer": ", data.data()", "texture": ", {data.data(), 128}", "constant": ""}[
        storage
    ]
    main = METAL_MAIN.replace("ELEMENT", "float4" if storage == "texture" else element)
    source = tmp_path / "solid.cpp"
    source.write_text(METAL_HEADERS + made.text + main.replace("WEIGHTS", weights))
    program = tmp_path / "solid"
    warnings = ["-Wall", "-Wextra", "-Werror", "-Wno-unused-function", "-Wno-ignored-attributes"]
    compile_ = ["g++", "-std=c++20", "-O1", *warnings, f"-I{HERE}", source, "-o", program]
    subprocess.run(compile_, check=True)
    data = np.zeros(0, np.float32) if made.data is None else made.data
    if storage == "texture":
        data = data.astype(np.float32)
    files = [tmp_path / name for name in ("data", "points", "origins", "results")]
    for file, values in zip(files, (data, *STONE_POINTS.inputs), strict=False):
        file.write_bytes(values.tobytes())
    subprocess.run([program, *files], check=True)
    results = np.frombuffer(files[-1].read_bytes(), np.float32).reshape(-1, 4)
    check(STONE_POINTS, results, precision)


@pytest.mark.skipif(not BPY, reason="SOLIDTEX_BPY names no Python with bpy")
@pytest.mark.parametrize("footprint", [0.0, 3.0])
def test_osl_in_cycles(footprint: float, tmp_path: Path) -> None:
    """Blender's compiler of OSL compiles the shader, and Cycles runs it as plain arithmetic."""
    side, texels, origin = 32, 100.0, np.array([2000.25, 7.5, -3000.125])
    (tmp_path / "test.osl").write_text(shader(STONE, ".osl", NAME, "constant", "float").text)
    picture = tmp_path / "plane.exr"
    numbers = [side, texels, footprint, picture, *origin]
    command = [BPY, "-B", HERE / "render_osl.py", tmp_path / "test.osl", *numbers]
    environment = {**os.environ, "PYTHONPATH": ""}
    subprocess.run([str(part) for part in command], check=True, env=environment)
    pixels = oiio.ImageBuf(str(picture)).get_pixels(oiio.FLOAT)[..., :3]
    middle = (np.arange(side) + 0.5) / side * texels - texels / 2
    x, y = np.meshgrid(middle, -middle)
    with Texture(REPOSITORY / "models" / "stone-grey.solidtex") as texture:
        points = np.stack([x, y, 0 * x], axis=-1)
        expected = texture.eval_points(points, origin, radii=np.float32(footprint))
    # Cycles computes the position in floats.
    assert np.abs(pixels - expected).max() <= FLOAT_BOUND


def test_osl_has_constants_only() -> None:
    made = shader(STONE, ".osl", NAME, "constant", "float")
    assert made.data is None
    assert "shader solidtex_test_shader(" in made.text
