"""Writes the tabs of a Shadertoy from an exported shader and its weights.

    solidtex-export-shader stone-grey -o stone.glsl --weights texture --precision half
    python tabs.py stone.glsl

Shadertoy has no textures of one's own, and browsers compile no 140 KB of constants in one shader.
So each of the buffers A to D has a quarter of the weights and copies the others from the buffer
before it: D has all.
"""

import re
import sys
from pathlib import Path
from typing import NoReturn

import numpy as np

WIDTH = 128  # texels of the texture of weights
EXPORT = "solidtex-export-shader MODEL -o NAME.glsl --weights texture --precision half"
BUFFER = """// Texels {first} to {last} of the weights; the others come from iChannel0.
const uvec2[{count}] part = uvec2[{count}](
{values});
void mainImage(out vec4 color, in vec2 pixel) {{
  ivec2 at = ivec2(pixel);
  int index = at.x + {width} * at.y - {first};
  color = texelFetch(iChannel0, at, 0);
  if (at.x < {width} && index >= 0 && index < {count})
    color = vec4(unpackHalf2x16(part[index].x), unpackHalf2x16(part[index].y));
}}
"""


def main(arguments: list[str]) -> None:
    if len(arguments) != 1:
        fail(f"found {len(arguments)} arguments, expected one: a shader, such as stone.glsl")
    shader = Path(arguments[0])
    data = shader.with_suffix(".weights.bin")
    for file in (shader, data):
        if not file.is_file():
            fail(f"{file}: found no such file, expected one of {EXPORT}")
    source = shader.read_text()
    sampler = re.search(r"^uniform sampler2D solidtex_(\w+)_weights;$", source, re.M)
    weights = np.fromfile(data, "<u4")  # pairs of halves
    words = weights[: 2 * WIDTH].view("<f2")  # whole numbers below 2048
    if sampler is None or words.size < 4 * WIDTH or not np.array_equal(words, words.round()):
        fail(f"{shader}: found other weights than a texture of halves, expected those of {EXPORT}")
    name = sampler[1]
    image = Path(__file__).with_name("image.glsl").read_text()
    image = image.replace("solidtex_stone", f"solidtex_{name}")
    write(shader, "image", f"#define solidtex_{name}_weights iChannel0\n{source}{image}")
    first = 0
    for letter, part in zip("abcd", np.array_split(weights.reshape(-1, 2), 4), strict=True):
        values = ",\n".join(f"uvec2({low}u, {high}u)" for low, high in part)
        last = first + len(part) - 1
        text = BUFFER.format(first=first, last=last, count=len(part), values=values, width=WIDTH)
        write(shader, f"buffer-{letter}", text)
        first += len(part)


def fail(message: str) -> NoReturn:
    sys.exit(f"tabs.py: {message}")


def write(shader: Path, tab: str, text: str) -> None:
    path = shader.with_name(f"{shader.stem}-{tab}.glsl")
    path.write_text(text)
    print(path)


if __name__ == "__main__":
    main(sys.argv[1:])
