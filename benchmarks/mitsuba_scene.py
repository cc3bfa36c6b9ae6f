"""Scene of the renderer's measurements: a million triangles under studio light."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
from PIL import Image

REPOSITORY = Path(__file__).resolve().parents[1]
ENVIRONMENT = REPOSITORY / "scenes" / "studio.exr"
EYE, TARGET, FOV = (1.5, 1.2, 3.2), (0.0, 0.0, 0.0), 38.0
MAX_DEPTH = 8  # of a path, in segments
ROULETTE_DEPTH = 4

sys.path.insert(0, str(REPOSITORY / "scenes"))


def write_mesh(path: Path, triangles: int) -> int:
    """Write a ball with waves of several sizes, normals and texture coordinates as PLY."""
    from solids import closed_normals, grid

    rows = round(np.sqrt(triangles / 4)) + 1
    columns = 2 * (rows - 1)
    polar, angle = np.meshgrid(
        np.linspace(0, np.pi, rows), np.linspace(0, 2 * np.pi, columns + 1), indexing="ij"
    )
    wave = sum(np.sin(k * polar) ** 2 * np.sin(k * angle) / k for k in (3, 8, 21, 55))
    radius = 1 + 0.15 * wave
    ring = np.sin(polar)
    positions = radius[..., None] * np.stack(
        [ring * np.cos(angle), np.cos(polar), ring * np.sin(angle)], axis=-1
    )
    positions[[0, -1], :, 0] = positions[[0, -1], :, 2] = 0
    positions[:, -1] = positions[:, 0]
    normals = closed_normals(positions)
    normals[0], normals[-1] = (0, -1, 0), (0, 1, 0)
    mesh = grid(positions, -normals)
    uv = np.stack([angle / (2 * np.pi), 1 - polar / np.pi], axis=-1).reshape(-1, 2)
    vertices = np.concatenate([mesh.positions, mesh.normals, uv], axis=1).astype("<f4")
    faces = np.empty(len(mesh.triangles), dtype=[("count", "u1"), ("index", "<i4", 3)])
    faces["count"], faces["index"] = 3, mesh.triangles
    names = ("x", "y", "z", "nx", "ny", "nz", "s", "t")
    header = (
        f"ply\nformat binary_little_endian 1.0\nelement vertex {len(vertices)}\n"
        + "".join(f"property float {name}\n" for name in names)
        + f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    path.write_bytes(header.encode() + vertices.tobytes() + faces.tobytes())
    return len(faces)


def write_image(path: Path, size: int = 1024) -> None:
    """Write an image of tiles with grain."""
    rng = np.random.default_rng(1)
    x, y = np.meshgrid(np.arange(size), np.arange(size))
    tiles = 0.35 + 0.3 * (((x // 64) + (y // 64)) % 2)
    grain = rng.normal(0, 0.05, (size, size, 3)) + tiles[..., None] * (1, 0.9, 0.8)
    Image.fromarray((255 * np.clip(grain, 0, 1)).astype(np.uint8)).save(path)


def scene_file(folder: Path, color: object, kind: str = "diffuse", frames: int = 1) -> Path:
    """Scene for solidtex-render with any color of the scene format; all frames are equal."""
    document: dict[str, object] = {
        "version": 1,
        "render": {"max_depth": MAX_DEPTH},
        "camera": {"position": EYE, "look_at": TARGET, "fov": FOV},
        "materials": {"surface": {"type": kind, "color": color}},
        "objects": [{"mesh": "mesh.ply", "material": "surface"}],
        "environment": {"file": str(ENVIRONMENT)},
    }
    if frames > 1:
        document["animation"] = {"frames": frames, "tracks": {"/camera/fov": {"0": FOV}}}
    path = folder / "scene.json"
    path.write_text(json.dumps(document))
    return path


def mitsuba_scene(mi, folder: Path, size: int, samples: int):
    """The same scene for the current variant of Mitsuba."""
    film = {
        "type": "hdrfilm",
        "width": size,
        "height": size,
        "rfilter": {"type": "box"},
        "pixel_format": "rgb",
    }
    return mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "path", "max_depth": MAX_DEPTH, "rr_depth": ROULETTE_DEPTH},
            "sensor": {
                "type": "perspective",
                "fov": FOV,
                "fov_axis": "y",
                "to_world": mi.ScalarTransform4f().look_at(EYE, TARGET, (0, 1, 0)),
                "film": film,
                "sampler": {"type": "independent", "sample_count": samples},
            },
            "light": {"type": "envmap", "filename": str(ENVIRONMENT)},
            "mesh": {
                "type": "ply",
                "filename": str(folder / "mesh.ply"),
                "surface": {
                    "type": "twosided",
                    "bsdf": {
                        "type": "diffuse",
                        "reflectance": {"type": "bitmap", "filename": str(folder / "image.png")},
                    },
                },
            },
        }
    )
