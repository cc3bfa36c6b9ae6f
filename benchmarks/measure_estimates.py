"""Accuracy of the maps of solidtex-train --estimate (docs/experiments/estimated-maps.md):

    python benchmarks/measure_estimates.py

Cuts of analytic solids have a true color, height and roughness. Each is estimated from the color
alone, and from renderings: gray and in color, under light from above and from a side, with
highlights. Prints Pearson's correlation with the true map, over seeds: mean, lowest, highest.
"""

import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from scipy import ndimage

from solidtex_export.commands import solids
from solidtex_export.images.channels import map_channels, photo_channels
from solidtex_export.images.estimates import METHODS
from solidtex_export.images.photographs import read_picture
from solidtex_export.images.srgb import srgb_decode, srgb_encode

SOLIDS, SEEDS, SIZE = ("grains", "paint"), range(4), 384
RELIEF = 6.0  # texels where the height is 1
GRAY = 0.6
LIGHTS = {"above": (0.0, 0.0, 1.0), "side": (1.0, 0.6, 0.9)}
AMBIENT, DIRECT, SPECULAR = 0.5, 0.7, 0.04
OCCLUSION, OCCLUSION_SIGMA = 0.25, 6.0


def rendered(
    color: np.ndarray, height: np.ndarray, roughness: np.ndarray, light: tuple[float, ...]
) -> np.ndarray:
    """A photograph of a relief: Lambert and a GGX lobe seen from above, darker in cavities."""
    relief = RELIEF * height
    dy, dx = np.gradient(relief)
    normal = np.dstack([-dx, -dy, np.ones_like(relief)])
    normal /= np.linalg.norm(normal, axis=2, keepdims=True)
    to_light = np.array(light) / np.linalg.norm(light)
    half = to_light + np.array([0, 0, 1])
    half /= np.linalg.norm(half)
    depth = ndimage.gaussian_filter(relief, OCCLUSION_SIGMA) - relief
    ambient = AMBIENT * (1 - OCCLUSION * depth).clip(0.3, 1.2)
    diffuse = DIRECT * (normal @ to_light).clip(0) + ambient
    alpha2 = roughness.clip(0.1, 1) ** 4
    lobe = alpha2 / np.pi / ((normal @ half).clip(0, 1) ** 2 * (alpha2 - 1) + 1) ** 2
    linear = srgb_decode(color) * diffuse[..., None] + SPECULAR * lobe.clip(0, 20)[..., None]
    return srgb_encode((0.9 * linear).clip(0, 1).astype(np.float32))


def cuts(solid: str, seed: int) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Color [row, column, 3] and true maps of a cut."""
    with tempfile.TemporaryDirectory() as folder:
        solids.main([solid, "-o", folder, "--seed", str(seed), "--size", str(SIZE), "--quiet"])
        channels = photo_channels(read_picture(Path(folder, f"{solid}.png")), "srgb").channels
        maps = {}
        for name in METHODS:
            picture = read_picture(Path(folder, f"{solid}-{name}.png"))
            maps[name] = map_channels(name, picture).channels[name]
    return np.stack(list(channels.values()), axis=-1), maps


def pictures(color: np.ndarray, maps: dict[str, np.ndarray]) -> Iterator[tuple[str, np.ndarray]]:
    yield "color alone", color
    for name, light in LIGHTS.items():
        yield f"color, light from {name}", rendered(color, **maps, light=light)
    for name, light in LIGHTS.items():
        yield f"gray, light from {name}", rendered(np.full_like(color, GRAY), **maps, light=light)


def main() -> None:
    print(f"| solid | picture | {' | '.join(METHODS)} |\n|---|---|{'---|' * len(METHODS)}")
    for solid in SOLIDS:
        found: dict[str, dict[str, list[float]]] = {}
        for seed in SEEDS:
            color, maps = cuts(solid, seed)
            for label, picture in pictures(color, maps):
                for name, method in METHODS.items():
                    r = np.corrcoef(method(picture).ravel(), maps[name].ravel())[0, 1]
                    found.setdefault(label, {}).setdefault(name, []).append(r)
        for label, columns in found.items():
            cells = (f"{np.mean(r):.2f} ({min(r):.2f} to {max(r):.2f})" for r in columns.values())
            print(f"| {solid} | {label} | {' | '.join(cells)} |")


if __name__ == "__main__":
    main()
