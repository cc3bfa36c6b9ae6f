"""Exemplar maps of our own: rusted paint with albedo, roughness and height that belong together.

The material is a function of a point in space: paint where a warped noise lies below a threshold,
rust elsewhere, and along the border a lip where the paint has lifted. All channels are computed
from these same fields, so an edge lies at the same texel in each. The maps are its cut at z = 0.

    python -m solidtex_export.exemplar_maps -o maps
    solidtex-train maps/albedo.png --map roughness=maps/roughness.png --map height=maps/height.png

The maps are dedicated to the public domain (CC0-1.0).
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import dataclass
from itertools import product
from pathlib import Path

import numpy as np
from PIL import Image

from solidtex_export import cli
from solidtex_export.training.channels import srgb_encode
from solidtex_export.verification import noise
from solidtex_export.verification.model_output import OutputError

Array = np.ndarray

PAINT, FADED = (0.075, 0.25, 0.265), (0.16, 0.36, 0.345)  # linear colours
RUST = ((0.055, 0.02, 0.012), (0.23, 0.062, 0.018), (0.46, 0.17, 0.045))  # dark to bright
FILES = ("albedo.png", "roughness.png", "height.png")
SUBPIXELS = 2  # per axis


@dataclass(frozen=True)
class Surface:
    """The channels at some points: albedo [..., 3] is linear, all values are in 0 ... 1."""

    albedo: Array
    roughness: Array
    height: Array


def rusted_paint(points: Array, seed: int = 0) -> Surface:
    """The material at points [..., 3], in texels."""
    fields = Noise(seed)
    warped = points + 4 * np.stack([fields.sum(points / 10, 2) for _ in range(3)], axis=-1)
    decay = fields.sum(warped / 17, 4)
    paint = smooth_step(0.11, 0.03, decay)  # 1 under sound paint, 0 on bare rust
    lip = np.exp(-((decay / 0.045) ** 2))  # the paint's lifted border
    stain = smooth_step(-0.35, 0.02, decay)  # rust that creeps below the paint
    bumps = fields.sum(points / 4, 3)
    patches = fields.sum(points / 11, 3)
    wear = fields.sum(points / 22, 2)

    rust_tone = np.clip(0.42 + 0.75 * patches + 0.55 * bumps, 0, 1)
    rust = ramp(RUST, rust_tone)
    coat = ramp((PAINT, FADED), np.clip(0.5 + 0.9 * wear + 0.12 * bumps, 0, 1))
    coat = mix(coat, np.array(RUST[1]), 0.6 * stain * np.clip(0.4 + patches, 0, 1))
    return Surface(
        mix(rust, coat, paint),
        np.clip(mix(0.82 + 0.14 * bumps, 0.3 + 0.16 * wear + 0.2 * stain, paint), 0.05, 1),
        np.clip(
            mix(0.3 + 0.22 * bumps + 0.1 * patches, 0.6 + 0.05 * wear, paint) + 0.2 * lip, 0, 1
        ),
    )


class Noise:
    """Gradient noise (Perlin 1985) on the lattice noise of the engine; each call is a new one."""

    def __init__(self, seed: int) -> None:
        self.seed = seed
        self.calls = 0

    def sum(self, points: Array, octaves: int) -> Array:
        """Octaves of halved amplitude and wavelength; most values lie in -0.5 ... 0.5."""
        return sum(0.5**i * self.octave(2**i * points) for i in range(octaves))

    def octave(self, points: Array) -> Array:
        self.calls += 1
        turn = np.random.default_rng((self.seed, self.calls))
        rotation, _ = np.linalg.qr(turn.normal(size=(3, 3)))  # hides the directions of the lattice
        points = points @ rotation + 100 * turn.random(3)
        cell = np.floor(points)
        inside = points - cell
        fade = inside**3 * (inside * (6 * inside - 15) + 10)
        total = np.zeros(points.shape[:-1])
        for corner in product((0, 1), repeat=3):
            weight = np.prod(np.where(corner, fade, 1 - fade), axis=-1)
            total += weight * self._slope(cell + corner, inside - corner)
        return total

    def _slope(self, cell: Array, offset: Array) -> Array:
        """The linear function of one lattice point: a random gradient, 0 at the point itself."""
        position = [cell[..., axis].astype(np.int64) for axis in range(3)]
        gradients = (
            noise.normal("solidtex-1", self.seed, self.calls, axis, *position) for axis in range(3)
        )
        return sum(g * offset[..., axis] for axis, g in enumerate(gradients)) / np.sqrt(3)


def smooth_step(start: float, end: float, x: Array) -> Array:
    """0 at `start`, 1 at `end`, which may be the smaller one."""
    t = np.clip((x - start) / (end - start), 0, 1)
    return t * t * (3 - 2 * t)


def mix(a: Array, b: Array, t: Array) -> Array:
    t = t if np.ndim(a) == np.ndim(t) else t[..., None]
    return a + t * (b - a)


def ramp(colors: tuple[tuple[float, ...], ...], t: Array) -> Array:
    """Piecewise linear colours [..., 3] for t in 0 ... 1."""
    at = np.linspace(0, 1, len(colors))
    return np.stack([np.interp(t, at, channel) for channel in np.transpose(colors)], axis=-1)


def cut(size: int, seed: int = 0) -> Surface:
    """Channels [row, column] of the plane z = 0, y upwards, one texel a pixel, box-filtered."""
    steps = (np.arange(size * SUBPIXELS) + 0.5) / SUBPIXELS
    y, x = np.meshgrid(size - steps, steps, indexing="ij")
    surface = rusted_paint(np.stack([x, y, np.zeros_like(x)], axis=-1), seed)

    def filtered(values: Array) -> Array:
        cells = values.reshape(size, SUBPIXELS, size, SUBPIXELS, -1)
        return cells.mean(axis=(1, 3)).squeeze()

    return Surface(*(filtered(v) for v in (surface.albedo, surface.roughness, surface.height)))


def write_maps(folder: Path, surface: Surface) -> None:
    """albedo.png (sRGB, 8 bits), roughness.png and height.png (data, 16 bits)."""
    folder.mkdir(parents=True, exist_ok=True)
    encoded = np.round(255 * srgb_encode(surface.albedo)).astype(np.uint8)
    Image.fromarray(encoded).save(folder / "albedo.png")
    for name in ("roughness", "height"):
        values = np.round(65535 * getattr(surface, name)).astype(np.uint16)
        Image.fromarray(values).save(folder / f"{name}.png")


def main(arguments: list[str] | None = None) -> int:
    p = cli.parser(
        "python -m solidtex_export.exemplar_maps",
        "Write albedo.png, roughness.png and height.png of rusted paint, a procedural solid.",
        "  python -m solidtex_export.exemplar_maps -o maps --size 256",
    )
    p.add_argument("-o", dest="folder", metavar="FOLDER", type=Path, required=True)
    p.add_argument("--size", type=int, default=256, metavar="N", help="side in pixels (256)")
    p.add_argument("--seed", type=int, default=0, metavar="S", help="(default: 0)")
    p.add_argument("--force", action="store_true", help="replace maps that exist")
    return cli.run(p, arguments, write)


def write(args: argparse.Namespace) -> None:
    for name in FILES:
        if (path := args.folder / name).exists() and not args.force:
            raise OutputError(
                f"{path}: found an existing file, expected none (--force replaces it)"
            )
    write_maps(args.folder, cut(args.size, args.seed))


if __name__ == "__main__":
    sys.exit(main())
