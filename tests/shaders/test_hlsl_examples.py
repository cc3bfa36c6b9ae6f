"""The HLSL of docs/hosts/unity/ and docs/hosts/unreal/ draws a ball on Mesa's software GPU."""

import shutil
import subprocess

import numpy as np
import pytest
import wgpu
from balls import RADIUS, ball, shown
from PIL import Image
from shader_gpu import compiled, device, resource
from test_shaders import REPOSITORY, SMALL, STONE

from solidtex_export.export.file_format import model_file
from solidtex_export.export.shader.shader import shader
from solidtex_export.export.verification import engine

HOSTS = REPOSITORY / "docs" / "hosts"
SIZE = WIDTH, HEIGHT = 256, 256
UNREAL = "unreal/SolidtexStone.ush"
# Where each has its color, in HLSL.
EXAMPLES = {
    "unity/SolidtexStone.hlsl": "Solidtex_float(normal, RADIUS, color);",
    UNREAL: "color = SolidtexColor(normal, RADIUS);",
}
BEFORE = "#define SOLIDTEX_REGISTER : register(t0, space0)\n"
MAIN = """
float4 main(float4 pixel : SV_Position) : SV_Target {
  float2 at = float2(2.0 * pixel.x - WIDTH, HEIGHT - 2.0 * pixel.y) / HEIGHT;
  float square = 1.0 - dot(at, at);
  float3 normal = float3(at, sqrt(max(square, 0.0)));
  float3 color;
  CALL
  color *= 0.3 + 0.9 * max(dot(normal, normalize(float3(1, 2, 3))), 0.0);
  return float4(square < 0.0 ? (0.85).xxx : pow(color, 1.0 / 2.2), 1.0);
}"""
TRIANGLE = """
@vertex fn main(@builtin(vertex_index) i: u32) -> @builtin(position) vec4<f32> {
  return vec4<f32>(f32(i & 1) * 4 - 1, f32(i >> 1) * 4 - 1, 0, 1);
}"""


def drawn(fragment: bytes, data: np.ndarray | None) -> np.ndarray:
    """Colors [HEIGHT, WIDTH, 3], 0 to 1, of a fragment shader that covers the picture."""
    modules = [device().create_shader_module(code=code) for code in (TRIANGLE, fragment)]
    pipeline = device().create_render_pipeline(
        layout="auto",
        vertex={"module": modules[0], "entry_point": "main"},
        primitive={"topology": "triangle-list"},
        fragment={
            "module": modules[1],
            "entry_point": "main",
            "targets": [{"format": "rgba8unorm"}],
        },
    )
    usage = wgpu.TextureUsage.RENDER_ATTACHMENT | wgpu.TextureUsage.COPY_SRC
    target = device().create_texture(size=(*SIZE, 1), format="rgba8unorm", usage=usage)
    attachment = {"view": target.create_view(), "load_op": "clear", "store_op": "store"}
    encoder = device().create_command_encoder()
    work = encoder.begin_render_pass(color_attachments=[attachment])
    work.set_pipeline(pipeline)
    if data is not None:
        entries = [{"binding": 0, "resource": resource(data)}]
        layout = pipeline.get_bind_group_layout(0)
        work.set_bind_group(0, device().create_bind_group(layout=layout, entries=entries))
    work.draw(3)
    work.end()
    device().queue.submit([encoder.finish()])
    texels = device().queue.read_texture({"texture": target}, {"bytes_per_row": 4 * WIDTH},
                                         (*SIZE, 1))  # fmt: skip
    return np.frombuffer(texels, np.uint8).reshape(HEIGHT, WIDTH, 4)[..., :3] / 255


def footprints(texels: np.ndarray) -> np.ndarray:
    """Half the larger step to the next pixel, in squares of 2x2 as GPUs measure it."""
    quads = texels.reshape(HEIGHT // 2, 2, WIDTH // 2, 2, 3)
    steps = [np.linalg.norm(np.diff(quads, axis=axis), axis=-1) for axis in (1, 3)]
    steps = [np.broadcast_to(step, quads.shape[:-1]) for step in steps]
    return 0.5 * np.maximum(*steps).reshape(HEIGHT, WIDTH)


def spirv_of(example: str, call: str, shader_text: str) -> bytes:
    """An example with the exported function in place of its include."""
    include = '#include "stone.hlsl"'
    text = (HOSTS / example).read_text()
    assert include in text
    main = MAIN.replace("CALL", call)
    for name, value in (("WIDTH", WIDTH), ("HEIGHT", HEIGHT), ("RADIUS", RADIUS)):
        main = main.replace(name, str(float(value)))
    options = ["-D", "-V", "-S", "frag", "-e", "main", "--hlsl-iomap"]
    command = ["glslangValidator", *options, "{source}", "-o", "{output}"]
    return compiled(command, BEFORE + text.replace(include, shader_text) + main, ".hlsl")


@pytest.mark.parametrize("example", EXAMPLES)
def test_drawn(example: str) -> None:
    """Weights are a texture, in Unreal's example too: Mesa takes very long for constants."""
    made = shader(STONE, ".hlsl", "solidtex_stone", "texture", "half")
    found = drawn(spirv_of(example, EXAMPLES[example], made.text), made.data)
    normals, is_inside = ball(*SIZE)
    texels = RADIUS * normals
    with engine.open_bytes(model_file.serialize(STONE)) as texture:
        radii = footprints(texels)[is_inside]
        expected = shown(texture, normals[is_inside], texels[is_inside], radii)
    errors = np.abs(found[is_inside] - expected)
    print(f"mean {errors.mean():.2g}, 99 % {np.quantile(errors, 0.99):.2g}, max {errors.max():.2g}")
    assert np.quantile(errors, 0.99) < 2 / 255
    picture = Image.open(REPOSITORY / "docs/images/hosts/hlsl.png").convert("RGB")
    assert np.abs(found - np.asarray(picture) / 255).mean() < 1 / 255


def test_unreal_with_constants_compiles() -> None:
    made = shader(SMALL, ".hlsl", "solidtex_stone", "constant", "half")
    assert spirv_of(UNREAL, EXAMPLES[UNREAL], made.text)


@pytest.mark.skipif(not shutil.which("mcs"), reason="Debian's mono-mcs is not installed")
def test_csharp_is_parsed() -> None:
    subprocess.run(["mcs", "--parse", HOSTS / "unity" / "SolidtexWeights.cs"], check=True)
