"""Pictures of what scale, seed, direction and footprint do (docs/placement.md):

python docs/scenes/placement.py --programs build/bin -o docs/images/placement
"""

from __future__ import annotations

import argparse
import json
import subprocess
import tempfile
from pathlib import Path
from typing import Any

from PIL import Image

SCENES = Path(__file__).resolve().parents[2] / "scenes"
SIDE, GAP = 260, 8
CUBE = 2.0  # units along an edge

PICTURES: dict[str, list[tuple[dict[str, Any], list[str]]]] = {
    "scale": [
        ({"solid": "granite-speckled", "texels_per_unit": texels / CUBE}, [])
        for texels in (128, 256, 512)
    ],
    "seed": [
        ({"solid": "marble", "texels_per_unit": 160 / CUBE, "seed": seed}, []) for seed in (0, 1, 2)
    ],
    "direction": [
        ({"solid": "wood-zebrano", "texels_per_unit": 200 / CUBE, "transform": steps}, [])
        for steps in (
            [],
            [{"rotate": {"axis": [1, 0, 0], "degrees": 90}}],
            [{"rotate": {"axis": [1, 0, 0], "degrees": 45}}],
        )
    ],
    "footprint": [
        (
            {"solid": "granite-speckled", "texels_per_unit": 4096 / CUBE},
            ["--texture-filter", texture_filter, "--spp", spp, "--view", "albedo"],
        )
        for texture_filter, spp in (("none", "4"), ("footprint", "4"), ("none", "256"))
    ],
}


def scene(color: dict[str, Any]) -> dict[str, Any]:
    """A cube without a corner, on the ground."""
    turn = {"rotate": {"axis": [0, 1, 0], "degrees": -28}}
    return {
        "version": 1,
        "render": {"size": [SIDE, SIDE], "spp": 48, "exposure": -0.4},
        "camera": {"position": [3.2, 4.6, 8.6], "look_at": [0, 0.95, 0], "fov": 21},
        "materials": {
            "floor": {"type": "diffuse", "color": [0.36, 0.355, 0.35]},
            "solid": {"type": "coated", "roughness": 0.3, "color": color},
        },
        "objects": [
            {"mesh": str(SCENES / "meshes" / "ground.ply"), "material": "floor"},
            {
                "mesh": str(SCENES / "meshes" / "cube-cut.ply"),
                "material": "solid",
                "transform": [turn, {"translate": [0, 1, 0]}],
            },
        ],
        "environment": {"file": str(SCENES / "studio.exr"), "rotation": 40},
    }


def render(programs: Path, color: dict[str, Any], options: list[str], folder: Path) -> Image.Image:
    file, out = folder / "scene.json", folder / "out.png"
    file.write_text(json.dumps(scene(color)))
    program = str(programs / "solidtex-render")
    subprocess.run([program, file, "--quiet", "--force", *options, "-o", out], check=True)
    return Image.open(out).convert("RGB")


def main() -> None:
    p = argparse.ArgumentParser(description=__doc__, allow_abbrev=False)
    p.add_argument("--programs", type=Path, required=True, help="folder with solidtex-render")
    p.add_argument("-o", dest="output", type=Path, required=True, help="folder for the pictures")
    p.add_argument("names", nargs="*", default=list(PICTURES), help="some of the pictures")
    args = p.parse_args()
    args.output.mkdir(parents=True, exist_ok=True)
    for name in args.names:
        panels = PICTURES[name]
        row = Image.new("RGB", (len(panels) * (SIDE + GAP) - GAP, SIDE), "white")
        for i, (color, options) in enumerate(panels):
            with tempfile.TemporaryDirectory() as folder:
                row.paste(
                    render(args.programs, color, options, Path(folder)), (i * (SIDE + GAP), 0)
                )
        row.save(args.output / f"{name}.jpg", quality=92)


if __name__ == "__main__":
    main()
