"""solidtex-fidelity: plans, one real cell, what fails, what is not done twice."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from safetensors.torch import save_file

from solidtex_export.commands import evaluate
from solidtex_export.commands.fidelity import EXAMPLES, main
from solidtex_export.commands.train_options import DEFAULT_MINUTES
from solidtex_export.evaluation import subjects
from solidtex_export.export.file_format import model_file
from solidtex_export.networks.squeezenet import SqueezeNet
from solidtex_export.research.fidelity import cell as cells
from solidtex_export.research.fidelity.cell import Cell
from solidtex_export.research.fidelity.outcome import Outcome, Outcomes
from solidtex_export.research.fidelity.plan import CHOSEN, Plan, PlanError, photograph, read_plan
from solidtex_export.research.fidelity.table import write_table
from solidtex_export.research.solids.materials import SOLIDS
from solidtex_export.training.presets import shipped
from solidtex_export.training.result import first_difference

REPOSITORY = Path(__file__).resolve().parents[2]
DOCS, MODELS = REPOSITORY / "docs", REPOSITORY / "models"
PLAN = """
minutes = 0.01
methods = ["lattice"]
[[exemplar]]
name = "rock"
solid = "porous"
pixels = 100
size = 48
resolution = 100
[[exemplar]]
name = "missing"
photo = "nowhere.png"
"""


@pytest.fixture
def plan(tmp_path: Path) -> Path:
    path = tmp_path / "plan.toml"
    path.write_text(PLAN)
    (tmp_path / "nowhere.png").touch()
    return path


def in_process(monkeypatch: pytest.MonkeyPatch) -> list[list[str]]:
    """Steps run without new processes, on small blocks; a shipped model stands for training."""
    calls: list[list[str]] = []

    def run(command: list[str], **_: object) -> subprocess.CompletedProcess[str]:
        module, arguments = command[2], command[3:]
        calls.append([module.rpartition(".")[2], *arguments])
        if module.endswith("train"):
            missing = arguments[0].endswith("nowhere.png")
            return subprocess.CompletedProcess(command, int(missing), "reading\nno such file\n")
        if module.endswith("export"):
            shutil.copyfile(MODELS / "granite-grey.solidtex", arguments[-1])
            return subprocess.CompletedProcess(command, 0, "")
        return subprocess.CompletedProcess(command, evaluate.main(arguments), "")

    monkeypatch.setattr(subprocess, "run", run)
    monkeypatch.setattr(cells, "BLOCK", 40)
    monkeypatch.setattr(subjects, "BLOCK", 40)
    monkeypatch.setattr("solidtex_export.evaluation.evaluate.COPY_SIDE", 16)
    return calls


def test_exemplars_come_from_a_list_of_photographs(tmp_path: Path) -> None:
    (tmp_path / "list.csv").write_text(
        "file,licence,split,direction\n"
        + "".join(f"Stone_{i}.jpg,CC0-1.0,validation,isotropic\n" for i in range(5))
        + "oak.jpg,CC0-1.0,validation,vertical-grain\nash.jpg,CC0-1.0,train,vertical-grain\n"
    )
    path = tmp_path / "plan.toml"
    text = """
processor_minutes = 2
methods = ["plain", "lattice"]
[method.plain]
set = ["losses.wavelets.weight=0"]
[photographs]
list = "list.csv"
folder = "validation"
size = 64
"""
    path.write_text(text)
    plan = read_plan(path)
    assert [e.name for e in plan.exemplars] == [*(f"stone-{i}" for i in range(5)), "oak"]
    oak, stone = plan.exemplars[-1], plan.exemplars[0]
    assert oak.directions == "xy" and stone.directions is None
    cell = Cell(plan, oak, "plain", tmp_path / "all", tmp_path)
    assert cell.photo == tmp_path / "validation" / "oak.jpg"
    options = cell._training(tmp_path / "result")
    assert {"--minutes=2.0", "--clock=processor", "--size=64"} <= set(options)
    assert "--set=losses.wavelets.weight=0" in options and "--preset=plain" not in options
    path.write_text(text + "count = 3\n")
    assert [e.name for e in read_plan(path).exemplars] == ["stone-0", "stone-2", "oak"]
    with pytest.raises(PlanError, match="found no such file, expected photographs"):
        read_plan(path, tmp_path / "nowhere")


def test_the_plans_of_the_page_are_read(tmp_path: Path) -> None:
    whole, methods, photographs = re.findall(
        r"^```toml\n(.*?)^```", (DOCS / "evaluation.md").read_text(), re.M | re.S
    )
    rows = [f"stone-{i}.jpg,CC0-1.0,validation\n" for i in range(50)]
    (tmp_path / "SOURCES.csv").write_text("file,licence,split\n" + "".join(rows))
    exemplar = "[[exemplar]]\nname = 'rock'\nsolid = 'porous'\n"
    texts = [whole, f"steps = 1\n{methods}{exemplar}", f"steps = 1\nmethods = ['a']\n{photographs}"]
    plans = []
    for text in texts:
        (tmp_path / "plan.toml").write_text(text)
        plans.append(read_plan(tmp_path / "plan.toml"))
    assert [entry.name for entry in plans[0].exemplars] == ["granite", "rock"]
    assert plans[1].method("no-wavelets").set == ("losses.wavelets.weight=0",)
    assert len(plans[2].exemplars) == 24


def test_the_method_default_is_none_at_all(plan: Path, tmp_path: Path) -> None:
    plan.write_text(PLAN.replace('"lattice"', '"default"'))
    read = read_plan(plan)
    cell = Cell(read, read.exemplars[0], read.methods[0], tmp_path / "all", tmp_path)
    assert not any(option.startswith("--preset") for option in cell._training(tmp_path))


def test_a_plan_is_trained_evaluated_and_written_once(
    plan: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    calls = in_process(monkeypatch)
    arguments = [str(plan), "-o", str(tmp_path / "all"), "--table", str(tmp_path / "table.md")]
    assert main(arguments) == 0
    rock = tmp_path / "all" / "rock"
    assert [call[0] for call in calls] == ["train", "export", "evaluate", "train"]
    assert calls[0][1:4] == [str(rock / "exemplar.png"), "-o", str(rock / "lattice" / "result")]
    options = {"--preset=lattice", "--minutes=0.01", "--size=48", "--resolution=100"}
    assert options <= set(calls[0]) and calls[0][-2:] == ["--threads", "1"]
    assert (rock / "lattice" / "report.html").exists()
    errors = json.loads((rock / "lattice" / "solid.json").read_text())
    # Granite knows less than another piece of the true rock.
    assert errors["model"]["two_point"] > 2 * errors["true"]["two_point"]

    page = (tmp_path / "table.md").read_text()
    assert "lattice failed: `train: no such file`" in page and "| failed |" in page
    training = model_file.read(MODELS / "granite-grey.solidtex").document["training"]
    assert f"| {training['seconds'] / 60:.1f} | {training['step']} |" in page
    assert "another block of the true solid" in page
    with Image.open(tmp_path / "all" / "contact-sheet.png") as sheet:
        assert sheet.size == (3 * 128 + 2 * 4, 128 + 14)  # the failed one has no images
        assert np.asarray(sheet)[14:, 132:].std() > 5
    distances = json.loads((rock / "lattice" / "eval.json").read_text())["distances"]["albedo"]
    for metric in ("binary_patterns", "spectrum"):  # an overview each
        assert f"| [rock](#rock) | {distances['overall'][metric]['multiple']:.2f} |" in page
    for file in ("rock.jpg", "rock-lattice.jpg"):
        assert f"images/table/{file}" in page and (tmp_path / "images" / "table" / file).exists()

    calls.clear()
    (tmp_path / "table.md").unlink()
    assert main(arguments) == 0
    assert not calls and (tmp_path / "table.md").read_text() == page
    assert main([*arguments, "--retry"]) == 0
    assert [call[0] for call in calls] == ["train"]

    weights = tmp_path / "squeezenet.safetensors"
    save_file(SqueezeNet().state_dict(), weights)
    calls.clear()
    for _ in range(2):  # the second time nothing is left to do
        assert main([*arguments, f"--features={weights}", "--workers=2"]) == 0
        assert [call[0] for call in calls] == ["evaluate"]
    assert "## Feature distance" in (tmp_path / "table.md").read_text()


def test_the_table_remembers_what_is_not_in_the_folder(
    plan: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    calls = in_process(monkeypatch)
    plan.write_text(PLAN.replace('"lattice"', '"default"'))
    figures = tmp_path / "table.json"

    def command(folder: str, *options: str) -> list[str]:
        return [str(plan), "-o", str(tmp_path / folder), "--table", str(tmp_path / "table.md"),
                *options]  # fmt: skip

    assert main(command("one")) == 0
    page = (tmp_path / "table.md").read_text()
    training = model_file.read(MODELS / "granite-grey.solidtex").document["training"]
    assert f"| default: `{training['preset']}` |" in page  # the one that was chosen
    calls.clear()
    assert main(command("two")) == 0
    assert not calls and (tmp_path / "table.md").read_text() == page
    assert main(command("two", "--again", "--only", "rock", "--method", "default")) == 0
    assert [call[0] for call in calls] == ["train", "export", "evaluate"]
    assert (tmp_path / "table.md").read_text() == page

    document = json.loads(figures.read_text())
    document["pairs"]["rock"]["default"]["solid"]["euler"] = None  # JSON's infinity
    figures.write_text(json.dumps(document))
    assert main(command("three")) == 0
    assert "no phase" in (tmp_path / "table.md").read_text()
    figures.write_text("{}")
    assert main(command("three")) == 1
    assert f"{figures}: found no outcomes" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("before", "after", "message"),
    [
        ("minutes = 0.01", "minutes = 0.02", "minutes: found 0.01, expected 0.02"),
        ("minutes = 0.01", "steps = 5", "minutes: found 0.01, expected null"),
        ("size = 48", "size = 64", "size: found 48, expected 64"),
        ("weight=2", "weight=3", 'set.0: found "losses.spectrum.weight=2", expected "losses'),
    ],
)
def test_results_of_another_plan_are_refused(
    before: str,
    after: str,
    message: str,
    plan: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    text = PLAN.replace('"lattice"', '"mine"')
    text += "[method.mine]\npreset = 'lattice'\nset = ['losses.spectrum.weight=2']\n"
    table = tmp_path / "table.md"
    arguments = [str(plan), "--only", "rock", "--table", str(table), "-o"]
    plan.write_text(text)
    first, second = str(tmp_path / "first"), str(tmp_path / "second")
    monkeypatch.setattr(Cell, "_step", lambda cell, command, *_: command == "train")
    assert main([*arguments, first]) == 0  # the export fails
    plan.write_text(text.replace('["mine"]', '["mine", "lattice"]'))
    assert main([*arguments, first]) == 0  # a plan that grows
    assert (tmp_path / "first" / "rock" / "lattice" / "training.json").exists()
    plan.write_text(text.replace(before, after))
    assert main([*arguments, first, "--retry"]) == 1
    said = capsys.readouterr().err
    assert f"{first}/rock/mine: {message}" in said and "choose another -o" in said

    figures = Outcomes({"rock": {"mine": Outcome(training=record_of(first))}}, {})
    figures.write(table.with_suffix(".json"))
    assert main([*arguments, second]) == 1
    said = capsys.readouterr().err
    assert f"table.json: rock, mine: {message}" in said and "--again" in said


def record_of(folder: str) -> dict[str, object]:
    found: dict[str, object] = json.loads(Path(folder, "rock/mine/training.json").read_text())
    return found


def test_a_preset_of_ones_own_that_changed_is_another_plan(tmp_path: Path) -> None:
    preset = tmp_path / "mine.toml"
    plan = Plan(
        steps=1,
        methods=("mine",),
        method={"mine": {"preset": str(preset)}},
        exemplar=[{"name": "rock", "solid": "porous"}],
    )
    cell = Cell(plan, plan.exemplars[0], "mine", tmp_path, tmp_path)
    settings = []
    for weight in (1, 2):
        preset.write_text(f'extends = "lattice"\n[losses.spectrum]\nweight = {weight}\n')
        settings.append(cell.settings)
    difference = first_difference(*settings)
    assert difference == "recipe.losses.spectrum.weight: found 1.0, expected 2.0"


def test_maps_of_a_solid_are_trained_and_evaluated(
    plan: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    plan.write_text(PLAN.replace('solid = "porous"', 'solid = "grains"'))
    calls = in_process(monkeypatch)
    assert main([str(plan), "-o", str(tmp_path / "all"), "--only", "rock"]) == 0
    maps = {f"--map={n}={tmp_path}/all/rock/exemplar-{n}.png" for n in ("roughness", "height")}
    assert maps <= set(calls[0]) and maps <= set(calls[2])


def test_an_interrupted_step_ends_the_command(
    plan: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(command: list[str], **_: object) -> subprocess.CompletedProcess[str]:
        return subprocess.CompletedProcess(command, 130, "")

    monkeypatch.setattr(subprocess, "run", interrupted)
    assert main([str(plan), "-o", str(tmp_path / "all"), "--only", "missing"]) == 130
    assert not (tmp_path / "all" / "missing" / "lattice" / "failure.txt").exists()


def test_a_note_heads_the_table(tmp_path: Path) -> None:
    path = tmp_path / "plan.toml"
    path.write_text('note = """\nOn a small computer.\n"""\n' + PLAN)
    plan = read_plan(path)
    assert plan.note == "On a small computer."
    page = tmp_path / "page.md"
    rows = [[Cell(plan, e, m, tmp_path, tmp_path) for m in plan.methods] for e in plan.exemplars]
    write_table(page, plan, "plan.toml", rows)
    assert "\nOn a small computer.\n" in page.read_text()


def test_the_plan_of_the_benchmark_has_both_families(tmp_path: Path) -> None:
    (tmp_path / "SOURCES.csv").write_text("file,licence,split\na.jpg,CC0-1.0,validation\n")
    plan = read_plan(DOCS / "fidelity.toml", tmp_path)
    assert plan.methods == ("lattice", "sampler") and plan.exemplars[0].photo == "validation/a.jpg"
    assert DEFAULT_MINUTES == 15 and "`solidtex-train` trains for fifteen, and" in plan.note
    assert plan.note.strip() in (DOCS / "fidelity.md").read_text()


def test_the_plan_of_the_default_chooses_presets(tmp_path: Path) -> None:
    (tmp_path / "SOURCES.csv").write_text("file,licence,split\na.jpg,CC0-1.0,validation\n")
    plan = read_plan(DOCS / "fidelity-default.toml", tmp_path)
    assert plan.methods == (CHOSEN,) and plan.processor_minutes == 10
    assert plan.note.strip() in (DOCS / "fidelity-default.md").read_text()


def test_the_plan_of_papers_at_length_gives_ours_a_tenth_of_the_time_too() -> None:
    plan = read_plan(DOCS / "papers-length.toml")
    assert plan.methods[0] == CHOSEN and set(plan.methods[2:]) <= set(shipped())
    assert plan.method("default-tenth").options == (f"--minutes={plan.processor_minutes / 10}",)
    assert plan.note.strip() in (DOCS / "papers-length.md").read_text()


def test_the_shipped_plan_is_complete(tmp_path: Path) -> None:
    plan = read_plan(DOCS / "papers.toml")
    assert len(plan.exemplars) >= 12
    assert len(plan.methods) > 5 and set(plan.methods) <= set(shipped())
    assert {entry.solid for entry in plan.exemplars if entry.solid} <= set(SOLIDS)
    assert set(re.findall(r"--only (\S+)", EXAMPLES)) <= {entry.name for entry in plan.exemplars}
    for entry in plan.exemplars:
        if (entry.photo or "").startswith("skimage:"):
            with Image.open(photograph(entry, tmp_path)) as picture:
                assert np.asarray(picture).std() > 5


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("minutes = 1", "methods: found nothing, expected this key"),
        (
            PLAN.replace("minutes", "steps = 3\nminutes"),
            'minutes: found {"minutes": 0.01, "steps": 3}, expected one of',
        ),
        (PLAN.replace("minutes = 0.01", ""), "minutes: found null, expected one of minutes, proc"),
        ("minutes = 1\nmethods = ['lattice']", "exemplar: found [], expected exemplars or"),
        ("]", "found no readable TOML"),
        (PLAN.replace("0.01", "0"), "minutes: found 0, expected more than 0"),
        (PLAN.replace('["lattice"]', "[]"), "methods: found []"),
        (PLAN.replace("missing", "rock"), "expected different ones"),
        (PLAN.replace("porous", "cheese"), 'exemplar.0.solid: found "cheese"'),
        (
            PLAN.replace("pixels", "texels"),
            "exemplar.0.texels: found an unknown key, expected name, photo, solid",
        ),
        (
            PLAN + "[photographs]\ndirectory = 'a'",
            "photographs.directory: found an unknown key, expected folder, list",
        ),
        (
            "speed = 1" + PLAN,
            "methods, method, exemplar, photographs, note",
        ),
        (
            PLAN.replace('photo = "nowhere.png"', ""),
            "exemplar.1.photo: found null, expected one of photo and solid",
        ),
    ],
)
def test_wrong_plans_are_refused(text: str, message: str, plan: Path) -> None:
    plan.write_text(text)
    with pytest.raises(PlanError) as refusal:
        read_plan(plan)
    assert str(plan) in str(refusal.value) and message in str(refusal.value)


def test_unknown_methods_and_exemplars_are_refused(
    plan: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([str(plan), "-o", str(tmp_path / "all"), "--only", "cheese"]) == 1
    assert "--only: found cheese, expected one of rock, missing" in capsys.readouterr().err
    assert main([str(plan), "-o", str(tmp_path / "all"), "--method", "cheese"]) == 1
    assert "--preset: found cheese, expected one of lattice" in capsys.readouterr().err
    plan.write_text(PLAN.replace('["lattice"]', '["alchemy"]'))
    assert main([str(plan), "-o", str(tmp_path / "all")]) == 1
    assert f"{plan}: methods: found alchemy, expected one of" in capsys.readouterr().err
    plan.write_text(
        PLAN.replace('"lattice"', '"calm"')
        + "[method.calm]\npreset = 'lattice'\nset = ['losses.wavelets.weight=none']\n"
    )
    assert main([str(plan), "-o", str(tmp_path / "all")]) == 1
    assert f"{plan}: method.calm: lattice: losses.wavelets.weight" in capsys.readouterr().err
    assert not (tmp_path / "all").exists()


def test_a_missing_photograph_is_refused_before_anything_is_trained(
    plan: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    calls = in_process(monkeypatch)
    photo = tmp_path / "nowhere.png"
    photo.unlink()
    assert main([str(plan), "-o", str(tmp_path / "all")]) == 1
    said = capsys.readouterr().err
    assert f"{plan}: exemplar missing: photo: found no file {photo}" in said and not calls
