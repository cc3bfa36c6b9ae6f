"""Every method in small: it trains, resumes to the same bits, and exports what it trained."""

from __future__ import annotations

import csv
import json
import math
import os
import socket
import subprocess
import sys
from pathlib import Path

import pytest
import torch
from PIL import Image
from small_trainings import PRESETS, SMALL, assert_equal, make_trainer, save_vgg, train

from solidtex_export.commands import export
from solidtex_export.commands import train as cli_train
from solidtex_export.networks.weights import WeightsError
from solidtex_export.training.divergence import TrainError
from solidtex_export.training.presets import PresetError, load_recipe, shipped
from solidtex_export.training.result import ResultError

torch.set_num_threads(1)


def test_every_shipped_preset_is_tested() -> None:
    assert shipped() == sorted(SMALL)


@pytest.mark.parametrize("method", PRESETS)
def test_method_learns_maps_too(method: str, photo: Path, tmp_path: Path) -> None:
    trainer = train(make_trainer([photo], tmp_path / "r", method, "--map", f"wear={photo}"), 2)
    assert trainer.config.channels[3:] == ("wear.r", "wear.g", "wear.b")
    assert trainer.state()["generator"]["color_basis"].shape == (6, 6)


@pytest.mark.parametrize("method", PRESETS)
def test_method_trains_resumes_and_exports(method: str, photo: Path, tmp_path: Path) -> None:
    whole, parts = tmp_path / "whole", tmp_path / "parts"
    uninterrupted = train(make_trainer([photo], whole, method))
    assert uninterrupted.finished
    for step in (2, 3, 4):  # before and after losses start
        resumed = train(make_trainer([photo], parts, method), steps=step)
        assert resumed.step == step
    assert resumed.finished
    assert_equal(resumed.state()["generator"], uninterrupted.state()["generator"])
    with (whole / "log.csv").open() as file:
        (row,) = csv.DictReader(file)
    losses = uninterrupted.recipe.losses
    at_times = {n for n, t in losses.items() if t.start > 0 or t.end < 1}
    at_times |= set(uninterrupted.recipe.discriminators)
    for name, value in row.items():
        assert math.isfinite(float(value)) or name in at_times, name
    assert export.main([str(whole), "-o", str(tmp_path / "m.solidtex")]) == 0


@pytest.mark.parametrize("method", sorted(set(SMALL) - {"gramgan-extrapolate"}))  # needs a space
def test_every_loss_of_a_method_moves_the_generator(
    method: str, photo: Path, tmp_path: Path
) -> None:
    trainer = make_trainer([photo], tmp_path / "r", method, "--set", "slicing.batch=2")
    slices = trainer.slices.draw("x", 32, 2)
    finite = set()
    for progress in (0.0, 1.0):
        gradient, values = trainer.objective.gradient(slices, 0, progress)
        assert list(values) == trainer.objective.names
        finite |= {name for name, value in values.items() if math.isfinite(value)}
        assert gradient.shape == slices.shape and float(gradient.norm()) > 0
    assert finite == set(trainer.objective.names)


@pytest.mark.parametrize("method", ["gutierrez", "sts-gan", "gramgan"])
def test_a_photograph_per_direction(method: str, photo: Path, tmp_path: Path) -> None:
    """Different photographs have critics of their own, and may share one histogram."""
    other = tmp_path / "other.png"
    Image.open(photo).rotate(90, expand=True).resize((64, 56)).save(other)
    share = ("--set", "match_histograms=true")
    trainer = train(make_trainer([photo, other], tmp_path / "r", method, *share))
    assert trainer.finished
    expected = set() if method == "gutierrez" else {"critic"}
    assert [set(found) for found in trainer.discriminators] == [expected] * 2


def test_critics_of_sts_gan_see_their_scales(photo: Path, tmp_path: Path) -> None:
    trainer = make_trainer([photo], tmp_path / "r", "sts-gan")
    trained = trainer.discriminators[0]["critic"]
    assert len(trained.discriminators) == 5
    ramp = torch.arange(40.0).expand(1, 3, 40, 40)
    for scale, fraction in enumerate((0.2, 0.4, 0.6, 0.8, 1.0)):
        view = trained.view(ramp, scale)
        assert view.shape == ramp.shape
        assert float(view.max() - view.min()) == pytest.approx(40 * fraction - 1)
    before = [[p.clone() for p in critic.parameters()] for critic in trained.discriminators]
    train(trainer, steps=1)
    for critic, old in zip(trained.discriminators, before, strict=True):
        assert any(not torch.equal(p, q) for p, q in zip(critic.parameters(), old, strict=True))


def test_oblique_slices_take_their_share_of_steps(photo: Path, tmp_path: Path) -> None:
    share = ("--set", "slicing.oblique_share=0.25")
    trainer = make_trainer([photo], tmp_path / "r", "lattice", *share)
    plan = []
    for trainer.step in range(8):
        plan += trainer._passes()
    assert [oblique for _, oblique in plan] == [False, False, False, True] * 2
    trainer.step = 0
    assert train(trainer).finished  # the last of four steps is oblique
    wood = make_trainer([photo], tmp_path / "w", "lattice", *share, "--directions", "xy")
    assert wood.oblique is not None and wood.oblique.axes == "z"
    one = make_trainer([photo], tmp_path / "o", "lattice", *share, "--directions", "xz")
    assert one.oblique is None


def test_vgg_weights_of_the_users(photo: Path, tmp_path: Path) -> None:
    file = save_vgg(tmp_path / "vgg.pth")
    result = tmp_path / "r"
    options = ("--features", str(file), "--directions", "z")
    trainer = train(make_trainer([photo], result, "babichev", *options), steps=1)
    assert all(math.isfinite(float(p.detach().norm())) for p in trainer.generator.parameters())
    config = json.loads((result / "config.json").read_text())
    assert config["features"]["file"] == "vgg.pth" and len(config["features"]["sha256"]) == 64
    with pytest.raises(WeightsError):
        make_trainer([photo], tmp_path / "b", "babichev", "--features", str(photo))
    assert not (tmp_path / "b").exists()
    with pytest.raises(SystemExit):
        make_trainer([photo], tmp_path / "g", "gramgan", "--features", str(file))
    with pytest.raises(PresetError, match=r"found 4 channels .* expected at most 3"):
        more = ("--map", f"roughness={photo.with_name('gray.png')}")
        Image.open(photo).convert("L").save(photo.with_name("gray.png"))
        make_trainer([photo], tmp_path / "m", "henzler", "--features", str(file), *more)


def test_presets_that_name_vgg_are_read() -> None:
    older = load_recipe("gutierrez", ["losses.descriptor.descriptor=vgg"])
    assert older == load_recipe("gutierrez", [])


def test_a_diverging_training_says_so(photo: Path, tmp_path: Path) -> None:
    wild = ("--set", "optimizer.learning_rate=10", "--set", "optimizer.per_layer_scaling=false")
    trainer = make_trainer([photo], tmp_path / "r", "lattice", *wild, "--steps", "400")
    with pytest.raises(TrainError, match=r"step \d+: .*the training diverges"):
        train(trainer)


TWO_RANKS = """
import os, sys, torch
from pathlib import Path
tests, photo, results = map(Path, sys.argv[1:])
sys.path.insert(0, str(tests))
from small_trainings import make_trainer, train
from solidtex_export.training import ranks

def run(name, steps):
    trainer = make_trainer([photo], results / name, "gramgan")
    train(trainer, steps)
    networks = trainer.generator, trainer.discriminators[0]["critic"].discriminators[0]
    found = results / f"{name}-{steps}-of-{os.environ['RANK']}.pt"
    torch.save([network.state_dict() for network in networks], found)
    return trainer

assert run("whole", 4).finished
assert run("parts", 2).step == 2
assert run("parts", 4).finished
ranks.leave()
threads = [task.joinpath("comm").read_text() for task in Path("/proc/self/task").iterdir()]
assert not [name for name in threads if "gloo" in name], threads
"""


def test_two_processes_train_one_network(photo: Path, tmp_path: Path) -> None:
    """Each draws slices of its own; stopped and resumed they reach the same bits.

    When they leave, no thread of Gloo's is left: one that lets go of its tensors when Python is
    gone aborts the process.
    """
    script = tmp_path / "two_ranks.py"
    script.write_text(TWO_RANKS)
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    shared = {"WORLD_SIZE": "2", "MASTER_ADDR": "127.0.0.1", "MASTER_PORT": str(port)}
    command = [sys.executable, str(script), str(Path(__file__).parent), str(photo), str(tmp_path)]
    processes = [
        subprocess.Popen(
            command,
            env=os.environ | shared | {"RANK": str(rank), "LOCAL_RANK": str(rank)},
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        for rank in range(2)
    ]
    for process in processes:
        output, _ = process.communicate(timeout=300)
        assert process.returncode == 0, output
    for run in ("whole-4", "parts-2", "parts-4"):
        both = [torch.load(tmp_path / f"{run}-of-{r}.pt", weights_only=True) for r in range(2)]
        for first, second in zip(*both, strict=True):
            assert_equal(first, second)
    whole, parts = (
        torch.load(tmp_path / n / "checkpoint.pt", weights_only=True) for n in ("whole", "parts")
    )
    assert_equal(whole["generator"], parts["generator"])
    first, second = (rank["rng"] for rank in whole["ranks"])
    assert not torch.equal(first, second)
    alone = train(make_trainer([photo], tmp_path / "alone", "gramgan"))
    weights = dict(alone.generator.named_parameters())
    assert any(not torch.equal(w, whole["generator"][key]) for key, w in weights.items())
    with pytest.raises(ResultError, match="state of 2 processes, expected 1"):
        make_trainer([photo], tmp_path / "whole", "gramgan")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("mixing =", "found no readable TOML"),
        ("", "generator: found nothing, expected this key"),
        ("[generator]\nkind = 'mesh'", 'generator.kind: found "mesh", expected one of lattice'),
        ("[generator]\nkind = 'lattice'\nspeed = 1", "generator.speed: found an unknown key"),
        ("[optimizer]\nlearning_rate = 'fast'", 'found "fast", expected a number'),
        (
            "[optimizer]\nlearning_rate = -1",
            "optimizer.learning_rate: found -1, expected 1e-09 to 10",
        ),
        ("[optimizer]\nlearning_rate = nan", "optimizer.learning_rate: found NaN, expected a"),
        ("losses = 3", "losses: found 3, expected named tables, such as [losses.gram]"),
        ("[losses.gram]", "losses.gram.layers: found [], expected layer names"),
        ("[losses.spectrum]\nend = 0.4", "expected at least one with start = 0 and end = 1"),
        (
            "[losses.descriptor]\nlayers = ['relu1_1']",
            'losses.descriptor.layers: found ["relu1_1"], expected none: only the kinds gram, auto',
        ),
        (
            "[losses.near]\nkind = 'gram'\nlayers = ['relu1_1', 'relu9_9']",
            'losses.near.layers: found ["relu9_9"], expected some of relu1_1, relu1_2, pool1',
        ),
        ("[losses.gram]\nenabled = false", "expected at least one with start = 0 and end = 1"),
        ("[losses.mine]\nweight = 1", 'losses.mine.kind: found "mine", expected one of'),
        (
            "[losses.spectrum]\nspeed = 1",
            "losses.spectrum.speed: found an unknown key, expected kind",
        ),
        (
            "[losses.spectrum]\nstart = 0.5\nend = 0.4",
            "losses.spectrum.end: found 0.4, expected at least its start, 0.5",
        ),
        ("[[losses]]\nkind = 'gram'", "losses: found an array, expected named tables"),
        ("[losses.spectrum]\nline_length = 3", "losses.spectrum.line_length: found a key of"),
        ("[losses.patches]\nend = 0.4", "losses.patches: found a key of an older version"),
        ("[optimizer]\nbeta_with_critic = 0.5", "beta_with_critic: found a key of an older"),
        ("[early]\nsteps = 9", "early: found a key of an older version, expected none: it made"),
        ("[initial_phase]\nsteps = 9", "initial_phase: found a key of an older version"),
        ("[init]\nsmoothing = 0.5", "init: found a key of an older version"),
        ("extends = 'alchemy'", "extends: found alchemy, expected one of babichev"),
        ("extends = 'my.toml'", "my.toml, expected no circle"),
        ("description = 3", "description: found 3, expected a string"),
        ("extends = 3", "extends: found 3, expected the name of a preset"),
        ("[slicing]\nfree_share = 0.25", "free_share: found 0.25, expected 0 without a loss of"),
        ("[optimizer]\nlearning_rate = 1\nwarmup_steps = -1", "found -1, expected 0 to 1e+06"),
        ("[slicing]\nplanes = 'any'", 'slicing.planes: found "any", expected axes'),
        ("[grain]\nshort_octaves = 2", 'grain: found {"short_octaves": 2, '),
    ],
)
def test_wrong_presets_are_named(text: str, message: str, tmp_path: Path) -> None:
    """Each text changes or replaces tables of a preset that is right."""
    tables = {
        "generator": "[generator]\nkind = 'lattice'",
        "optimizer": "[optimizer]\nlearning_rate = 0.1",
        "losses": "[losses.descriptor]",
    }
    kept = [table for name, table in tables.items() if f"[{name}" not in text]
    kept = [table for table in kept if not (text.startswith("losses =") and "losses" in table)]
    path = tmp_path / "my.toml"
    path.write_text("\n".join([text, *kept] if text else []))
    with pytest.raises(PresetError) as error:
        load_recipe(str(path))
    assert str(error.value).startswith(str(path)) and message in str(error.value)


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ("mixing", "expected KEY.KEY=VALUE"),
        ("a.b=" + 5000 * "[", "--set: found a.b=[[["),
        ("mixing=average", 'mixing: found "average", expected one of sum'),
        ("losses.0.weight=1", "found losses.0.weight=1, expected a loss by its name: descriptor"),
        ("generator.sizes.levels=two", 'lattice: generator.sizes.levels: found "two", expected an'),
        (
            "losses.descriptor.layers=['relu1_1']",
            'descriptor.layers: found ["relu1_1"], expected none',
        ),
        (
            "losses.gram.layers=['relu3_3']",
            "losses.gram.layers: found relu3_3, expected some of relu1",
        ),
        ("generator.sizes.levels=0", "lattice: generator.sizes.levels: found 0, expected 1 to 21"),
        (
            "generator.sizes.step_channels=500",
            "generator.sizes: found 1279884003 weights, expected at most",
        ),
    ],
)
def test_wrong_settings_are_refused(
    setting: str, message: str, photo: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = [str(photo), "-o", str(tmp_path / "r"), "--size", "44", "--set", setting]
    try:
        code: object = cli_train.main(arguments)
    except SystemExit as exit:
        code = exit.code
    assert code in (1, 2) and message in capsys.readouterr().err
    assert not (tmp_path / "r").exists()


@pytest.mark.parametrize(
    ("preset", "size", "message"),
    [
        (
            "lattice",
            "levls=4",
            "levls: found an unknown key, expected levels, noise_channels, step",
        ),
        ("lattice", "levels=22", "levels: found 22, expected 1 to 21"),
        ("lattice", "levels=2.5", "levels: found 2.5, expected an integer"),
        ("lattice", "slope=true", "slope: found true, expected a number"),
        ("lattice", "slope=-0.5", "slope: found -0.5, expected 0 to 1"),
        ("lattice", "noise_channels=0", "noise_channels: found 0, expected 1 to 512"),
        (
            "lattice",
            "step_channels=700",
            "step_channels: found 700, expected 1 to 682 for 6 levels",
        ),
        ("lattice", "out_channels=5", "out_channels: found an unknown key"),
        ("sts-gan", "width=4095", "width: found 4095, expected 1 to 4092 for 4 noise_channels"),
        ("gramgan", "octaves=-16", "octaves: found -16, expected 1 to 256"),
        (
            "gramgan",
            "octaves=15",
            "octaves: found 15, expected a multiple of hidden_layers - 1 = 4",
        ),
        ("sampler", "octaves=65", "octaves: found 65, expected 1 to 64 for 5 hidden_layers with"),
        ("sampler", "noise_at=output", 'noise_at: found "output", expected one of hidden, input'),
    ],
)
def test_wrong_sizes_of_a_generator_are_named(preset: str, size: str, message: str) -> None:
    with pytest.raises(PresetError) as error:
        load_recipe(preset, [f"generator.sizes.{size}"])
    assert str(error.value).startswith(f"{preset}: generator.sizes.{message}")


def test_sizes_are_kept_as_they_are_written() -> None:
    """Older results are resumed by a configuration of the same keys in the same order."""
    sizes = load_recipe("lattice", ["generator.sizes.slope=0"]).generator.sizes
    expected = {"levels": 6, "noise_channels": 3, "step_channels": 4, "slope": 0}
    assert list(sizes.items()) == list(expected.items())
    assert isinstance(sizes["slope"], int)


def test_some_octaves_are_as_long_as_the_grain(
    photo: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = [str(photo), "-o", str(tmp_path / "r"), "--size", "44", "--preset", "sampler"]
    assert cli_train.main([*arguments, "--set", "grain.short_octaves=16"]) == 1
    message = "grain.short_octaves: found 16, expected fewer than all 16 octaves"
    assert message in capsys.readouterr().err
