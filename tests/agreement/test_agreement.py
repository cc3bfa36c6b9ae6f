"""Images equal those of Mitsuba 3 within noise. The comparison detects small differences."""

import os
import subprocess
from pathlib import Path

import numpy as np
import pytest
import rough_coat
from image_test import compare
from scene_pairs import (
    FLOOR,
    HEIGHT,
    REPOSITORY,
    SAMPLES,
    WIDTH,
    Pair,
    Surface,
    mitsuba_scene,
    our_scene,
    read_exr,
    write_files,
)

from solidtex import Texture

mitsuba = pytest.importorskip("mitsuba", reason="the Python package mitsuba is not installed")

RENDER = Path(os.environ["SOLIDTEX_BUILD"]) / "bin" / "solidtex-render"
RENDERS = 8  # of each, independent
LEVEL = 1e-3  # of a false alarm; the renders are always the same, so that it is not one by chance
BRIGHTER = 1.03


def diffuse(color: list[float]) -> Surface:
    reflectance = {"type": "rgb", "value": color}
    return Surface(
        {"type": "diffuse", "color": color},
        {"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": reflectance}},
    )


def coated(color: list[float]) -> Surface:
    """Mitsuba's smooth plastic is the limit of our coat for low roughness: the same Fresnel term,
    the same series of inner bounces. (Its rough plastic has separable masking, ours is correlated
    in height: at the silhouette of a ball they differ by several percent, as models do.)
    """
    return Surface(
        {"type": "coated", "color": color, "roughness": 0.03, "ior": 1.5},
        {
            "type": "plastic",
            "int_ior": 1.5,
            "ext_ior": 1.0,
            "nonlinear": True,
            "diffuse_reflectance": {"type": "rgb", "value": color},
        },
    )


def rough(color: list[float]) -> Surface:
    """No material of Mitsuba is our coat where it is rough: tests/agreement/rough_coat.py is."""
    rgb = dict(zip(("red", "green", "blue"), color, strict=True))
    return Surface(
        {"type": "coated", "color": color, "roughness": 0.45, "ior": 1.5},
        {"type": "roughcoat", "roughness": 0.45, "ior": 1.5, **rgb},
    )


def of_coats(ball: Surface, environment: bool) -> Pair:
    """With a material in Python, which is fast in a vectorized variant."""
    return Pair(ball, GRAY, environment, variant="llvm_ad_rgb")


GRAY, RED = diffuse([0.5, 0.5, 0.5]), diffuse([0.7, 0.3, 0.2])


def baked_floor() -> tuple[Surface, dict[str, np.ndarray]]:
    """A slice of a solid texture, for Mitsuba as an image of eight pixels a texel."""
    texels, size = 48, 384
    scale = texels / (2 * FLOOR)
    row = (np.arange(size) + 0.5) / size
    u, v = np.meshgrid(row, 1 - row)  # the image's top is v = 1
    x, z = FLOOR * (2 * u - 1), FLOOR * (1 - 2 * v)
    points = scale * np.stack([x, np.zeros_like(x), z], axis=-1).reshape(-1, 3)
    with Texture(str(REPOSITORY / "models" / "granite-beige.solidtex")) as texture:
        encoded = np.clip(texture.eval_points(points), 0, 1).reshape(size, size, -1)
    light = np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)
    color = {"solid": "granite-beige", "texels_per_unit": scale}
    image = {"type": "bitmap", "filename": "floor.exr", "raw": True}
    return (
        Surface({"type": "diffuse", "color": color}, {"type": "diffuse", "reflectance": image}),
        {"floor.exr": light},
    )


def pairs() -> dict[str, Pair]:
    stone, files = baked_floor()
    return {
        "diffuse-environment": Pair(RED, GRAY, environment=True),
        "diffuse-rectangle": Pair(RED, GRAY, environment=False),
        "coated-environment": Pair(coated([0.6, 0.3, 0.1]), GRAY, environment=True),
        "coated-rectangle": Pair(coated([0.1, 0.3, 0.6]), GRAY, environment=False),
        "rough-environment": of_coats(rough([0.6, 0.3, 0.1]), environment=True),
        "rough-rectangle": of_coats(rough([0.1, 0.3, 0.6]), environment=False),
        "solid-environment": Pair(RED, stone, environment=True, files=files),
    }


NAMES = [
    "diffuse-environment",
    "diffuse-rectangle",
    "coated-environment",
    "coated-rectangle",
    "rough-environment",
    "rough-rectangle",
    "solid-environment",
]


@pytest.fixture(scope="module")
def all_pairs() -> dict[str, Pair]:
    mitsuba.set_variant("scalar_rgb")
    return pairs()


def our_renders(folder: Path, pair: Pair) -> np.ndarray:
    write_files(folder, pair)
    scene, output = our_scene(folder, pair), folder / "ours.exr"
    options = ["--size", f"{WIDTH},{HEIGHT}", "--spp", str(SAMPLES), "--quiet", "--force"]
    images = []
    for seed in range(RENDERS):
        command = [RENDER, scene, *options, "--seed", str(seed), "-o", output]
        subprocess.run(command, check=True)
        images.append(read_exr(output))
    return np.stack(images)


def mitsuba_renders(folder: Path, pair: Pair) -> np.ndarray:
    mitsuba.set_variant(pair.variant)
    if pair.ball.mitsuba["type"] == "roughcoat":
        rough_coat.register(mitsuba, pytest.importorskip("drjit"))
    write_files(folder, pair)
    texture = pair.floor.mitsuba.get("reflectance", {})
    if "filename" in texture:
        texture["filename"] = str(folder / "floor.exr")
    scene = mitsuba_scene(mitsuba, folder, pair)
    return np.stack(
        [np.array(mitsuba.render(scene, seed=seed, spp=SAMPLES)) for seed in range(RENDERS)]
    )


@pytest.mark.parametrize("name", NAMES)
def test_the_image_is_that_of_mitsuba(name: str, all_pairs: dict, tmp_path: Path) -> None:
    pair = all_pairs[name]
    theirs = mitsuba_renders(tmp_path, pair)
    verdict = compare(our_renders(tmp_path, pair), theirs)
    print(f"\n{name}: {verdict}")
    assert verdict.p_value > LEVEL

    # The same test sees three percent.
    pair.brightness = BRIGHTER
    brighter = compare(our_renders(tmp_path, pair), theirs)
    pair.brightness = 1.0
    assert brighter.p_value < LEVEL


def test_equal_noise_passes_and_a_wrong_block_does_not() -> None:
    rng = np.random.default_rng(5)
    shape = (RENDERS, HEIGHT, WIDTH, 3)
    p_values = []
    for _ in range(40):
        first, second = rng.gamma(0.5, size=shape), rng.gamma(0.5, size=shape)
        p_values.append(compare(first, second).p_value)
    assert min(p_values) > LEVEL
    second[:, 6:12, 6:12] += 0.8  # one block of 48
    assert compare(first, second).p_value < LEVEL
