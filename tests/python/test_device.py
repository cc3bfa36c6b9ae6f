"""Trainings on another device than the CPU: all that they compute with is there."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
import torch
from pretend_device import CPU, pretend_device
from small_trainings import PRESETS, make_trainer, save_photo, save_specks, save_vgg, train

from solidtex_export.training import ranks

torch.set_num_threads(1)


@pytest.fixture
def device(monkeypatch: pytest.MonkeyPatch) -> Iterator[torch.device]:
    """What trainings take as theirs."""
    with pretend_device() as device:
        monkeypatch.setattr(ranks, "join", lambda use_cuda: (ranks.Ranks(), device))
        yield device


def test_tensors_of_two_devices_do_not_mix(device: torch.device) -> None:
    there, here = torch.ones(3, device=device), torch.ones(3)
    assert there.device == device and here.device == CPU
    assert (there * torch.tensor(2.0)).sum().item() == 6
    with pytest.raises(RuntimeError, match="found tensors on lazy:0 and on cpu"):
        there + here
    assert (there + here.to(device)).device == device
    assert (there.cpu() + here).device == CPU
    assert here.copy_(2 * there).device == CPU and here.tolist() == [2, 2, 2]


@pytest.mark.parametrize("method", PRESETS)
def test_method_trains_there(method: str, tmp_path: Path, device: torch.device) -> None:
    """With a map and a stop in between."""
    photo = save_photo(tmp_path / "photo.png")
    options = ["--map", f"wear={photo}"]
    assert train(make_trainer([photo], tmp_path / "r", method, *options), 3).step == 3
    trainer = train(make_trainer([photo], tmp_path / "r", method, *options))
    assert trainer.finished
    for name, value in trainer.generator.state_dict().items():
        assert value.device == device, name


def test_grain_is_learned_there(tmp_path: Path, device: torch.device) -> None:
    trainer = make_trainer([save_specks(tmp_path / "photo.png")], tmp_path / "r", "lattice")
    assert "spectrum" in trainer.objective.names and train(trainer).finished


def test_photographs_per_direction_train_there(tmp_path: Path, device: torch.device) -> None:
    photo = save_photo(tmp_path / "photo.png")
    share = ("--set", "match_histograms=true")
    for method in ("lattice", "gramgan"):
        assert train(make_trainer([photo, photo], tmp_path / method, method, *share)).finished


def test_vgg_compares_there(tmp_path: Path, device: torch.device) -> None:
    photo, weights = save_photo(tmp_path / "photo.png"), save_vgg(tmp_path / "vgg.pth")
    options = ("--features", str(weights), "--directions", "z")
    assert train(make_trainer([photo], tmp_path / "r", "babichev", *options), 1).step == 1
