"""solidtex-eval: models and images in, JSON and report out, refusals."""

from __future__ import annotations

import hashlib
import json
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
import torch
from PIL import Image
from textures_2d import blobs, shuffled, tiled

from solidtex import Texture
from solidtex_export.commands import evaluate as command
from solidtex_export.evaluation import subjects
from solidtex_export.evaluation.comparison import Settings
from solidtex_export.evaluation.evaluate import evaluate
from solidtex_export.evaluation.subjects import Subject, SubjectError, View, compared_views
from solidtex_export.export import random_models
from solidtex_export.export.file_format import model_file
from solidtex_export.images.exemplar import Exemplar

MODELS = Path(__file__).resolve().parents[2] / "models"
METRICS = {"binary_patterns", "autocorrelation", "fdmse", "sliced_wasserstein", "spectrum"}


@pytest.fixture(autouse=True)
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    """Tests need no large cubes and maps."""
    monkeypatch.setattr(subjects, "BLOCK", 64)
    monkeypatch.setattr("solidtex_export.evaluation.evaluate.COPY_SIDE", 32)


def save(picture: np.ndarray, path: Path) -> Path:
    path.parent.mkdir(exist_ok=True)
    Image.fromarray(np.rint(picture * 255).astype(np.uint8)).save(path)
    return path


@pytest.fixture
def exemplar(tmp_path: Path) -> Path:
    return save(blobs(1, 130, 200), tmp_path / "exemplar.png")


class Tags(HTMLParser):
    """What a report is made of."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.images: list[dict[str, str | None]] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag == "img":
            self.images.append(dict(attrs))
        elif tag != "meta":
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


def test_the_sheet_shows_the_exemplar_beside_slices(tmp_path: Path, exemplar: Path) -> None:
    model, made = MODELS / "paint-rusted.solidtex", tmp_path / "sheet.png"
    roughness = save(blobs(2, 130, 200)[..., :1].repeat(3, axis=2), tmp_path / "roughness.png")
    arguments = [str(model), str(exemplar), "--map", f"roughness={roughness}", "--size", "64"]
    assert command.main([*arguments, "--resolution", "130", "--sheet", str(made)]) == 0
    with Image.open(made) as image:
        sheet = np.asarray(image, np.float32) / 255
    columns, rows = 5, 2  # exemplar, x, y, z, oblique; color and the map that both have
    assert sheet.shape == (64 * rows + 4, 64 * columns + 4 * (columns - 1), 3)
    assert np.abs(sheet[:64, :64] - blobs(1, 130, 200)[:64, :64]).max() < 0.005
    views = subjects.from_model(model, 128, 0, dict.fromkeys("xyz", 0)).views
    for column, view in enumerate(views, start=1):
        cut = view.pictures[0][:64, :64].clip(0, 1)
        shown = sheet[:64, 68 * column : 68 * column + 64]
        assert np.abs(shown - cut[..., :3]).max() < 0.005 and shown.std() > 0.05
    assert command.main([*arguments, "--sheet", str(made)]) != 0  # it exists


def test_a_model_is_evaluated_in_all_directions(exemplar: Path, tmp_path: Path) -> None:
    report, figures = tmp_path / "report.html", tmp_path / "report.json"
    arguments = [str(MODELS / "stone-grey.solidtex"), str(exemplar), "--size", "48", "--crops", "4"]
    assert command.main([*arguments, "-o", str(report), "--json", str(figures)]) == 0
    document = json.loads(figures.read_text(), parse_constant=pytest.fail)
    distances = document["distances"]["albedo"]
    assert distances["views"].keys() == {"x", "y", "z", "oblique"}
    assert distances["overall"].keys() == METRICS
    values = [view["fdmse"]["value"] for view in distances["views"].values()]
    assert distances["overall"]["fdmse"]["value"] == pytest.approx(np.mean(values))
    assert distances["overall"]["binary_patterns"]["multiple"] > 1.5  # it is another material
    assert not document["repetition"]["block"]["repeats"]
    assert not document["repetition"]["far blocks"]["repeats"]
    assert document["exemplars"][0]["file"] == "exemplar.png"

    page = Tags(report.read_text())
    assert not page.open
    assert all(image["src"].startswith("data:image/png;base64,") for image in page.images)
    captions = {image["alt"] for image in page.images}
    assert {"exemplar", "normal to x", "oblique"} <= captions and len(page.images) == 11
    assert "http" not in report.read_text()


def test_the_rectangle_of_the_training_is_cut_from_its_own_photograph_alone(
    exemplar: Path, tmp_path: Path
) -> None:
    """The result folder's exemplar-0.png shows that rectangle already."""
    cut = save(blobs(1, 130, 200)[20:110, 10:110], tmp_path / "exemplar-0.png")
    sha256 = hashlib.sha256(exemplar.read_bytes()).hexdigest()
    training = {"crop": [10, 20, 100, 90], "exemplars": [{"sha256": sha256}]}
    args = command.make_parser().parse_args(["mine.solidtex", "exemplar.png"])
    own, other = (command.load(path, {}, args, training).image for path in (exemplar, cut))
    assert own.shape == (3, 90, 100)
    assert torch.equal(own, other)


def test_images_of_other_programs_are_compared_in_the_same_way(
    exemplar: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    good = save(blobs(2), tmp_path / "theirs" / "a.png").parent
    save(blobs(3), good / "b.png")
    bad = save(shuffled(blobs(2)), tmp_path / "noise.png")
    copy = save(tiled(blobs(1, 130, 200)), tmp_path / "tiled.png")
    slices = [f"--slices=good={good}", f"--slices=bad={bad}", f"--slices=copy={copy}"]
    figures = tmp_path / "report.json"
    assert command.main([str(exemplar), *slices, "--size=64", "--json", str(figures)]) == 0
    document = json.loads(figures.read_text())
    views = document["distances"]["albedo"]["views"]
    for metric in METRICS:
        assert views["good"][metric]["multiple"] < 2.5
        assert views["bad"][metric]["multiple"] > 2.5
    copying = document["copying"]
    assert copying["views"]["good"] < 0.3 and copying["views"]["copy"] > 0.85
    assert document["repetition"]["copy"]["repeats"]
    assert not document["repetition"]["good"]["repeats"]
    assert "LBP distance" in capsys.readouterr().out


def test_maps_are_compared_each_and_together(tmp_path: Path) -> None:
    color, roughness = blobs(1, 130, 200), blobs(1, 130, 200)[..., :1]
    same = np.concatenate([color, roughness], axis=2)
    moved = np.concatenate([color, np.roll(roughness, 20, axis=1)], axis=2)
    channels = ("albedo.r", "albedo.g", "albedo.b", "roughness")
    image = torch.from_numpy(same).permute(2, 0, 1)
    exemplar = Exemplar("e.png", "", image, channels)
    views = [View("same", [same], 0), View("moved", [moved], 0), View("free", [moved], None)]
    distances = evaluate(Subject("s", channels, views), [exemplar], Settings(64)).document[
        "distances"
    ]
    assert distances.keys() == {"albedo", "roughness", "all channels"}
    assert distances["albedo"]["views"].keys() == {"same", "moved"}
    for metric in METRICS:
        alone = [distances["roughness"]["views"][v][metric]["value"] for v in ("same", "moved")]
        assert alone[1] < 2 * alone[0] + 0.02, metric
    joint = [distances["all channels"]["views"][v]["sliced_wasserstein"] for v in ("same", "moved")]
    assert joint[1]["value"] > 1.5 * joint[0]["value"]  # it alone sees that maps are not registered


def test_linear_colors_are_compared_as_displayed() -> None:
    values = np.array([[[0.2140, 0.5]]], dtype=np.float32)
    shown = subjects._displayed(values, ("albedo.r", "roughness"))
    assert shown[0, 0].tolist() == pytest.approx([0.5, 0.5], abs=1e-3)


def test_axis_slices_are_oriented_as_in_training() -> None:
    model = MODELS / "wood-zebrano.solidtex"
    subject = subjects.from_model(model, 48, 5, {"x": 0, "y": 0, "oblique": 0})
    views = {view.name: view for view in subject.views}
    assert views["z"].exemplar is None and views["x"].exemplar == 0
    rng = np.random.default_rng(5)
    origin = rng.integers(-subjects.FAR, subjects.FAR, 3)
    with Texture(model, 5) as texture:  # normal to x: y to the right, z upwards
        corner = texture.eval_box((origin + np.array([0, 0, 47])).tolist(), (1, 1, 1))
    assert np.array_equal(views["x"].pictures[0][0, 0], corner[0, 0, 0])


def test_oblique_slices_with_grain_contain_z() -> None:
    rng = np.random.default_rng(0)
    assert all(down.tolist() == [0, 0, -1] for _, down in subjects._oblique_planes("z", rng))
    free = subjects._oblique_planes(None, rng)
    for right, down in free:
        assert abs(right @ down) < 1e-12 and np.linalg.norm(right) == pytest.approx(1)
    assert len({round(float(down[2]), 6) for _, down in free}) == len(free)


def test_which_views_have_an_exemplar() -> None:
    assert compared_views({}, 1) == {"x": 0, "y": 0, "z": 0, "oblique": 0}
    assert compared_views({"directions": "xy"}, 1) == {"x": 0, "y": 0, "oblique": 0}
    assert compared_views({"directions": "z"}, 1) == {"z": 0}
    assert compared_views({"directions": "xz"}, 2) == {"x": 0, "z": 1}
    with pytest.raises(SubjectError, match="found 2, expected 1, or 3"):
        compared_views({"directions": "xyz"}, 2)


def test_refusals(exemplar: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    model = str(MODELS / "stone-grey.solidtex")
    taken = tmp_path / "taken.html"
    taken.write_text("precious")
    empty = tmp_path / "empty"
    empty.mkdir()
    small = save(blobs(1, 40, 40), tmp_path / "small.png")
    phases = tmp_path / "phases.solidtex"
    rock = random_models.sampler_model(4, 3, 7)
    rock.document["channels"] = ["phase.pore", "phase.grain", "wear"]
    model_file.write(phases, rock)
    cases = [
        ([model, str(exemplar), "-o", str(taken)], "found an existing file"),
        ([model, str(exemplar), "-o", str(tmp_path / "a.pdf")], "expected .html"),
        ([str(exemplar), "--slices", str(empty)], f"{empty}: found no images"),
        ([str(exemplar), "--slices", str(tmp_path / "no.png")], "no such file"),
        ([model, str(small)], f"{small}: found 40 x 40 pixels, expected at least 64 x 64"),
        ([model, str(exemplar), "--inception", str(exemplar)], "no readable weights"),
        ([str(exemplar), str(exemplar)], "exemplar.png"),
        (
            [str(phases), str(exemplar)],
            f"{phases}: found a model of phases, expected one of colors, which solidtex-eval"
            f" compares; solidtex-measure {phases} --exemplar {exemplar} compares phases",
        ),
    ]
    for arguments, message in cases:
        assert command.main(arguments) == 1
        assert message in capsys.readouterr().err
    assert taken.read_text() == "precious"
    for arguments in ([model], [str(exemplar)] * 2 + ["--slices", str(empty)]):
        with pytest.raises(SystemExit) as exit:
            command.main(arguments)
        assert exit.value.code == 2
