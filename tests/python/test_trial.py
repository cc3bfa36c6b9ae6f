"""Trials of several starts, before a training."""

from __future__ import annotations

import json
import signal
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from PIL import Image

from solidtex_export.commands import train as command
from solidtex_export.training import trial
from solidtex_export.training.config import Config
from solidtex_export.training.method_file import load_method
from solidtex_export.training.trainer import Trainer

torch.set_num_threads(1)
SMALL_STEPS = {"smoothing": 0.5, "fine_noise": 0.2, "early": False}
LARGE_STEPS = SMALL_STEPS | {"early": True}


@pytest.fixture
def photo(tmp_path: Path) -> Path:
    pixels = np.random.default_rng(1).integers(0, 255, (48, 56, 3))
    path = tmp_path / "photo.png"
    Image.fromarray(pixels.astype(np.uint8)).save(path)
    return path


def arguments(photo: Path, result: Path, *more: str) -> list[str]:
    small = ("--size", "44", "--resolution", "48", "--device", "cpu", "--set", "trial.steps=2")
    return [str(photo), "-o", str(result), *small, *more]


def make_trainer(*args: Any) -> Trainer:
    p = command.parser()
    parsed = p.parse_args(arguments(*args))
    command.check(p, parsed)
    return command.make_trainer(parsed)


def test_what_is_found_is_written_down(photo: Path, tmp_path: Path) -> None:
    assert command.main(arguments(photo, tmp_path / "r", "--steps", "8")) == 0
    record = json.loads((tmp_path / "r" / "config.json").read_text())["trial"]
    small, large = record["distances"]
    assert record["start"] == (SMALL_STEPS if small <= 4.2 * large else LARGE_STEPS)
    assert record["seconds"] == 0  # steps are counted, not time


@pytest.mark.parametrize("start", [SMALL_STEPS, LARGE_STEPS])
def test_after_a_trial_training_is_as_without(
    photo: Path, tmp_path: Path, start: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whichever start it takes: small steps up to 4.2 times the other's distance. A second call
    resumes without a trial."""
    far = 4.1 if start == SMALL_STEPS else 4.3
    monkeypatch.setattr(trial, "distance", lambda t: 1.0 if t.config.start.early else far)
    trained = make_trainer(photo, tmp_path / "r", "--steps", "8")
    assert trained.config.trial is not None and trained.config.trial["start"] == start
    monkeypatch.setattr(trial, "choose_start", None)
    assert make_trainer(photo, tmp_path / "r", "--steps", "8").config == trained.config
    named = [f"--set=start.{key}={json.dumps(value)}" for key, value in start.items()]
    other = make_trainer(photo, tmp_path / "o", "--steps", "8", "--set", "trial.starts=[]", *named)
    for key, value in other.state()["generator"].items():
        assert torch.equal(value, trained.state()["generator"][key]), key


def test_short_trainings_have_none(
    photo: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(trial, "choose_start", None)
    for index, length in enumerate((("--steps", "7"), ("--minutes", "9"))):
        trainer = make_trainer(photo, tmp_path / str(index), *length)
        assert trainer.config.trial is None
        assert trainer.config.start.smoothing == 0 and trainer.config.early.steps > 0


def test_the_time_of_a_trial_is_part_of_the_minutes(photo: Path, tmp_path: Path) -> None:
    trainer = make_trainer(photo, tmp_path / "r", "--minutes", "10")
    config: Config = trainer.config
    assert config.trial is not None and config.time_limit == 600 - config.trial["seconds"]
    trainer.seconds = config.time_limit / 2
    assert trainer.progress == pytest.approx(0.5)


def test_ctrl_c_in_a_trial_leaves_nothing(
    photo: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    step = Trainer._train_step

    def interrupted(self: Trainer) -> dict[str, float]:
        signal.raise_signal(signal.SIGINT)
        return step(self)

    monkeypatch.setattr(Trainer, "_train_step", interrupted)
    assert command.main(arguments(photo, tmp_path / "r", "--steps", "8")) == 130
    assert "the same command starts again" in capsys.readouterr().out
    assert not (tmp_path / "r").exists()


def test_all_that_judge_a_start_train_it_from_the_beginning() -> None:
    joined = {term.kind: term.start for term in trial.judging(load_method("lattice").losses)}
    late = {kind for kind, start in joined.items() if start > 0}
    assert joined.keys() >= {"descriptor", "wavelets", "tones"}
    assert late == {"style", "adversarial"}


def test_judges_see_a_solid_that_is_farther_from_the_photograph(
    photo: Path, tmp_path: Path
) -> None:
    """And the same one twice alike."""
    joined = ("--set", "losses.2.start=0")  # tones, as in a trial
    trainer = make_trainer(photo, tmp_path / "r", "--steps", "4", *joined)
    trainer.run(lambda: False, lambda t: None)
    near = trial.distance(trainer)
    assert trial.distance(trainer) == near
    with torch.no_grad():
        trainer.generator.get_parameter("last_conv.bias").add_(3.0)
    assert trial.distance(trainer) > 2 * near
