"""Trainings that start from a texture space or from a learned start."""

from __future__ import annotations

import json
import shutil
import sys
from pathlib import Path

import numpy as np
import pytest
import torch
from PIL import Image
from small_spaces import begin as begin_space
from small_spaces import run, save_photos, save_preset
from small_trainings import assert_equal, begin, train

from solidtex_export.commands import export, export_space, train_options, train_space
from solidtex_export.commands import train as cli_train
from solidtex_export.export.file_format import model_file
from solidtex_export.generators.regions import Box
from solidtex_export.generators.sampler import HashedLattice, OctaveSampler, trilinear
from solidtex_export.spaces.generators import ConditionedLattice
from solidtex_export.spaces.opening import open_space, open_start
from solidtex_export.spaces.result import read_space
from solidtex_export.spaces.space_reader import SpaceError
from solidtex_export.training.presets import PresetError
from solidtex_export.training.resolve import Request, resolve
from solidtex_export.training.result import ResultError
from solidtex_export.training.trainer import Trainer

torch.set_num_threads(1)
BOX = Box((-3, 2, 5), (6, 8, 13))
PRESETS = ("lattice", "sampler", "gramgan-space")
CRITIC = ["critic.widths=[4,6]", "critic.batch=2", "projected_critic.head_width=4"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Photographs, and results of small spaces and of a start."""
    folder = tmp_path_factory.mktemp("spaces")
    photos = save_photos(folder / "photos")
    turned = Image.open(photos / "p1.png").transpose(Image.Transpose.TRANSPOSE)
    turned.save(photos / "upright.png")
    for name in (*PRESETS, "start-lattice"):
        preset = save_preset(folder / f"{name}.toml", name)
        run(begin_space(photos, preset, folder / name, 2), 2)
        suffix = "start" if name.startswith("start") else "space"
        output = str(folder / f"{name}.solidtex-{suffix}")
        assert export_space.main([str(folder / name), "-o", output]) == 0
    return folder


def start(folder: Path, source: str, result: Path, *more: str) -> Trainer:
    """Training of a photograph that the space has learned: a sampler turned its grain upright."""
    option = "--start" if "start" in source else "--space"
    settings = [part for setting in CRITIC for part in ("--set", setting)]
    photo = "upright.png" if source.startswith("sampler") else "p1.png"
    arguments = [str(folder / "photos" / photo), option, str(folder / source)]
    return begin(*arguments, "-o", str(result), "--size", "40", *settings, *more)


def test_a_result_of_another_space_is_refused_by_the_space(folder: Path, tmp_path: Path) -> None:
    """Not by the size, whose default follows from the preset of the space."""
    photo, options = str(folder / "photos" / "p1.png"), ("-o", str(tmp_path / "result"), "--size")
    spaces = [
        ("--space", str(folder / f"{name}.solidtex-space")) for name in ("lattice", "sampler")
    ]
    begin(photo, *spaces[0], *options, "40")
    (tmp_path / "result" / "checkpoint.pt").touch()
    for other, name in ((spaces[1], "sampler"), ((), "none")):
        with pytest.raises(ResultError, match=f"--space: found lattice, expected {name}; to res"):
            begin(photo, *other, *options, "48")


def test_transforms_have_a_scale_for_each_axis(folder: Path, tmp_path: Path) -> None:
    """One learning rate suits the short frequencies across long grain and the low ones along it."""
    generator = start(folder, "sampler.solidtex-space", tmp_path / "result").generator
    assert isinstance(generator, OctaveSampler)
    largest = generator.linear.detach().abs().amax(1)  # [octave, axis]
    assert ((largest > 0.7) & (largest < 1.42)).all()
    across, along = generator.scales[:, 0, 0], generator.scales[:, 0, 2]
    assert (across / along).max() >= 4


@pytest.mark.parametrize("name", PRESETS)
@pytest.mark.parametrize("suffix", ["", ".solidtex-space"])
def test_a_training_starts_with_the_encoded_solid(
    folder: Path, tmp_path: Path, name: str, suffix: str
) -> None:
    """Through the file's encoder, its decoding, the export and the engine."""
    if suffix:
        pytest.importorskip("onnxruntime")
    trainer = start(folder, name + suffix, tmp_path / "result", "--steps", "4")
    train(trainer, 0)
    space = read_space(folder / name, name, "")
    record = trainer.config.space
    assert record is not None
    family = "lattice" if name == "lattice" else "sampler"
    assert trainer.config.reasons[-1].endswith(f"so --preset space-{family}")
    code = torch.tensor([record.code])
    tolerance = 0.5 if suffix else 1e-4  # the file's encoder is stored in 8 bits
    trained = space.photographs[1].code  # it is a training photograph
    assert (code - trained).norm() < tolerance * trained.norm()
    conditioned, generator = space.generator, trainer.generator
    with torch.no_grad():
        if isinstance(conditioned, ConditionedLattice):
            noise = conditioned.draw_noise(BOX)
            expected, found = conditioned(code, noise, BOX), generator(noise, BOX)
        else:
            assert isinstance(generator, OctaveSampler)
            lattice = HashedLattice(generator.octaves, torch.device("cpu"))
            points = 9 * torch.randn(1, 50, 3)
            expected = conditioned(code, points, lambda p: trilinear(lattice, p[0])[None])
            expected, found = expected.transpose(1, 2), generator(points[0], lattice).T[None]
        if space.recipe.colors == "network":
            expected = 0.5 + 0.5 * expected
            found = generator.colors(found)
    assert (found - expected).abs().max() < 2e-4 * max(1.0, float(expected.abs().max()))
    output = tmp_path / "mine.solidtex"
    assert export.main([str(tmp_path / "result"), "-o", str(output)]) == 0  # compares the engine
    training = model_file.read(output).document["training"]
    assert training["space"]["name"] == name and len(training["space"]["code"]) == 4
    assert training["fine_tuned"] == {"weights": "all", "critic": "trained"}


@pytest.mark.parametrize("source", ["lattice", "sampler", "start-lattice.solidtex-start"])
def test_steps_change_the_weights_and_resume_to_the_same_bits(
    folder: Path, tmp_path: Path, source: str
) -> None:
    whole = start(folder, source, tmp_path / "whole", "--steps", "3")
    before = {k: v.clone() for k, v in whole.generator.state_dict().items()}
    train(whole)
    train(start(folder, source, tmp_path / "parts", "--steps", "3"), 2)
    parts = train(start(folder, source, tmp_path / "parts", "--steps", "3"))
    assert_equal(whole.generator.state_dict(), parts.generator.state_dict())
    after = whole.generator.state_dict()
    for key, value in before.items():
        if "running" in key or key.startswith("color"):
            assert torch.equal(value, after[key]), key
        elif key.endswith("conv1.weight") or key == "output_weight":
            assert not torch.equal(value, after[key]), key
    assert export.main([str(tmp_path / "whole"), "-o", str(tmp_path / "m.solidtex")]) == 0


def test_gramgans_extrapolation_trains_conditions_with_the_spaces_critic(
    folder: Path, tmp_path: Path
) -> None:
    options = ("--preset", "gramgan-extrapolate", "--steps", "2")
    trainer = start(folder, "gramgan-space", tmp_path / "result", *options)
    before = {k: v.clone() for k, v in trainer.generator.state_dict().items()}
    critic = {k: v.clone() for k, v in _critic(trainer).items()}
    checkpoint = torch.load(folder / "gramgan-space" / "checkpoint.pt", weights_only=True)
    assert_equal(critic, checkpoint["critic"]["model"])
    train(trainer)
    assert_equal(critic, _critic(trainer))
    changed = {
        k for k, v in trainer.generator.state_dict().items() if not torch.equal(v, before[k])
    }
    assert changed == {"linear", "gamma", "delta", "hidden.0.noise", "hidden.1.noise"}
    with pytest.raises(PresetError, match=r"found no critic in --space .*solidtex-space"):
        start(folder, "gramgan-space.solidtex-space", tmp_path / "other", *options)


def test_extrapolation_without_a_loss_of_the_critic_needs_none(
    folder: Path, tmp_path: Path
) -> None:
    """GramGAN, figure 6: conditions trained by other features, from a space without a critic."""
    options = ("--preset", "gramgan-extrapolate", "--set", "losses.style.enabled=false")
    options += ("--set", "losses.descriptor.enabled=true", "--steps", "1")
    trainer = start(folder, "sampler", tmp_path / "result", *options)
    assert list(trainer.config.recipe.losses) == ["descriptor"]
    assert trainer.discriminators == [{}]
    before = {k: v.clone() for k, v in trainer.generator.state_dict().items()}
    train(trainer)
    changed = {
        k for k, v in trainer.generator.state_dict().items() if not torch.equal(v, before[k])
    }
    assert changed == {"linear", "gamma", "delta", "hidden.0.noise", "hidden.1.noise"}


def _critic(trainer: Trainer) -> dict[str, torch.Tensor]:
    (network,) = trainer.discriminators[0]["critic"].discriminators
    return network.state_dict()  # type: ignore[attr-defined,no-any-return]


def test_a_start_resumes_to_the_same_bits(folder: Path, tmp_path: Path) -> None:
    whole = open_start(folder / "start-lattice.solidtex-start")
    preset = folder / "start-lattice.toml"
    run(begin_space(folder / "photos", preset, tmp_path / "parts", 2), 1)
    run(begin_space(folder / "photos", preset, tmp_path / "parts", 2), 2)
    assert_equal(dict(whole.state), dict(open_start(tmp_path / "parts").state))
    assert_equal(dict(whole.state), dict(open_start(folder / "start-lattice").state))


@pytest.mark.parametrize("name", ["lattice", "start-lattice"])
def test_what_a_training_names_next_is_there(
    folder: Path, tmp_path: Path, name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """The command that exports the result, and the preview."""
    result = tmp_path / "result"
    options = ["--preset", str(folder / f"{name}.toml"), "--steps", "1", "-o", str(result)]
    assert train_space.main([str(folder / "photos" / "list.csv"), *options]) == 0
    said = capsys.readouterr()
    named = said.err.split("next: solidtex-export-space ")[1].splitlines()[0]
    arguments = named.split()
    arguments[-1] = str(tmp_path / arguments[-1])
    assert export_space.main(arguments) == 0
    assert Path(said.out.split("look at ")[1].strip()).is_file()


def test_refusals(folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    photo, space = folder / "photos" / "p1.png", folder / "lattice.solidtex-space"

    def refused(*more: str, source: Path = space, image: Path = photo) -> str:
        options = [
            "--space",
            str(source),
            "-o",
            str(tmp_path / "result"),
            "--steps",
            "1",
        ]
        try:
            code = cli_train.main([str(image), *options, "--size", "48", *more])
        except SystemExit as error:
            code = int(error.code or 0)
        assert code in (1, 2)
        assert not (tmp_path / "result").exists()
        return capsys.readouterr().err

    assert "found --map roughness, expected none" in refused("--map", f"roughness={photo}")
    assert "generator.kind: found sampler, expected lattice" in refused("--preset", "sampler")
    assert "found no critic in --space" in refused(
        "--preset", "gramgan-extrapolate", "--set", CRITIC[0]
    )
    assert "expected the sizes of --space" in refused("--set", "generator.sizes.levels=4")
    assert "found no such file" in refused(source=tmp_path / "absent")
    assert "expected a space" in refused(source=folder / "start-lattice")
    cut = tmp_path / "cut.solidtex-space"
    cut.write_bytes(space.read_bytes()[:-100])
    found = refused(source=cut)
    assert "found no whole safetensors file" in found and "download a file again" in found
    model = tmp_path / "start.solidtex-space"
    shutil.copy(folder / "start-lattice.solidtex-start", model)
    assert "metadata: found solidtex-start, expected solidtex-space" in refused(source=model)
    material = Path(__file__).parents[2] / "models" / "marble.solidtex"
    assert "this is a model, expected a texture space" in refused(source=material)
    small = tmp_path / "small.png"
    pixels = np.random.default_rng(0).integers(0, 255, (100, 144, 3)).astype(np.uint8)
    Image.fromarray(pixels).save(small)
    found = refused(image=small)
    assert "found 144 x 100 pixels, expected at least 128 x 128" in found
    assert "use a larger photograph, or solidtex-train without --space" in found


def test_a_folder_of_photographs_hides_no_shipped_space(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "stones").mkdir()
    monkeypatch.chdir(tmp_path)
    assert open_space(Path("stones")).document.name == "stones"
    with pytest.raises(ResultError, match="found no readable JSON"):
        open_space(tmp_path / "stones")


def test_a_space_with_other_values_is_refused(folder: Path, tmp_path: Path) -> None:
    from safetensors.numpy import load, save

    data = (folder / "lattice.solidtex-space").read_bytes()
    header = json.loads(data[8 : 8 + int.from_bytes(data[:8], "little")])
    text = header["__metadata__"]["solidtex-space"]

    def opened(tensors: dict[str, np.ndarray], document: str) -> None:
        path = tmp_path / "other.solidtex-space"
        path.write_bytes(save(tensors, {"solidtex-space": document}))
        open_space(path)

    pytest.importorskip("onnxruntime")
    opened(load(data), text)
    for name, match in (("last_conv.bias", "found float32"), ("encoder", "encoder")):
        with pytest.raises(SpaceError, match=match):
            opened(load(data) | {name: np.zeros((2, 2), np.float32)}, text)
    with pytest.raises(SpaceError, match=r"tensor last_conv.bias: found nothing, expected one"):
        opened({k: v for k, v in load(data).items() if k != "last_conv.bias"}, text)
    with pytest.raises(SpaceError, match="tensor more: found one, expected none"):
        opened(load(data) | {"more": np.zeros(2, np.float32)}, text)
    with pytest.raises(SpaceError, match="not finite"):
        opened(load(data) | {"last_conv.bias": np.full(3, np.nan, np.float32)}, text)
    with pytest.raises(SpaceError, match="encoder: found no usable ONNX"):
        opened(load(data) | {"encoder": np.zeros(9, np.uint8)}, text)
    with pytest.raises(SpaceError, match="version: found 2, expected 1"):
        opened(load(data), text.replace('"version":1', '"version":2'))
    with pytest.raises(SpaceError, match="family"):
        opened(load(data), text.replace('"family":"lattice"', '"family":"cubes"'))


def requested(photo: Path, *options: str) -> Request:
    """The request of a training in the folder `r` beside the photograph."""
    parser = train_options.parser()
    result = str(photo.parent / "r")
    return train_options.request_of(parser, parser.parse_args([str(photo), "-o", result, *options]))


def noise_photo(folder: Path) -> Path:
    """A photograph of 150 x 140 pixels, more than a patch of the shipped space."""
    pixels = np.random.default_rng(0).integers(0, 255, (140, 150, 3)).astype(np.uint8)
    Image.fromarray(pixels).save(folder / "color.png")
    return folder / "color.png"


def test_a_training_of_a_minute_starts_from_the_space_of_stones(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    photo = noise_photo(tmp_path)
    with Image.open(photo) as color:
        color.convert("L").save(tmp_path / "gray.png")
        color.crop((0, 0, 150, 120)).save(tmp_path / "low.png")
    why = ["--minutes at most 1, so --space stones", "start from stones, so --preset space-lattice"]
    for name in ("color.png", "gray.png"):
        config = resolve(requested(tmp_path / name, "--minutes", "1")).config
        assert config.space is not None and config.space.name == "stones"
        assert list(config.reasons) == why
    for options in (
        "--minutes 2", "--steps 9", "--minutes 1 --preset lattice", "--minutes 1 --space none",
        "--minutes 1 --directions xy", "--minutes 1 --crop 0,0,150,127",
        "--minutes 1 --resolution 100", "--minutes 1 --set optimizer.learning_rate=0.01",
        f"--minutes 1 --map height={tmp_path / 'gray.png'}",
    ):  # fmt: skip
        assert requested(photo, *options.split()).start is None, options
        assert ("--space woods" in capsys.readouterr().err) == ("xy" in options)
    assert requested(tmp_path / "low.png", "--minutes", "1").start is None


def test_without_the_space_a_short_training_starts_from_random_weights(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    photo = noise_photo(tmp_path)
    monkeypatch.setitem(sys.modules, "onnxruntime", None)
    assert requested(photo, "--minutes", "1").start is None
    told = capsys.readouterr().err
    assert "starting from random weights, not from the space stones: " in told
    assert "found no Python package 'onnxruntime'" in told
    assert requested(photo, "--minutes", "1", "--space", "none").start is None
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize(("begin_with", "start"), [("", "stones"), ("--space none", "nothing")])
def test_a_training_that_goes_on_keeps_its_start(
    begin_with: str, start: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    photo, result = noise_photo(tmp_path), tmp_path / "r"
    command = [str(photo), "-o", str(result), "--resolution", "128", "--size", "64"]
    assert cli_train.main([*command, "--minutes", "0.001", *begin_with.split()]) == 0
    for minutes in ("0.002", "1.5"):
        found = requested(photo, "--minutes", minutes).start
        assert (found is None) == (start == "nothing")
    capsys.readouterr()
    assert cli_train.main([*command, "--minutes", "0.002"]) == 0
    assert "continues a training of 0.001 minutes" in capsys.readouterr().err
    (result / "config.json").write_text("[]")
    assert requested(photo, "--minutes", "1").start is None
    assert cli_train.main([*command, "--minutes", "1"]) == 1
    assert "config.json: found no JSON object" in capsys.readouterr().err
