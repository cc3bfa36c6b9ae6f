"""A training in a folder that has one: resumed by the same command, refused by another."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
import torch
from PIL import Image
from small_trainings import SIZE, arguments

from solidtex_export.commands import train as cli_train
from solidtex_export.training.result import ResultFolder

torch.set_num_threads(1)


def log_lines(result: Path) -> list[str]:
    log = result / "log.csv"
    return log.read_text().splitlines() if log.exists() else []


def test_interrupt_saves_and_the_same_command_resumes(photo: Path, tmp_path: Path) -> None:
    result = tmp_path / "result"
    command = [sys.executable, "-m", "solidtex_export.commands.train"]
    command += arguments(photo, result, "--steps", "100000", "--threads", "1")
    steps = []
    for _ in range(2):
        process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
        lines = len(log_lines(result))
        deadline = time.monotonic() + 120
        while len(log_lines(result)) <= lines + 1 and time.monotonic() < deadline:
            assert process.poll() is None, process.stdout.read()
            time.sleep(0.1)
        process.send_signal(signal.SIGINT)
        output, _ = process.communicate(timeout=60)
        assert process.returncode == 130, output
        steps.append(torch.load(result / "checkpoint.pt", weights_only=True)["step"])
    assert 0 < steps[0] < steps[1]
    assert b"resuming at step %d" % steps[0] in output


def test_a_second_training_in_the_same_folder_is_refused(
    photo: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    result = tmp_path / "result"
    assert cli_train.main(arguments(photo, result, "--steps", "2")) == 0
    before = {f.name: f.read_bytes() for f in result.iterdir()}
    with ResultFolder(result).held():
        capsys.readouterr()
        assert cli_train.main(arguments(photo, result, "--steps", "4")) == 1
    assert "found another solidtex-train that writes into this folder" in capsys.readouterr().err
    assert {f.name: f.read_bytes() for f in result.iterdir()} == before
    assert cli_train.main(arguments(photo, result, "--steps", "4")) == 0


def test_more_steps_continue_a_finished_training(
    photo: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    result = tmp_path / "result"
    assert cli_train.main(arguments(photo, result, "--steps", "2")) == 0
    assert cli_train.main(arguments(photo, result, "--steps", "3")) == 0
    printed = capsys.readouterr()
    assert "continues a training of 2 steps" in printed.err
    assert "resuming at step 2" in printed.err
    state = torch.load(result / "checkpoint.pt", weights_only=True)
    assert state["step"] == 3 and state["finished"]
    assert json.loads((result / "config.json").read_text())["steps"] == 3
    assert cli_train.main(arguments(photo, result, "--steps", "2")) == 1
    assert "config.json: --steps: found 3, expected 2" in capsys.readouterr().err
    assert cli_train.main(arguments(photo, result, "--minutes", "2")) == 1


def test_license_and_source_may_be_told_later(photo: Path, tmp_path: Path) -> None:
    args = arguments(photo, tmp_path / "result", "--preset", "sampler", "--steps", "1")
    assert cli_train.main([*args, "--source", "a quarry"]) == 0
    saved = (tmp_path / "result/checkpoint.pt").read_bytes()
    assert cli_train.main([*args, "--license", "CC0-1.0"]) == 0
    config = json.loads((tmp_path / "result/config.json").read_text())
    assert (config["license"], config["source"]) == ("CC0-1.0", "a quarry")
    assert (tmp_path / "result/checkpoint.pt").read_bytes() == saved


def test_foreign_folders_and_other_trainings_are_refused(
    photo: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    foreign = tmp_path / "foreign"
    foreign.mkdir()
    (foreign / "thesis.txt").write_text("precious")
    assert cli_train.main(arguments(photo, foreign, "--steps", "1")) == 1
    assert "without config.json" in capsys.readouterr().err
    assert [p.name for p in foreign.iterdir()] == ["thesis.txt"]

    result = tmp_path / "result"
    result.mkdir()
    (result / ".config.host-1-1.tmp.json").write_text("{")  # of a killed process
    assert cli_train.main(arguments(photo, result, "--steps", "1")) == 0
    assert cli_train.main(arguments(photo, result, "--steps", "1", "--seed", "7")) == 1
    error = capsys.readouterr().err
    assert "seed: found 0, expected 7" in error
    rate = ["--set", "optimizer.learning_rate=0.125"]
    assert cli_train.main(arguments(photo, result, "--steps", "1", *rate)) == 1
    error = capsys.readouterr().err
    assert "recipe.optimizer.learning_rate: found 0.006, expected 0.125;" in error
    torch.save({"generator": {}}, result / "checkpoint.pt")
    assert cli_train.main(arguments(photo, result, "--steps", "1")) == 1
    assert "checkpoint.pt: found a checkpoint that does not fit" in capsys.readouterr().err
    (result / "checkpoint.pt").write_bytes(b"damaged")
    assert cli_train.main(arguments(photo, result, "--steps", "1")) == 1
    assert "checkpoint.pt" in capsys.readouterr().err


def test_trainings_of_older_versions_are_not_resumed(
    photo: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    result = tmp_path / "result"
    assert cli_train.main(arguments(photo, result, "--steps", "1")) == 0
    config = json.loads((result / "config.json").read_text())
    del config["version"]
    (result / "config.json").write_text(json.dumps(config))
    assert cli_train.main(arguments(photo, result, "--steps", "1")) == 1
    error = capsys.readouterr().err
    assert "config.json: version: found null, expected 4: another version of solidtex" in error
    assert "export it as it is, or choose another -o" in error


def test_another_training_is_refused_by_its_first_option(
    photo: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    result = tmp_path / "result"
    assert cli_train.main(arguments(photo, result, "--steps", "1")) == 0
    config = json.loads((result / "config.json").read_text())
    other = arguments(photo, result, "--steps", "1", "--size", "48", "--seed", "5")
    assert cli_train.main(other) == 1
    message = f"{result / 'config.json'}: --size: found {SIZE}, expected 48; to resume"
    assert message in capsys.readouterr().err
    # A preset that is given comes first: defaults of the others follow from it.
    assert config["preset"] != "sampler"
    assert cli_train.main([*other, "--preset", "sampler"]) == 1
    message = f'config.json: --preset: found {json.dumps(config["preset"])}, expected "sampler";'
    assert message in capsys.readouterr().err


def test_a_training_on_another_photograph_is_named_by_its_file(
    photo: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    result, other = tmp_path / "result", tmp_path / "other.png"
    assert cli_train.main(arguments(photo, result, "--steps", "1")) == 0
    Image.open(photo).rotate(180).save(other)
    found = f"{result / 'config.json'}: exemplars: found a training on "
    for name, old in (("other.png", "photo.png"), ("photo.png", "another file named photo.png")):
        other = other.rename(tmp_path / name)
        assert cli_train.main(arguments(other, result, "--steps", "1")) == 1
        error = capsys.readouterr().err
        assert f"{found}{old}, expected one on {name}; to resume" in error
        assert "choose another -o" in error and "sha256" not in error


def test_a_training_that_never_began_is_replaced_by_a_corrected_command(
    photo: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    result = tmp_path / "result"
    (tmp_path / "no_loss.py").write_text("def value(slices, crops):\n    return 0\n")
    monkeypatch.syspath_prepend(tmp_path)
    loss = ["--set", "losses.mine.kind=no_loss:value"]
    assert cli_train.main(arguments(photo, result, "--steps", "1", *loss)) == 1
    assert (result / "config.json").exists() and not (result / "checkpoint.pt").exists()
    assert cli_train.main(arguments(photo, result, "--steps", "1", "--resolution", "50")) == 0
    config = json.loads((result / "config.json").read_text())
    assert config["resolution"] == 50 and "mine" not in config["recipe"]["losses"]
    assert min(Image.open(result / "exemplar-0.png").size) == 50
