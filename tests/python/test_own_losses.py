"""Losses and discriminators of one's own."""

from __future__ import annotations

import importlib
import re
from pathlib import Path

import pytest
import torch
from small_trainings import make_trainer, save_photo, train

from solidtex_export.settings import SettingsError
from solidtex_export.training.divergence import TrainError
from solidtex_export.training.presets import PresetError, load_recipe

torch.set_num_threads(1)

OWN = """
import torch
from torch import nn

calls = []


def brightness(slices, crops):
    calls.append((slices.shape, crops.shape))
    return (slices.mean() - crops.mean()).abs()


class Tiny(nn.Module):
    def __init__(self, channels):
        super().__init__()
        self.layer = nn.Conv2d(channels, 1, 3)

    def features(self, images):
        return [self.layer(images)]

    def score(self, features):
        return features[0].mean((1, 2, 3))

    def loss(self, fakes, reals):
        on_fakes, on_reals = (self.score(self.features(i)).mean() for i in (fakes, reals))
        return on_fakes - on_reals + self.layer.weight.square().sum()


number = 3


def three(slices, crops):
    return 3


def each(slices, crops):
    return (slices - crops).abs()


def fixed(slices, crops):
    return slices.detach().mean()


def endless(slices, crops):
    return slices.mean() * float("inf")


class Fixed(Tiny):
    def __init__(self, channels):
        nn.Module.__init__(self)
"""


@pytest.fixture
def photo_beside_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A photograph, in a current folder with losses of one's own."""
    (tmp_path / "mine_for_a_test.py").write_text(OWN)
    monkeypatch.chdir(tmp_path)
    return save_photo(tmp_path / "photo.png")


def test_a_loss_and_a_discriminator_of_ones_own(tmp_path: Path, photo_beside_own: Path) -> None:
    own = [
        "critic.widths=[4,6]",
        "critic.batch=2",
        "losses.mine.kind=mine_for_a_test:brightness",
        "losses.it.kind=mine_for_a_test:Tiny",
    ]
    settings = [part for setting in own for part in ("--set", setting)]
    trainer = make_trainer([photo_beside_own], tmp_path / "own", "gutierrez", *settings)
    (tiny,) = trainer.discriminators[0]["mine_for_a_test:Tiny"].discriminators
    before = [p.clone() for p in tiny.parameters()]
    train(trainer)
    log = (tmp_path / "own" / "log.csv").read_text().splitlines()
    assert {"mine", "it", "mine_for_a_test:Tiny"} <= set(log[0].split(","))
    assert any(not torch.equal(a, b) for a, b in zip(before, tiny.parameters(), strict=True))
    calls = importlib.import_module("mine_for_a_test").calls
    assert calls and all(slices == crops for slices, crops in calls)


def test_a_discriminator_without_parameters_is_refused(
    tmp_path: Path, photo_beside_own: Path
) -> None:
    own = ["--set", "losses.it.kind=mine_for_a_test:Fixed", "--set", "critic.widths=[4,6]"]
    with pytest.raises(SettingsError, match='Fixed", a discriminator without parameters'):
        make_trainer([photo_beside_own], tmp_path / "r", "gutierrez", *own)


def test_a_loss_that_is_not_finite_is_named(tmp_path: Path, photo_beside_own: Path) -> None:
    kind = "losses.mine.kind=mine_for_a_test:endless"
    trainer = make_trainer([photo_beside_own], tmp_path / "r", "gutierrez", "--set", kind)
    with pytest.raises(TrainError, match="step 0: found a gradient of mine that is not finite"):
        train(trainer)


@pytest.mark.parametrize(
    ("kind", "message"),
    [
        ("no_such_module:f", "expected a module and a function in it"),
        ("json:no_such_function", "expected a module and a function in it"),
        ("string:digits", "expected a function or class, not str"),
        ("string:Template", "expected a function, or a class derived from torch.nn.Module"),
        ("torch.nn:Flatten", "expected a class with the methods features, score, loss; features"),
    ],
)
def test_a_loss_that_is_none_is_refused(kind: str, message: str, tmp_path: Path) -> None:
    text = "[generator]\nkind = 'lattice'\n[optimizer]\nlearning_rate = 0.1\n[losses.mine]\n"
    (tmp_path / "my.toml").write_text(f"{text}kind = '{kind}'")
    with pytest.raises(PresetError, match=f'losses.mine.kind: found "{kind}", {message}'):
        load_recipe(str(tmp_path / "my.toml"))


@pytest.mark.parametrize(
    ("function", "what"),
    [
        ("three", "int 3"),
        ("each", "a tensor of shape [1, 3, 32, 32]"),
        ("fixed", "a tensor without a gradient"),
    ],
)
def test_a_loss_that_returns_no_number_of_the_slices_is_named(
    function: str, what: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "mine_for_a_test.py").write_text(OWN)
    monkeypatch.chdir(tmp_path)
    photo = save_photo(tmp_path / "photo.png")
    kind = f"mine_for_a_test:{function}"
    trainer = make_trainer(
        [photo], tmp_path / "r", "gutierrez", "--set", f"losses.mine.kind={kind}"
    )
    message = f'losses.mine.kind: found "{kind}", which returned {what}, expected a tensor of one'
    with pytest.raises(SettingsError, match=re.escape(message)):
        train(trainer)
