"""Training: its result folder, settings, refusals, and what it prints."""

from __future__ import annotations

import json
import time
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import torch
from PIL import Image
from small_trainings import SIZE, arguments

from solidtex_export.analysis.grain import channel_axes, whiten
from solidtex_export.commands import export as cli_export
from solidtex_export.commands import terminal
from solidtex_export.commands import train as cli_train
from solidtex_export.commands.terminal import run_in_terminal
from solidtex_export.images.exemplar import load_exemplar
from solidtex_export.training.optimizer import half_cosine, learning_rate
from solidtex_export.training.recipe import Optimizer
from solidtex_export.training.resolve import resolve, scale
from solidtex_export.training.trainer import Trainer

torch.set_num_threads(1)

METHODS = {"lattice": "field", "sampler": "sampler"}
FILES = {"config.json", "checkpoint.pt", "log.csv", "exemplar-0.png", "preview.png"}


def test_whitening_inverts_the_color_affine(photo: Path) -> None:
    exemplar = load_exemplar(photo, 64, SIZE)
    mean, basis = channel_axes([exemplar])
    y = whiten(exemplar.image, mean, basis)
    back = torch.einsum("ij,jrc->irc", basis, y) + mean[:, None, None]
    assert (back - exemplar.image).abs().max() < 1e-5
    assert abs(float(y[-1].std()) - 1) < 0.01  # the largest axis has unit variance


@pytest.mark.parametrize(("method", "family"), list(METHODS.items()))
def test_training_leaves_a_complete_result(
    method: str, family: str, photo: Path, tmp_path: Path
) -> None:
    result = tmp_path / "result"
    args = arguments(photo, result, "--preset", method, "--steps", "4", "--license", "CC0-1.0")
    assert cli_train.main(args) == 0
    assert {p.name for p in result.iterdir()} == FILES
    config = json.loads((result / "config.json").read_text())
    assert config["family"] == family and config["license"] == "CC0-1.0"
    assert config["exemplars"][0]["file"] == "photo.png"
    assert len(config["exemplars"][0]["sha256"]) == 64
    checkpoint = torch.load(result / "checkpoint.pt", weights_only=True)
    assert checkpoint["step"] == 4 and checkpoint["finished"]
    assert all(v.isfinite().all() for v in checkpoint["generator"].values())
    with Image.open(result / "preview.png") as sheet:
        assert sheet.size == (5 * SIZE + 4 * 4, SIZE)
    assert cli_train.main(args) == 0  # nothing left to do


def small_trainer(photo: Path, result: Path, *more: str) -> Trainer:
    p = cli_train.parser()
    args = p.parse_args(arguments(photo, result, *more))
    asked = cli_train.request_of(p, args)
    return cli_train.make_trainer(asked, result, use_cuda=False, compiled=False)


def test_training_moves_weights_and_keeps_the_statistics_that_it_began_with(
    photo: Path, tmp_path: Path
) -> None:
    statistics = "cb6_2.bn3.running_var"
    trainer = small_trainer(photo, tmp_path / "r", "--steps", "3")
    before = trainer.generator.state_dict()[statistics].clone()
    assert not torch.equal(before, torch.ones(24))
    seen = []
    trainer.run(
        lambda: False,
        lambda t: seen.append({k: v.clone() for k, v in t.generator.state_dict().items()}),
    )
    for key in ("last_conv.weight", "cb1_1.conv1.weight", "up3.bn.bias"):
        assert not any(torch.equal(a[key], b[key]) for a, b in pairwise(seen)), key
    assert all(torch.equal(state[statistics], before) for state in seen)


def test_processor_time_does_not_count_waiting(
    photo: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    trainer = small_trainer(photo, tmp_path / "r", "--minutes", "1", "--clock", "processor")
    step = trainer._train_step

    def slow_step() -> dict[str, float]:
        time.sleep(0.5)
        return step()

    monkeypatch.setattr(trainer, "_train_step", slow_step)
    before = time.process_time()
    trainer.run(lambda: trainer.step == 2, lambda t: None)
    assert 0 < trainer.seconds <= time.process_time() - before
    assert json.loads((tmp_path / "r" / "config.json").read_text())["clock"] == "processor"


def test_rates_rise_to_the_first_one_and_fall_to_the_last() -> None:
    settings = Optimizer(learning_rate=0.01, final_rate=0.1, warmup_steps=4)
    rates = [learning_rate(i, i / 1000, settings) for i in range(1001)]
    assert rates[0] == pytest.approx(0.01 / 4) and rates[-1] == pytest.approx(0.001)
    assert rates[250] == pytest.approx(half_cosine(0.25, 0.01, 0.001))
    assert all(a > b for a, b in pairwise(rates[3:]))


def test_a_photograph_per_direction(photo: Path, tmp_path: Path) -> None:
    result = tmp_path / "result"
    args = [str(photo), *arguments(photo, result, "--preset", "sampler", "--steps", "3")]
    assert cli_train.main(args) == 0
    assert json.loads((result / "config.json").read_text())["directions"] == "xy"
    assert (result / "exemplar-1.png").exists()


def test_missing_small_and_broken_photographs(
    photo: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    broken = tmp_path / "broken.png"
    broken.write_bytes(photo.read_bytes()[:300])
    cases = [(tmp_path / "none.png", "no such file"), (broken, "a damaged or unfinished image")]
    for path, message in cases:
        assert cli_train.main(arguments(path, tmp_path / "result")) == 1
        error = capsys.readouterr().err
        assert str(path) in error and message in error and "expected" in error
    large = [str(photo), "-o", str(tmp_path / "result"), "--size", "96"]
    assert cli_train.main(large) == 1
    assert "found 64 x 56 pixels, expected at least 96 x 96" in capsys.readouterr().err
    outside = arguments(photo, tmp_path / "result", "--crop", "10,0,60,50")
    assert cli_train.main(outside) == 1
    assert "--crop: found 10,0,60,50, expected a region of 64 x 56" in capsys.readouterr().err
    assert not (tmp_path / "result").exists()


@pytest.mark.parametrize(
    ("options", "size", "resolution"),
    [
        ([], 128, 256),
        (["--crop", "8,0,90,200"], 90, 180),
        (["--resolution", "100"], 100, 100),
        (["--size", "64"], 64, 128),
        (["--size", "64", "--resolution", "70"], 64, 70),
        (["--preset", "space-lattice"], 96, 192),
        (["--preset", "space-lattice", "--size", "64"], 64, 128),
        (["--set", "slicing.size=80"], 80, 160),
    ],
)
def test_slices_are_half_of_a_photograph_or_all_of_a_small_one(
    options: list[str], size: int, resolution: int, tmp_path: Path
) -> None:
    photo = tmp_path / "large.png"
    pixels = np.random.default_rng(1).integers(0, 255, (200, 300, 3))
    Image.fromarray(pixels.astype(np.uint8)).save(photo)
    p = cli_train.parser()
    args = p.parse_args([str(photo), "-o", str(tmp_path / "result"), *options])
    assert scale(cli_train.request_of(p, args)) == (size, resolution)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ([], True),
        (["--size", "50"], False),
        (["--resolution", "40"], False),
    ],
)
def test_a_photograph_smaller_than_a_slice_is_told(
    options: list[str], said: bool, photo: Path, tmp_path: Path
) -> None:
    args = cli_train.parser().parse_args([str(photo), "-o", str(tmp_path / "r"), *options])
    notes = resolve(cli_train.request_of(cli_train.parser(), args)).exemplars[0].notes
    told = f"{photo}: 64 x 56 pixels: slices of 56 instead of 128; features repeat little"
    assert [note.startswith(told) for note in notes if "features repeat" in note] == [True] * said


@pytest.mark.parametrize(
    ("more", "message"),
    [
        (["--size", "20"], "--size: found 20"),
        (
            ["--size", "64", "--preset", "gramgan"],
            "expected at least 82, the smallest slice for the losses of preset gramgan",
        ),
        (["--seed", "-1"], "--seed: found -1, expected 0 to 2**64 - 1"),
        (
            ["--directions", "xyz", "PHOTO"],
            "--directions: found 3 (xyz) for 2 photographs",
        ),
        (["PHOTO", "PHOTO", "PHOTO"], "PHOTO: found 4"),
        (["--steps", "0"], "--steps: found 0"),
        (["--steps", "ten"], "solidtex-train: --steps: found ten, expected a whole number"),
        (["--device", "gpu"], "--device: found gpu, expected one of auto, cpu, cuda"),
        (["--steps", "5", "--minutes", "1"], "--steps: found together with --minutes"),
        (["--minutes", "nan"], "--minutes: found nan"),
        (["--resolution", "30"], "--resolution: found 30"),
        (["--crop", "0,0,50"], "--crop: found 0,0,50, expected X,Y,W,H"),
    ],
)
def test_options_that_cannot_work(
    more: list[str],
    message: str,
    photo: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    photos = [str(photo) for m in more if m == "PHOTO"]
    options = [m for m in more if m != "PHOTO"]
    with pytest.raises(SystemExit) as exit:
        cli_train.main([*photos, *arguments(photo, tmp_path / "result", *options)])
    assert exit.value.code == 2
    assert message in capsys.readouterr().err


def test_without_a_terminal_lines_report_the_progress(
    photo: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(terminal, "LOG_SECONDS", 0.0)
    run_in_terminal(small_trainer(photo, tmp_path / "r", "--steps", "2"))
    lines = [line for line in capsys.readouterr().err.splitlines() if line.startswith("step")]
    assert [line.partition(",")[0] for line in lines] == ["step 1", "step 2"]
    assert lines[-1] == "step 2, 0.0 min left, 100%"
    late = small_trainer(photo, tmp_path / "late", "--minutes", "0.001")
    late.seconds = 0.05
    run_in_terminal(late)
    assert late.progress > 1 and "step 1, 0.0 min left, 100%" in capsys.readouterr().err


def test_results_are_on_standard_output_and_talk_is_not(
    photo: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    result = tmp_path / "result"
    assert cli_train.main(arguments(photo, result, "--steps", "1")) == 0
    printed = capsys.readouterr()
    assert printed.out == f"{result}: done; look at {result / 'preview.png'}\n"
    assert "training on cpu" in printed.err and "next: solidtex-export" in printed.err
    assert cli_train.main(arguments(photo, result, "--steps", "2", "--json", "--quiet")) == 0
    printed = capsys.readouterr()
    document = json.loads(printed.out)
    assert printed.err == "" and document["program"] == "solidtex-train"
    assert (document["step"], document["finished"]) == (2, True)
    assert document["files"] == [str(result / "preview.png")]
    exported = tmp_path / "m.solidtex"
    assert cli_export.main([str(result), "-o", str(exported), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["files"] == [str(exported)]


def test_a_dash_is_standard_output(
    photo: Path, tmp_path: Path, capfdbinary: pytest.CaptureFixture[bytes]
) -> None:
    result, file = tmp_path / "result", tmp_path / "result.solidtex"
    assert cli_train.main(arguments(photo, result, "--steps", "1", "--quiet")) == 0
    assert cli_export.main([str(result), "-o", str(file)]) == 0
    capfdbinary.readouterr()
    assert cli_export.main([str(result), "-o", "-"]) == 0
    printed = capfdbinary.readouterr()
    assert printed.out == file.read_bytes() and printed.err
    with pytest.raises(SystemExit):
        cli_export.main([str(result), "-o", "-", "--json"])


def test_a_reduction_and_an_unfinished_export_are_announced(
    photo: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    result = tmp_path / "result"
    assert cli_train.main(arguments(photo, result, "--steps", "1", "--resolution", "49")) == 0
    reduced = "photo.png: 64 x 56 pixels reduced to 56 x 49 (a texel is 1.143 pixels wide);"
    assert f"{reduced} --resolution 56 keeps them" in capsys.readouterr().err
    state = torch.load(result / "checkpoint.pt", weights_only=True)
    torch.save(state | {"finished": False}, result / "checkpoint.pt")
    assert cli_export.main([str(result), "-o", str(tmp_path / "early.solidtex")]) == 0
    assert "not finished, it stopped at step 1 of 1" in capsys.readouterr().err
    config = json.loads((result / "config.json").read_text())
    del config["steps"]
    for minutes, words in ((1, "1 minute;"), (1.5, "1.5 minutes;")):
        (result / "config.json").write_text(json.dumps(config | {"minutes": minutes}))
        early = str(tmp_path / f"{minutes}.solidtex")
        assert cli_export.main([str(result), "-o", early]) == 0
        assert f"stopped at step 1; it was to take {words} repeat" in capsys.readouterr().err
