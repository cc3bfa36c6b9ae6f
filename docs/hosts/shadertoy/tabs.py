"""Writes the tabs of a Shadertoy from an exported shader and its weights.

    solidtex-export-shader stone-grey -o stone.glsl --weights texture --precision half
    python tabs.py stone.glsl

Shadertoy has no textures of one's own, and browsers compile no 140 KB of constants in one shader.
So each of the buffers A to D has a quarter of the weights and copies the others from the buffer
before it: D has all.
"""

import sys
from pathlib import Path

import numpy as np

WIDTH = 128  # texels of the texture of weights
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


def main(shader: Path) -> None:
    image = Path(__file__).with_name("image.glsl").read_text()
    weights = np.fromfile(shader.with_suffix(".weights.bin"), "<u4").reshape(-1, 2)
    define = f"#define solidtex_{shader.stem}_weights iChannel0\n"
    write(shader, "image", define + shader.read_text() + image.replace("stone", shader.stem))
    first = 0
    for letter, part in zip("abcd", np.array_split(weights, 4), strict=True):
        values = ",\n".join(f"uvec2({low}u, {high}u)" for low, high in part)
        last = first + len(part) - 1
        text = BUFFER.format(first=first, last=last, count=len(part), values=values, width=WIDTH)
        write(shader, f"buffer-{letter}", text)
        first += len(part)


def write(shader: Path, tab: str, text: str) -> None:
    path = shader.with_name(f"{shader.stem}-{tab}.glsl")
    path.write_text(text)
    print(path)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
