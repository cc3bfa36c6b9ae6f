"""Makes scenes/studio.exr, the light of the demo scene: a photographer's studio.

A dim gray room with a large soft box on the left, a narrow one on the right behind, and a bright
ceiling. Needs the program oiiotool. Run it from anywhere: python scenes/make_environment.py
"""

from __future__ import annotations

import subprocess
import tempfile
from pathlib import Path

import numpy as np

WIDTH, HEIGHT = 512, 256

Array = np.ndarray


def directions() -> Array:
    """Unit vectors of the pixels, y up, the image's center along +z (docs/scene-format.md)."""
    u = (np.arange(WIDTH) + 0.5) / WIDTH
    v = (np.arange(HEIGHT) + 0.5) / HEIGHT
    longitude, polar = np.meshgrid(2 * np.pi * (0.5 - u), np.pi * v)
    return np.stack(
        [np.sin(polar) * np.sin(longitude), np.cos(polar), np.sin(polar) * np.cos(longitude)], -1
    )


def smooth_step(x: Array, edge: float, width: float) -> Array:
    t = np.clip((x - edge) / width + 0.5, 0, 1)
    return t * t * (3 - 2 * t)


def soft_box(d: Array, toward: list[float], half_size: tuple[float, float]) -> Array:
    """1 inside a rectangle with soft edges on the plane at distance 1 in the given direction."""
    z = np.array(toward) / np.linalg.norm(toward)
    x = np.cross([0.0, 1.0, 0.0], z)
    x /= np.linalg.norm(x)
    y = np.cross(z, x)
    depth = d @ z
    a, b = np.abs(d @ x) / np.maximum(depth, 1e-3), np.abs(d @ y) / np.maximum(depth, 1e-3)
    edge_a = 1 - smooth_step(a, half_size[0], 0.08)
    edge_b = 1 - smooth_step(b, half_size[1], 0.08)
    return np.where(depth > 0, edge_a * edge_b, 0)


def studio() -> Array:
    d = directions()
    height = d[..., 1]
    room = 0.16 + 0.30 * smooth_step(height, 0.35, 1.3)
    light = room[..., None] * np.array([0.92, 0.97, 1.05])
    light += soft_box(d, [-1.0, 0.75, 0.75], (0.42, 0.62))[..., None] * np.array([11.0, 10.0, 8.6])
    light += soft_box(d, [1.0, 0.42, -0.35], (0.13, 0.75))[..., None] * np.array([5.0, 6.0, 7.4])
    light += soft_box(d, [0.9, 0.55, 0.9], (0.3, 0.3))[..., None] * np.array([1.0, 1.05, 1.15])
    return light


def write_exr(path: Path, pixels: Array) -> None:
    """Write an EXR by way of a PFM file, which is plain floats, bottom row first."""
    with tempfile.TemporaryDirectory() as folder:
        pfm = Path(folder) / "image.pfm"
        header = f"PF\n{WIDTH} {HEIGHT}\n-1.0\n".encode()
        pfm.write_bytes(header + pixels[::-1].astype("<f4").tobytes())
        # Without the command line as its history, which would tell this machine's folders.
        command = [
            "oiiotool",
            "--nosoftwareattrib",
            str(pfm),
            "-d",
            "half",
            "--compression",
            "zip",
            "-o",
            str(path),
        ]
        subprocess.run(command, check=True)
    print(f"{path.name}: {path.stat().st_size // 1000} kB")


if __name__ == "__main__":
    write_exr(Path(__file__).parent / "studio.exr", studio())
