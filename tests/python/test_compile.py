"""--compile: the same network and slices, by compiled code."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
import torch
from small_trainings import make_trainer, save_photo, train
from torch._dynamo.utils import counters

ONE_LEVEL = ["--set", "generator.sizes.levels=1"]  # every further one is a minute of compiling

pytestmark = pytest.mark.skipif(shutil.which("g++") is None, reason="torch.compile needs g++")


@pytest.mark.parametrize("method", ["lattice", "sampler"])
def test_compiled_trainings_draw_the_same_slices(
    method: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("TORCHINDUCTOR_CACHE_DIR", str(tmp_path / "cache"))
    photo = save_photo(tmp_path / "photo.png")
    options = ONE_LEVEL if method == "lattice" else []
    plain = make_trainer([photo], tmp_path / "plain", method, *options)
    compiled = make_trainer([photo], tmp_path / "compiled", method, *options, "--compile")
    assert compiled.generator.state_dict().keys() == plain.generator.state_dict().keys()

    drawn = []
    for trainer in (plain, compiled):
        counters.clear()
        trainer.generator.eval()
        torch.manual_seed(1)
        with torch.no_grad():  # gradients are another compilation, which the steps below need
            drawn.append(trainer.slices.draw("x", 32, 1))
    assert counters["stats"]["unique_graphs"] > 0
    torch.testing.assert_close(drawn[1], drawn[0], atol=1e-4, rtol=1e-4)

    before = {key: value.clone() for key, value in compiled.generator.state_dict().items()}
    after = train(compiled, 2).generator.state_dict()
    assert all(value.isfinite().all() for value in after.values())
    assert any(not torch.equal(value, before[key]) for key, value in after.items())
