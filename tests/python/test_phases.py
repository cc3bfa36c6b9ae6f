"""solidtex-train --phases: labels read, trained, exported, baked and measured; refusals."""

import json
import os
import signal
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from PIL import Image

import solidtex
from solidtex_export.analysis.grain import channel_axes, whiten
from solidtex_export.commands import export, measure, train
from solidtex_export.generators.lattice import LatticeGenerator
from solidtex_export.generators.slices import LatticeSlices
from solidtex_export.images.file_kinds import ExemplarError
from solidtex_export.images.labels import load_labels
from solidtex_export.measuring.volumes import read_volume
from solidtex_export.measuring.voxels import VolumeError
from solidtex_export.training.phases import PhaseTraining, fitting_shift, holding
from solidtex_export.training.resolve import Request, load_exemplars

REPOSITORY = Path(__file__).resolve().parents[2]
BAKE = Path(os.environ.get("SOLIDTEX_BUILD", REPOSITORY / "build")) / "bin" / "solidtex-bake"


QUICK = ["--without", "permeability", "--without", "diffusivity", "--representative", "none"]


def section(values: list[int], seed: int = 0, side: int = 48) -> np.ndarray:
    """Labels in blobs of about 6 pixels; the first has 30 %."""
    ndimage = pytest.importorskip("scipy.ndimage")
    noise = np.random.default_rng(seed).standard_normal((side, side))
    smooth = ndimage.gaussian_filter(noise, 2, mode="wrap")
    limits = np.quantile(smooth, np.linspace(0.3, 1, len(values))[:-1])
    return np.array(values, np.uint8)[np.searchsorted(limits, smooth)]


def save(path: Path, labels: np.ndarray) -> Path:
    Image.fromarray(labels).save(path)
    return path


@pytest.mark.parametrize("values", [[0, 1], [0, 255], [0, 1, 2], [3, 7, 90, 200]])
def test_labels_become_indicators(tmp_path: Path, values: list[int]) -> None:
    labels = section(values)
    (found,) = load_labels([save(tmp_path / "a.png", labels)], 999, 8, None, ())
    assert found.channels == tuple(f"phase.{value}" for value in values)
    assert found.color_space == "data"
    for value, plane in zip(values, found.image.numpy(), strict=True):
        assert np.array_equal(plane, labels == value)
    assert f"0 is phase.0 ({100 * (labels == 0).mean():.1f} %)" in found.notes[0] or values[0]
    assert "labels of phases" in found.notes[0]


def test_the_entries_of_a_palette_are_labels(tmp_path: Path) -> None:
    labels = section([0, 1, 2])
    image = Image.fromarray(labels).convert("P")
    image.putpalette([0, 0, 0, 200, 30, 30, 30, 60, 220])
    image.save(tmp_path / "a.png")
    assert Image.open(tmp_path / "a.png").mode == "P"
    (found,) = load_labels([tmp_path / "a.png"], 999, 8, None, ("pore", "binder", "particle"))
    assert found.channels == ("phase.pore", "phase.binder", "phase.particle")
    assert np.array_equal(found.image.numpy().argmax(0), labels)


def test_labels_outside_the_crop_do_not_count(tmp_path: Path) -> None:
    labels = section([0, 1])
    labels[-8:] = 255  # a scale bar
    path = save(tmp_path / "bar.png", labels)
    (cropped,) = load_labels([path], 256, 32, (0, 0, 48, 40), ("pore", "grain"))
    assert cropped.channels == ("phase.pore", "phase.grain")
    with pytest.raises(ExemplarError, match="with 3 labels"):
        load_labels([path], 256, 32, None, ("pore", "grain"))


def test_reduced_labels_keep_their_shares(tmp_path: Path) -> None:
    path = save(tmp_path / "a.png", section([0, 9]))
    (found,) = load_labels([path], 24, 8, None, ("pore", "grain"))
    assert found.channels == ("phase.pore", "phase.grain") and found.image.shape == (2, 24, 24)
    assert torch.allclose(found.image.sum(0), torch.ones(24, 24))
    assert float(found.image[0].mean()) == pytest.approx(0.3, abs=0.01)
    assert "--resolution 48 keeps" in found.notes[1]


@pytest.mark.parametrize(
    ("images", "names", "message"),
    [
        ([section([0, 1, 2])], ("pore", "grain"),
         "--phase-names: found 2 (pore,grain) for {0} with 3 labels 0 (30 %), 1 (35 %), 2 (35 %),"
         " expected one for each label; give 3 names, or merge stray labels"),
        ([section([0, 1, 2]), section([0, 2])], (),
         "{1}: found no pixel of the label 1, which {0} has, expected every phase in every"),
        ([section([0, 1]), section([0, 1, 2])], (),
         "{0}: found no pixel of the label 2, which {1} has"),
        ([np.arange(2304, dtype=np.uint8).reshape(48, 48)], (),
         "{0}: found 256 values, 0 ... 255, expected labels of 2 to 8 phases; segment"),
        ([np.full((48, 48), 4, np.uint8)], (), "{0}: found the label 4 everywhere, expected two"
         " or more phases; check"),
        ([np.stack([section([0, 1]), section([0, 1], 1), section([0, 1], 2)], 2)], (),
         "{0}: found color, expected labels of phases: one channel of integers; export them"),
        ([section([0, 1]), section([0, 255])], (),
         "{0}: found the labels 0, 1, while {1} has 0, 255, expected the same number for a phase"),
        ([section([0, 1])], ("pore", "pore"), "--phase-names: found a name twice in pore,pore"),
        ([section([0, 1])], ("pore", "no name"),
         "--phase-names: found 'no name' in pore,no name, expected names of letters, digits, _,"),
        ([section([0, 1])], ("", "grain"), "--phase-names: found '' in ,grain, expected names of"),
        ([section([0, 1])], ("pore/1", "grain"), "--phase-names: found 'pore/1' in pore/1,grain"),
    ],
)  # fmt: skip
def test_labels_that_are_refused(
    tmp_path: Path, images: list[np.ndarray], names: tuple[str, ...], message: str
) -> None:
    paths = [save(tmp_path / f"{i}.png", image) for i, image in enumerate(images)]
    with pytest.raises(ExemplarError) as caught:
        load_labels(paths, 999, 8, None, names)
    assert str(caught.value).startswith(message.format(*paths))


def test_negative_labels_are_refused(tmp_path: Path) -> None:
    tifffile = pytest.importorskip("tifffile")
    path = tmp_path / "a.tif"
    tifffile.imwrite(path, section([0, 1]).astype(np.int16) - 1)
    with pytest.raises(ExemplarError) as caught:
        load_labels([path], 999, 8, None, ())
    assert str(caught.value).startswith(f"{path}: found the label -1, expected labels from 0 on")


def test_images_of_labels_without_the_option_name_it(tmp_path: Path, capfd) -> None:
    path = save(tmp_path / "a.png", section([0, 1]))
    assert train.main([str(path), "-o", str(tmp_path / "r"), "--steps", "1"]) == 1
    assert "--phases as phases with sharp borders" in capfd.readouterr().err


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--phase-names", "a,b"], "--phase-names: found without --phases"),
        (["--phases", "--range", "auto"], "--phases: found together with --range"),
        (["--phases", "--estimate", "height"], "--phases: found together with --estimate"),
        (["--phases", "--color-space", "linear"], "--phases: found together with --color-space"),
        (["--phases", "--preset", "sampler"], "generator.kind: found sampler, expected lattice"),
    ],
)
def test_options_that_are_refused(tmp_path: Path, capfd, options: list[str], message: str) -> None:
    path = save(tmp_path / "a.png", section([0, 1]))
    try:
        code = train.main([str(path), "-o", str(tmp_path / "r"), "--steps", "1", *options])
    except SystemExit as stopped:
        code = stopped.code
    assert code in (1, 2) and message in capfd.readouterr().err


@pytest.mark.parametrize("fractions", [[0.2, 0.8], [0.01, 0.69, 0.3], [0.4, 0.1, 0.3, 0.05, 0.15]])
@pytest.mark.parametrize("scale", [1e-3, 1.0, 100.0])
def test_shifted_logits_have_the_fractions(fractions: list[float], scale: float) -> None:
    logits = torch.randn(len(fractions), 20000, generator=torch.Generator().manual_seed(3))
    logits = logits * scale + scale * torch.arange(len(fractions))[:, None]
    shift = fitting_shift(logits, torch.tensor(fractions))
    phases = (logits + shift[:, None]).argmax(0)
    found = torch.bincount(phases, minlength=len(fractions)) / len(phases)
    assert found.tolist() == pytest.approx(fractions, abs=1e-3)


@pytest.mark.parametrize(
    ("blur", "direction"), [((2.0, 2.0), None), ((2.0, 2.8), "rows"), ((3.0, 2.0), "columns")]
)
def test_a_section_with_a_direction_is_told(blur, direction: str | None, tmp_path: Path) -> None:
    ndimage = pytest.importorskip("scipy.ndimage")
    noise = ndimage.gaussian_filter(np.random.default_rng(5).normal(size=(192, 192)), blur)
    path = save(tmp_path / "a.png", (noise > 0.05).astype(np.uint8))
    request = Request(photos=(path,), directions="xyz", maps=({},), phases=True)
    (exemplar,) = load_exemplars(request, 192, 64)
    told = [note for note in exemplar.notes if "times as long along" in note]
    assert [f"as long along {direction} " in note for note in told] == [True] * bool(direction)
    (exemplar,) = load_exemplars(replace(request, directions="xy"), 192, 64)
    assert not any("times as long" in note for note in exemplar.notes)


def test_slices_are_drawn_until_the_fractions_are_sure(tmp_path: Path, monkeypatch) -> None:
    module = "solidtex_export.training.phases"
    monkeypatch.setattr(f"{module}.STANDARD_ERROR", 0.01)
    torch.manual_seed(4)
    (exemplar,) = load_labels([save(tmp_path / "a.png", section([0, 1, 2]))], 999, 8, None, ())
    mean, basis = channel_axes([exemplar])
    generator = LatticeGenerator(levels=3, noise_channels=1, out_channels=3, softmax=True).eval()
    phases = PhaseTraining(generator, [exemplar], mean, basis)

    def goes_on(drawn: int, needed: int) -> bool:
        return drawn < needed

    with monkeypatch.context() as patch:
        patch.setattr(f"{module}.MOST_SLICES", 96)
        assert phases.hold_fractions("xyz", 16, 1000, goes_on) > 0.012
    assert phases.hold_fractions("xyz", 16, 1, goes_on) > 0.012
    assert phases.hold_fractions("xyz", 16, 1000, goes_on) <= 0.012
    source = LatticeSlices(generator)
    with torch.no_grad():
        drawn = [generator.colors(source.draw("xyz"[i % 3], 16, 1)) for i in range(400)]
    found = torch.bincount(torch.cat(drawn).argmax(1).flatten(), minlength=3) / (400 * 16**2)
    # Both means have a standard error of about 1 %.
    assert found.tolist() == pytest.approx(phases.fractions.tolist(), rel=0.04)


def test_ctrl_c_stops_while_fractions_are_held(tmp_path: Path, monkeypatch, capfd) -> None:
    photo = save(tmp_path / "a.png", section([0, 255]))
    options = ["--phases", "--steps", "2", "--size", "32", "--set", "generator.sizes.levels=3"]

    def run(name: str) -> tuple[int, dict]:
        code = train.main([str(photo), *options, "-o", str(tmp_path / name)])
        return code, torch.load(tmp_path / name / "checkpoint.pt", weights_only=True)

    _, whole = run("whole")
    hold = PhaseTraining.hold_fractions

    def interrupted(self, directions, size, steps, goes_on) -> float | None:
        def press_ctrl_c(drawn: int, needed: int) -> bool:
            if drawn == 5:
                signal.raise_signal(signal.SIGINT)
            assert drawn <= 5
            return goes_on(drawn, needed)

        return hold(self, directions, size, steps, press_ctrl_c)

    with monkeypatch.context() as patch:
        patch.setattr(PhaseTraining, "hold_fractions", interrupted)
        code, stopped = run("stopped")
    assert code == 130 and not stopped["finished"]
    error = capfd.readouterr().err
    assert "stopped: after the steps the fractions of phases are held" in error
    assert "stopped at step 2, before its fractions were held; the same command resumes" in error
    assert export.main([str(tmp_path / "stopped"), "-o", str(tmp_path / "a.solidtex")]) == 0
    error = capfd.readouterr().err
    assert (
        "not finished, it stopped at step 2 before the fractions of its phases were held" in error
    )
    code, resumed = run("stopped")
    assert code == 0 and resumed["finished"]
    assert torch.equal(resumed["generator"]["color_mean"], whole["generator"]["color_mean"])
    assert not torch.equal(stopped["generator"]["color_mean"], whole["generator"]["color_mean"])


def test_what_is_said_while_fractions_are_held() -> None:
    assert holding(0, 96, 0.1).endswith("fractions of phases: slice 0 of 96")
    assert holding(117, 768, 39.0).endswith("slice 117 of 768, 3.6 min left")


class SureSlices:
    """Logits of slices where every voxel is sure of the first phase."""

    def __init__(self, side: int) -> None:
        self.logits = torch.zeros(1, 2, side, side)
        self.logits[:, 0] = 60
        self.logits.requires_grad_()

    def draw(self, direction: str, size: int, batch: int) -> torch.Tensor:
        return self.logits

    def view(self, direction: str) -> str:
        return direction


def test_a_solid_of_one_phase_has_a_gradient(tmp_path: Path) -> None:
    (exemplar,) = load_labels([save(tmp_path / "a.png", section([0, 1]))], 999, 8, None, ())
    mean, basis = channel_axes([exemplar])
    generator = LatticeGenerator(levels=2, out_channels=2, softmax=True)
    source = SureSlices(16)
    slices = PhaseTraining(generator, [exemplar], mean, basis).probabilities_of(source)
    target = whiten(exemplar.image[:, :16, :16], mean, basis)
    (slices.draw("x", 16, 1) - target).square().sum().backward()
    assert source.logits.grad is not None
    assert (source.logits.grad[:, 0] > 0).all() and (source.logits.grad[:, 1] < 0).all()


@pytest.fixture(scope="module")
def model(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Three phases, trained for a few steps on sections of two directions."""
    folder = tmp_path_factory.mktemp("phases")
    photos = [str(save(folder / f"{i}.png", section([0, 7, 255], i, 64))) for i in (1, 2)]
    small = ["--set", "generator.sizes.levels=3", "--preset", "lattice"]
    arguments = [*photos, "--phases", "--phase-names", "pore,clay,grain", "--steps", "60"]
    assert train.main([*arguments, "--size", "48", *small, "-o", str(folder / "result")]) == 0
    assert export.main([str(folder / "result"), "-o", str(folder / "rock.solidtex")]) == 0
    return folder / "rock.solidtex"


def test_the_engine_returns_probabilities_with_the_fractions(model: Path) -> None:
    with solidtex.Texture(model) as texture:
        assert list(texture.channels) == ["phase.pore", "phase.clay", "phase.grain"]
        values = texture.eval_box((0, 0, 0), (96, 96, 96))
        apart = texture.eval_box((31, 17, 50), (9, 11, 6))
    assert np.array_equal(apart, values[31:40, 17:28, 50:56])
    assert values.min() >= 0 and np.allclose(values.sum(3), 1, atol=1e-6)
    found = np.bincount(values.argmax(3).reshape(-1), minlength=3) / values[..., 0].size
    assert found == pytest.approx([0.3, 0.35, 0.35], abs=0.03)  # the volume's own chance


def test_seeds_have_the_fractions_within_a_percent(model: Path) -> None:
    counts = np.zeros(3)
    for seed in range(1, 9):
        with solidtex.Texture(model, seed) as texture:
            phases = texture.eval_box((0, 0, 0), (96, 96, 96)).argmax(3)
        counts += np.bincount(phases.reshape(-1), minlength=3)
    # Slices had the fractions within a standard error of 0.3 %; eight volumes have one of 0.2 %.
    assert counts / counts.sum() == pytest.approx([0.3, 0.35, 0.35], rel=0.01)


@pytest.mark.parametrize("name", ["a.npy", "a.nrrd", "a.vti", "a.tif", "a.ome.tif", "a.nhdr"])
def test_labels_open_elsewhere(model: Path, tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    size = ["--size", "20,16,12"]
    options = ["--labels", "--voxel-size", "2.25um", *size, "-o", str(path)]
    options += ["--format", "imagej"] if name == "a.tif" else []
    subprocess.run([BAKE, model, *options], check=True, capture_output=True)
    with solidtex.Texture(model) as texture:
        expected = texture.eval_box((0, 0, 0), (20, 16, 12)).argmax(3)
    found, edge = opened(path)
    assert found.dtype == np.uint8 and np.array_equal(found, expected)
    assert edge is None or edge == pytest.approx(2.25, rel=1e-3)


def opened(path: Path) -> tuple[np.ndarray, float | None]:
    """Labels [x, y, z] and the edge of a voxel, by the library that users of the format have."""
    if path.suffix == ".npy":
        return np.load(path)[..., 0], None
    if path.suffix in (".nrrd", ".nhdr"):
        itk = pytest.importorskip("SimpleITK")
        image = itk.ReadImage(str(path))
        return itk.GetArrayFromImage(image).transpose(2, 1, 0), image.GetSpacing()[0]
    if path.suffix == ".vti":
        pyvista = pytest.importorskip("pyvista")
        grid = pyvista.read(path)
        return np.asarray(grid["label"]).reshape(grid.dimensions, order="F"), grid.spacing[2]
    tifffile = pytest.importorskip("tifffile")
    with tifffile.TiffFile(path) as file:
        pages = file.asarray().transpose(2, 1, 0)
        if file.imagej_metadata:
            assert file.imagej_metadata["max"] == 2  # shown as white
            return pages, file.imagej_metadata["spacing"]
        assert file.is_ome
        return pages, float(file.ome_metadata.split('PhysicalSizeZ="')[1].split('"')[0])


def test_a_store_of_probabilities_is_measured(model: Path, tmp_path: Path) -> None:
    pytest.importorskip("zarr", minversion="3")
    store = tmp_path / "a.zarr"
    options = ["--size", "130,20,24", "--voxel-size", "2.25um", "-o", str(store)]
    bake = [BAKE, model, *options, "--shard-size", "128"]  # chunks of a shard have 64 voxels
    subprocess.run([*bake, "--shard", "1/2"], check=True, capture_output=True)
    with pytest.raises(VolumeError, match="found 1 of 2 shards"):
        read_volume(store)
    subprocess.run(bake, check=True, capture_output=True)
    with solidtex.Texture(model) as texture:
        expected = texture.eval_box((0, 0, 0), (130, 20, 24)).argmax(3)
    found = read_volume(store)
    assert np.array_equal(found.values, expected)
    assert found.phases == ("pore", "clay", "grain")
    assert found.voxel is not None and found.voxel.cubic("a").meters == pytest.approx(2.25e-6)


def test_a_model_of_phases_is_measured(model: Path, tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    report = tmp_path / "report.json"
    options = ["--size", "24", "--voxel-size", "2um", "--axes", "z", "--representative", "none"]
    assert measure.main([str(model), "-o", str(report), *options]) == 0
    found = json.loads(report.read_text())
    assert set(found["phases"]) == {"0", "1", "2"} and found["axes"]["z"]["permeability_mD"] >= 0


@pytest.mark.parametrize(
    ("name", "options"),
    [
        ("a.nrrd", []),
        ("a.nhdr", []),
        ("a.ome.tif", []),
        ("a.tif", ["--format", "imagej"]),
        ("a.nrrd", ["--labels"]),
        ("a.ome.tif", ["--labels"]),
        ("a.tif", ["--labels", "--format", "imagej"]),
    ],
)
def test_a_bake_is_measured_as_the_model_is(
    model: Path, tmp_path: Path, name: str, options: list[str]
) -> None:
    bake = [BAKE, model, "--size", "24", "-o", tmp_path / name, *options]
    subprocess.run(bake, check=True, capture_output=True)
    reports = []
    for volume in (model, tmp_path / name):
        report = tmp_path / f"{volume.stem}.json"
        options = ["--size", "24", "--voxel-size", "2um", *QUICK]
        assert measure.main([str(volume), "-o", str(report), *options]) == 0
        reports.append(json.loads(report.read_text()))
    assert reports[0]["phases"] == reports[1]["phases"]
    assert reports[1]["phase_titles"] == {"0": "pore (0)", "1": "clay (1)", "2": "grain (2)"}
    assert "labels pore (0), clay (1), grain (2)" in reports[1]["notes"][-1]


@pytest.mark.parametrize(
    ("name", "options", "message"),
    [
        ("granite-grey", [], "--labels: granite-grey has the channels albedo.r, albedo.g"),
        ("", ["--channels", "phase.clay"], "--channels excludes --labels"),
        *(
            (
                "",
                ["-o", f"a{suffix}"],
                f"--labels: found it with -o a{suffix}, expected a format"
                " of whole numbers: .npy, .nrrd, .nhdr, .raw, .vti, .tif, or --slices png",
            )
            for suffix in (".zarr", ".vol", ".vdb", ".png", ".dds", ".ktx2")
        ),
    ],
)
def test_labels_that_cannot_be_baked(
    model: Path, tmp_path: Path, name: str, options: list[str], message: str
) -> None:
    output = [] if "-o" in options else ["-o", "a.npy"]
    command = [BAKE, name or model, "--labels", "--size", "4", *output, *options]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode != 0 and message in done.stderr
    assert not list(tmp_path.iterdir())
