"""The same scene for both renderers: a ball on a floor, seen from above."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import OpenImageIO as oiio

REPOSITORY = Path(__file__).resolve().parents[2]
BALL = REPOSITORY / "docs" / "scenes" / "meshes" / "ball.ply"
WIDTH, HEIGHT, SAMPLES = 48, 36, 32
EYE, TARGET, FOV = (2.5, 3.0, 5.0), (0.0, 0.6, 0.0), 38.0
LIGHT_AT, LIGHT_SIZE = (1.5, 4.0, 2.0), 1.5
FLOOR = 3.0  # half of its edge
MAX_DEPTH = 6


@dataclass
class Surface:
    """A material as both renderers call it."""

    ours: dict
    mitsuba: dict


@dataclass
class Pair:
    ball: Surface
    floor: Surface
    environment: bool  # or else a rectangle of light
    brightness: float = 1.0  # of the light
    variant: str = "scalar_rgb"  # of Mitsuba
    files: dict[str, np.ndarray] = field(default_factory=dict)  # images by name


def write_exr(path: Path, pixels: np.ndarray) -> None:
    height, width, channels = pixels.shape
    output = oiio.ImageOutput.create(str(path))
    assert output.open(str(path), oiio.ImageSpec(width, height, channels, "float"))
    output.write_image(np.ascontiguousarray(pixels, dtype=np.float32))
    output.close()


def read_exr(path: Path) -> np.ndarray:
    image = oiio.ImageInput.open(str(path))
    pixels = image.read_image(0, 0, 0, 3, "float")
    image.close()
    return pixels


def sky(rows: np.ndarray) -> np.ndarray:
    """Different on all sides; `rows` are the places of the pixels from the zenith, 0, to 1."""
    v, u = np.meshgrid(rows, (np.arange(512) + 0.5) / 512, indexing="ij")
    up = np.cos(np.pi * v)
    side = np.sin(np.pi * v) * np.cos(2 * np.pi * (u - 0.2))
    tint = np.stack([1 + 0.3 * side, np.ones_like(up), 1 - 0.3 * side], axis=-1)
    return tint * np.exp(1.2 * up + 1.5 * side)[..., None]


def write_files(folder: Path, pair: Pair) -> None:
    # The same light: Mitsuba's first and last rows are the poles, ours end there.
    count = 256
    for name, rows in (
        ("sky.exr", (np.arange(count) + 0.5) / count),
        ("sky-mitsuba.exr", np.arange(count) / (count - 1)),
    ):
        write_exr(folder / name, pair.brightness * sky(rows))
    for name, pixels in pair.files.items():
        write_exr(folder / name, pixels)
    corner = ((-1, 1), (1, 1), (1, -1), (-1, -1))  # seen from above, counter-clockwise
    points = "".join(f"v {FLOOR * x} 0 {FLOOR * z}\n" for x, z in corner)
    uvs = "".join(f"vt {(x + 1) / 2} {(1 - z) / 2}\n" for x, z in corner)
    (folder / "floor.obj").write_text(points + uvs + "f 1/1 2/2 3/3\nf 1/1 3/3 4/4\n")


def our_scene(folder: Path, pair: Pair) -> Path:
    document = {
        "version": 1,
        "render": {"max_depth": MAX_DEPTH, "texture_filter": "none"},
        "camera": {"position": EYE, "look_at": TARGET, "fov": FOV},
        "materials": {"ball": pair.ball.ours, "floor": pair.floor.ours},
        "objects": [
            {"mesh": str(BALL), "material": "ball", "transform": [{"translate": [0, 1, 0]}]},
            {"mesh": "floor.obj", "material": "floor"},
        ],
    }
    if pair.environment:
        document["environment"] = {"file": "sky.exr"}
    else:
        document["lights"] = [
            {
                "position": LIGHT_AT,
                "look_at": TARGET,
                "size": [LIGHT_SIZE, LIGHT_SIZE],
                "radiance": [8 * pair.brightness] * 3,
            }
        ]
    path = folder / "scene.json"
    path.write_text(json.dumps(document))
    return path


def mitsuba_scene(mi, folder: Path, pair: Pair):
    transform = mi.ScalarTransform4f
    if pair.environment:
        light = {"type": "envmap", "filename": str(folder / "sky-mitsuba.exr")}
    else:
        light = {
            "type": "rectangle",
            "to_world": transform().look_at(LIGHT_AT, TARGET, (0, 1, 0))
            @ transform().scale((LIGHT_SIZE / 2, LIGHT_SIZE / 2, 1)),
            "emitter": {
                "type": "area",
                "radiance": {"type": "rgb", "value": [8 * pair.brightness] * 3},
            },
            "surface": {"type": "diffuse", "reflectance": {"type": "rgb", "value": 0.0}},
        }
    film = {
        "type": "hdrfilm",
        "width": WIDTH,
        "height": HEIGHT,
        "rfilter": {"type": "tent"},
        "pixel_format": "rgb",
        "sample_border": True,  # else pixels at the border see less than the filter
    }
    return mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "path", "max_depth": MAX_DEPTH},
            "sensor": {
                "type": "perspective",
                "fov": FOV,
                "fov_axis": "y",
                "to_world": transform().look_at(EYE, TARGET, (0, 1, 0)),
                "film": film,
                "sampler": {"type": "independent", "sample_count": SAMPLES},
            },
            "light": light,
            "ball": {
                "type": "ply",
                "filename": str(BALL),
                "to_world": transform().translate((0, 1, 0)),
                "surface": pair.ball.mitsuba,
            },
            "floor": {
                "type": "obj",
                "filename": str(folder / "floor.obj"),
                "surface": pair.floor.mitsuba,
            },
        }
    )
