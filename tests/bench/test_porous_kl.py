"""benchmarks/porous_kl.py: divergences of known samples, figures of a slab."""

from pathlib import Path

import numpy as np
import porous_kl
import pytest

from solidtex_export.export import random_models
from solidtex_export.export.file_format import model_file
from solidtex_export.export.verification import engine


def test_equal_samples_do_not_diverge() -> None:
    samples = np.random.default_rng(0).normal(5, 2, 500)
    assert porous_kl.divergence(samples, samples) == 0
    assert porous_kl.divergence(samples, samples[::-1]) == 0


def test_samples_without_a_common_bin_diverge_by_much() -> None:
    rng = np.random.default_rng(0)
    first, second = rng.uniform(0, 1, 500), rng.uniform(9, 10, 500)
    near = rng.uniform(0.1, 1.1, 500)
    assert porous_kl.divergence(first, second) > 5
    assert 0 < porous_kl.divergence(first, near) < 1
    value, deviation = porous_kl.resampled(first, second)
    assert value == porous_kl.divergence(first, second)
    assert 0 < deviation < 0.2 * value


def test_figures_of_a_slab() -> None:
    side, thickness = 32, 6  # two_point_16 needs 32
    slab = np.zeros((side,) * 3, bool)
    slab[7 : 7 + thickness] = True
    found = porous_kl.figures(slab, with_permeability=False)
    assert found["volume"] == thickness * side**2
    assert found["surface"] == pytest.approx(2 * side**2, rel=0.1)  # two walls
    assert found["euler"] == 1
    assert found["mean_breadth"] == pytest.approx((thickness + 2 * side) / 3)
    assert found["mean_chord_x"] == thickness
    assert found["mean_chord_y"] == found["mean_chord_z"] == 0  # all are cut by the border
    assert found["two_point_1"] == pytest.approx(
        np.mean([(thickness - 1) / (side - 1)] + [thickness / side] * 2)
    )
    assert "permeability" not in found


def test_crops_are_parts_of_the_volume() -> None:
    volume = np.random.default_rng(0).random((12, 13, 14)) < 0.5
    crops = porous_kl.random_crops(volume, 10, 5, seed=1)
    again = porous_kl.random_crops(volume, 10, 5, seed=1)
    windows = np.lib.stride_tricks.sliding_window_view(volume, (10, 10, 10))
    for crop, same in zip(crops, again, strict=True):
        assert np.array_equal(crop, same)
        assert (windows == crop).all((3, 4, 5)).any()


def test_pores_of_a_model_are_its_phase_0(tmp_path: Path) -> None:
    noise = {"name": "z", "op": "noise", "level": 0, "channels": 2, "distribution": "normal"}
    nodes = [noise, {"name": "p", "op": "softmax", "inputs": ["z"]}]
    document = random_models.document("field", {"nodes": nodes, "output": "p"})
    document |= {"channels": ["phase.0", "phase.1"], "color_space": "data"}
    model_file.write(tmp_path / "m.solidtex", model_file.ModelFile(document, {}))
    first, second = porous_kl.pore_of_samples(tmp_path / "m.solidtex", 8, 2)
    assert not np.array_equal(first, second)
    for i, pore in enumerate((first, second)):
        with engine.open_model(tmp_path / "m.solidtex", 0) as texture:
            values = np.asarray(texture.eval_box((porous_kl.DISTANCE * i, 0, 0), (8, 8, 8)))
        assert np.array_equal(pore, values.argmax(3) == 0)
