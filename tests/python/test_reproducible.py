"""A training on the CPU gives the same bits again, however its threads come and go."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
import torch
from small_trainings import assert_equal, make_trainer, save_photo, train

from solidtex_export.training import trainer


@pytest.fixture
def float32(monkeypatch: pytest.MonkeyPatch) -> None:
    """Rounding to bfloat16 hides most differences of sums."""
    off = torch.autocast("cpu", enabled=False)
    monkeypatch.setattr(trainer, "fast_autocast", lambda _: off)


@pytest.fixture
def two_threads() -> Iterator[None]:
    threads = torch.get_num_threads()
    torch.set_num_threads(2)
    yield
    torch.set_num_threads(threads)


@pytest.mark.usefixtures("float32", "two_threads")
def test_sums_are_made_in_a_fixed_order(tmp_path: Path) -> None:
    photo = save_photo(tmp_path / "photo.png")
    networks = []
    for run in range(4):
        started = make_trainer([photo], tmp_path / str(run), "lattice", "--directions", "xy")
        networks.append(train(started).generator.state_dict())
    for network in networks[1:]:
        assert_equal(networks[0], network)
