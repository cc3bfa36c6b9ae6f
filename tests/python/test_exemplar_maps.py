"""The maps of our own: cut from a solid, registered, written as documented."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from solidtex_export import exemplar_maps
from solidtex_export.training.exemplar import load_exemplar


def test_the_material_is_a_function_of_a_point() -> None:
    points = np.random.default_rng(1).uniform(-50, 50, (60, 3))
    whole = exemplar_maps.rusted_paint(points)
    part = exemplar_maps.rusted_paint(points[20:30])
    for a, b in ((whole.albedo, part.albedo), (whole.height, part.height)):
        assert np.array_equal(a[20:30], b)
        assert 0 <= a.min() < a.max() <= 1
    other = exemplar_maps.rusted_paint(points, seed=1)
    assert np.abs(other.roughness - whole.roughness).max() > 0.1


def test_channels_share_their_edges() -> None:
    """Rust is red, rough and low, paint is blue, smooth and high, everywhere."""
    surface = exemplar_maps.cut(48)
    rust = surface.albedo[..., 0] > 1.5 * surface.albedo[..., 2]
    assert 0.1 < rust.mean() < 0.9
    assert ((surface.roughness > 0.6) == rust).mean() > 0.9
    assert surface.height[rust].mean() < surface.height[~rust].mean() - 0.15


def test_written_maps_are_what_training_reads(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    command = ["-o", str(tmp_path / "maps"), "--size", "48"]
    assert exemplar_maps.main(command) == 0
    maps = {name: tmp_path / "maps" / f"{name}.png" for name in ("roughness", "height")}
    exemplar = load_exemplar(tmp_path / "maps" / "albedo.png", 48, 48, maps=maps)
    surface = exemplar_maps.cut(48)
    assert np.abs(exemplar.image[3].numpy() - surface.roughness).max() < 1e-4
    assert np.abs(exemplar.image[4].numpy() - surface.height).max() < 1e-4
    with Image.open(maps["height"]) as height:
        assert height.mode == "I;16"
    assert exemplar_maps.main(command) == 1
    assert "albedo.png: found an existing file, expected none" in capsys.readouterr().err
