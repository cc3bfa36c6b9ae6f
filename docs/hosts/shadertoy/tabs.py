"""Writes the tabs of a Shadertoy from an exported shader and its weights.

    solidtex-export-shader stone-grey -o stone.glsl --weights texture --precision half
    python tabs.py stone.glsl           # with --force it replaces tabs that exist

Shadertoy has no textures of one's own, and browsers compile no 140 KB of constants in one shader.
So each of the buffers A to D has a quarter of the weights and copies the others from the buffer
before it: D has all.
"""

import argparse
import re
import sys
from pathlib import Path
from typing import NoReturn

import numpy as np

TABS = ("image", *(f"buffer-{letter}" for letter in "abcd"))
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


def main(shader: Path, force: bool) -> None:
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
    existing = [tab for tab in TABS if path_of(shader, tab).exists()]
    if existing and not force:
        fail(f"{path_of(shader, existing[0])}: found an existing file, expected none, or --force")
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


def path_of(shader: Path, tab: str) -> Path:
    return shader.with_name(f"{shader.stem}-{tab}.glsl")


def write(shader: Path, tab: str, text: str) -> None:
    path = path_of(shader, tab)
    path.write_text(text)
    print(path)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("shader", type=Path, help=f"of {EXPORT}")
    parser.add_argument("--force", action="store_true", help="replace tabs that exist")
    arguments = parser.parse_args()
    main(arguments.shader, arguments.force)
