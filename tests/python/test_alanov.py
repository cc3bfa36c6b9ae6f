"""The models of Alanov et al. 2019: networks, losses, training, export."""

from __future__ import annotations

import itertools
import json
import os
import subprocess
from pathlib import Path

import numpy as np
import pytest
import torch
from small_spaces import run, save_photos, value
from torch.nn.utils.parametrize import is_parametrized

from solidtex_export.commands import export_space, measure, train_space
from solidtex_export.export.file_format import model_file
from solidtex_export.export.verification import engine
from solidtex_export.generators.regions import Box
from solidtex_export.settings import SettingsError, read_toml, validated
from solidtex_export.spaces import settings
from solidtex_export.spaces.alanov import losses
from solidtex_export.spaces.alanov.export import waves_of
from solidtex_export.spaces.alanov.materials import random_pair
from solidtex_export.spaces.alanov.networks import (
    CodeDiscriminator,
    Encoder,
    Generator,
    PairDiscriminator,
    PatchDiscriminator,
)
from solidtex_export.spaces.alanov.result import read_alanov
from solidtex_export.spaces.alanov.settings import AlanovRecipe, Crops
from solidtex_export.spaces.alanov.trainer import AlanovTrainer

torch.set_num_threads(1)

REPOSITORY = Path(__file__).resolve().parents[2]
BAKE = Path(os.environ.get("SOLIDTEX_BUILD", REPOSITORY / "build")) / "bin" / "solidtex-bake"
SMALL = {
    "networks": {
        "generator": [6, 5],
        "encoder": [4, 5],
        "patches": [4, 5],
        "pairs": [4, 5],
        "embedding": 6,
        "products": [5],
        "codes": [8],
    },
    "crops": {"size": 16, "batch": 3},
}
NAMES = {2: "alanov-space", 3: "alanov-porous"}


def table(dimensions: int) -> dict:
    presets = Path(settings.__file__).parents[1] / "presets" / "spaces"
    found = read_toml(presets / f"{NAMES[dimensions]}.toml")
    for name, values in SMALL.items():
        found[name] = found[name] | values
    return found | {"code": 3}


def small(dimensions: int) -> AlanovRecipe:
    return validated(AlanovRecipe, table(dimensions), "small")


def save_preset(path: Path, dimensions: int, average: float = 0) -> Path:
    settings = {"average": average} | table(dimensions)
    lines = [f"{k} = {value(v)}" for k, v in settings.items()]
    path.write_text("\n".join(lines))
    return path


def save_volumes(folder: Path) -> list[Path]:
    random = np.random.default_rng(3)
    folder.mkdir()
    paths = [folder / "fine.npy", folder / "coarse.npy"]
    fine = random.random((20, 22, 24)) < 0.3
    coarse = np.kron(random.random((5, 6, 6)) < 0.5, np.ones((4, 4, 4)))
    for path, volume in zip(paths, (fine, coarse), strict=True):
        np.save(path, (255 * volume).astype(np.uint8))
    return paths


@pytest.fixture(params=[2, 3])
def dimensions(request: pytest.FixtureRequest) -> int:
    return int(request.param)


@pytest.fixture
def inputs(tmp_path: Path, dimensions: int) -> list[str]:
    """Photographs or volumes."""
    if dimensions == 2:
        return [str(save_photos(tmp_path / "photos") / "list.csv")]
    return list(map(str, save_volumes(tmp_path / "volumes")))


def begin(inputs: list[str], preset: Path, result: Path, steps: int) -> AlanovTrainer:
    options = ["--preset", str(preset), "--device", "cpu", "--steps", str(steps)]
    arguments = [*inputs, *options, "-o", str(result)]
    trainer = train_space.make_trainer(train_space.parser().parse_args(arguments))
    assert isinstance(trainer, AlanovTrainer)
    return trainer


@pytest.mark.parametrize("name", NAMES.values())
def test_networks_of_the_presets_are_those_of_the_appendix(name: str) -> None:
    recipe = settings.load_space_recipe(name)
    assert isinstance(recipe, AlanovRecipe)
    with torch.device("meta"):
        networks = [
            Generator(recipe),
            PatchDiscriminator(recipe),
            PairDiscriminator(recipe),
        ]
        crops = torch.empty(2, recipe.channels, *[160] * recipe.dimensions)
        patches = networks[1](crops)
        embeddings = networks[2].embed(crops)
        mean, deviation = Encoder(recipe)(crops)
        assert CodeDiscriminator(recipe)(mean).shape == (2, 1)
    side = {2: 5, 3: 7}[recipe.dimensions]
    assert patches.shape == (2, 1, *[side] * recipe.dimensions)
    assert embeddings.shape == (2, recipe.networks.embedding, side**recipe.dimensions)
    assert mean.shape == deviation.shape == (2, recipe.code)
    assert networks[0].levels == {2: 5, 3: 4}[recipe.dimensions]
    if recipe.dimensions == 2:  # equation 12; it counts the transposed convolutions' weights
        count = sum(layer.weight.numel() for layer in networks[0].layers)
        paper = 25600 * (26 + 336) / 2
        assert count == pytest.approx(paper, rel=0.02)


def test_a_crop_of_a_sample_does_not_depend_on_its_size(dimensions: int) -> None:
    """No border: a part of a larger box has the same values."""
    torch.manual_seed(0)
    generator = Generator(small(dimensions)).eval()
    codes = torch.randn(1, 3)
    whole = Box((-5,) * dimensions, (20,) * dimensions)
    part = Box((3, -2, 1)[:dimensions], (14, 9, 10)[:dimensions])
    boxes = generator.boxes(whole)
    z = generator.noise(codes, boxes[0])

    def values(box: Box) -> torch.Tensor:
        x, needed = z, generator.boxes(box)[0]
        for axis, (lo, hi, first) in enumerate(zip(needed.lo, needed.hi, boxes[0].lo, strict=True)):
            x = x.narrow(2 + axis, lo - first, hi - lo)
        return generator.from_noise(x, box)

    large = values(whole)
    for axis, (lo, hi) in enumerate(zip(part.lo, part.hi, strict=True)):
        large = large.narrow(2 + axis, lo + 5, hi - lo)
    assert torch.allclose(values(part), large, atol=1e-6)


def test_periodic_part_is_a_sine_of_the_codes_frequencies() -> None:
    recipe = small(2)
    generator = Generator(recipe)
    codes = torch.randn(2, 3)
    z = generator.noise(codes, Box((4, -3), (10, 5)))
    assert z.shape == (2, 3 + 20 + 4, 6, 8)
    assert torch.equal(z[:, :3], codes[:, :, None, None].expand(-1, -1, 6, 8))
    periodic = z[:, 23:]
    # sin(t + d) + sin(t - d) = 2 cos(d) sin(t), along either axis.
    for axis in (0, 1):
        step = generator.angular_frequencies(codes)[..., axis]
        moved = periodic.movedim(2 + axis, 2)
        expected = 2 * torch.cos(step)[:, :, None, None] * moved[:, :, 1:-1]
        assert torch.allclose(moved[:, :, 2:] + moved[:, :, :-2], expected, atol=1e-4)


def test_pair_discriminator_multiplies_all_pairs_of_positions() -> None:
    torch.manual_seed(0)
    judge = PairDiscriminator(small(2)).eval()
    a, b = torch.randn(1, 3, 16, 16), torch.randn(1, 3, 24, 16)
    first, second = judge.embed(a), judge.embed(b)
    logits = judge(a, b)
    assert logits.shape == (1, first.shape[2] + second.shape[2])
    matrix = torch.empty(first.shape[2], second.shape[2])
    for i, j in itertools.product(*map(range, matrix.shape)):
        product = (first[:, :, i] * second[:, :, j])[:, :, None, None]
        hidden = torch.nn.functional.leaky_relu(judge.products[0](product), 0.2)
        matrix[i, j] = judge.products[1](hidden).squeeze()
    expected = torch.cat([matrix.mean(1), matrix.mean(0)])
    assert torch.allclose(logits[0], expected, atol=1e-5)
    swapped = judge(b, a)[0]  # symmetric in its inputs
    assert torch.allclose(swapped, torch.cat([matrix.mean(0), matrix.mean(1)]), atol=1e-5)


def test_discriminators_are_spectrally_normalized() -> None:
    torch.manual_seed(0)
    for judge in (PatchDiscriminator(small(2)), PairDiscriminator(small(3))):
        layers = [m for m in judge.modules() if isinstance(m, torch.nn.Conv2d | torch.nn.Conv3d)]
        largest = [torch.linalg.matrix_norm(m.weight.flatten(1), 2).item() for m in layers]
        free = [i for i, value in enumerate(largest) if value != pytest.approx(1, abs=0.05)]
        assert free == [len(judge.layers) - 1]  # there are at most three
    layers = PatchDiscriminator(AlanovRecipe(dimensions=2)).layers
    assert [i for i, layer in enumerate(layers) if not is_parametrized(layer)] == [2]


def test_losses_are_those_of_section_2() -> None:
    torch.manual_seed(0)
    found = losses.Logits(*(torch.randn(2, n) for n in (4, 4, 4, 6, 6, 1, 1)))
    p = {k: torch.sigmoid(v) for k, v in vars(found).items()}

    def log(x: torch.Tensor) -> torch.Tensor:
        return x.log().mean()

    fake = log(1 - p["prior"]) + log(1 - p["reproduced"])
    expected = {
        losses.patch_discriminator_loss(found): -(log(p["real"]) + fake),
        losses.pair_discriminator_loss(found): -(log(p["real_pairs"]) + log(1 - p["fake_pairs"])),
        losses.code_discriminator_loss(found): -(log(p["prior_codes"]) + log(1 - p["codes"])),
    }
    weights = small(2).losses
    on_fakes = -log(p["prior"]) - log(p["reproduced"])
    expected[losses.generator_loss(found, weights)] = on_fakes - log(p["fake_pairs"])
    expected[losses.encoder_loss(found, weights)] = -log(p["codes"]) - log(p["fake_pairs"])
    for loss, wanted in expected.items():
        assert float(loss) == pytest.approx(float(wanted), rel=1e-5)


def test_every_network_learns_from_its_own_loss(
    inputs: list[str], tmp_path: Path, dimensions: int
) -> None:
    preset = save_preset(tmp_path / "preset.toml", dimensions)
    trainer = begin(inputs, preset, tmp_path / "result", 2)
    before = {n: [p.clone() for p in w.parameters()] for n, w in trainer.networks.items()}
    run(trainer, 2)
    for name, network in trainer.networks.items():
        for (key, parameter), old in zip(network.named_parameters(), before[name], strict=True):
            if not key.endswith("bias"):  # equal logits give the last one no gradient
                assert not torch.equal(parameter, old), (name, key)


def test_patch_loss_does_not_reach_the_encoder(inputs: list[str], tmp_path: Path) -> None:
    """Equation 8 has L_z and L_xx alone, though L_x judges G of the encoder's codes."""
    dims = 2 if inputs[0].endswith(".csv") else 3
    trainer = begin(inputs, save_preset(tmp_path / "p.toml", dims), tmp_path / "result", 2)
    found = trainer._logits()
    bias = trainer.encoder.last.bias
    assert isinstance(bias, torch.Tensor)
    trainer._differentiate("encoder", losses.encoder_loss(found, trainer.recipe.losses))
    given = bias.grad
    assert given is not None
    own = losses.judged_real(found.codes) + losses.judged_real(found.fake_pairs)
    (expected,) = torch.autograd.grad(own, bias, retain_graph=True)
    (further,) = torch.autograd.grad(losses.judged_real(found.reproduced), bias)
    assert torch.allclose(given, expected)
    assert further.abs().max() > 0


@pytest.mark.parametrize("average", [0, 0.5])
def test_an_interrupted_training_resumes_to_the_same_bits(
    inputs: list[str], tmp_path: Path, dimensions: int, average: float
) -> None:
    preset = save_preset(tmp_path / "preset.toml", dimensions, average)
    whole = run(begin(inputs, preset, tmp_path / "whole", 4), 4)
    run(begin(inputs, preset, tmp_path / "parts", 4), 2)
    parts = run(begin(inputs, preset, tmp_path / "parts", 4), 4)
    for name, network in whole.networks.items():
        again = parts.networks[name].state_dict()
        for key, tensor in network.state_dict().items():
            assert torch.equal(tensor, again[key]), (name, key)
    assert torch.equal(whole.material_codes(), parts.material_codes())
    for mine, other in zip(whole._shown(), parts._shown(), strict=True):
        assert all(map(torch.equal, mine.parameters(), other.parameters()))
    assert (tmp_path / "whole" / "preview.png").is_file()
    config = json.loads((tmp_path / "whole" / "config.json").read_text())
    assert config["kind"] == "alanov"
    assert len(config["photographs"]) == len(whole.textures)


def test_the_model_is_the_moving_average(
    inputs: list[str], tmp_path: Path, dimensions: int
) -> None:
    preset = save_preset(tmp_path / "preset.toml", dimensions, 0.75)
    trainer = begin(inputs, preset, tmp_path / "result", 3)
    expected: list[torch.Tensor] = []
    for step in range(1, 4):
        run(trainer, step)
        now = [p.detach().clone() for p in trainer.generator.parameters()]
        pairs = zip(expected or now, now, strict=True)
        expected = [old + 0.25 * (new - old) for old, new in pairs]
    result = read_alanov(tmp_path / "result")
    for found, wanted in zip(result.generator.parameters(), expected, strict=True):
        assert torch.allclose(found, wanted, atol=1e-6)
    assert torch.equal(result.codes, trainer.material_codes())


def test_a_code_is_exported_as_an_ordinary_model(
    inputs: list[str], tmp_path: Path, dimensions: int
) -> None:
    """The command itself compares the engine with the network, far from the origin too."""
    preset = save_preset(tmp_path / "preset.toml", dimensions)
    trainer = run(begin(inputs, preset, tmp_path / "result", 3), 3)
    path = tmp_path / "model.solidtex"
    name = trainer.textures[1].name
    arguments = [str(tmp_path / "result"), "-o", str(path)]
    assert export_space.main([*arguments, "--material", name]) == 0
    model = model_file.read(path)
    assert {"noise", "conv_transpose3d"} <= {n["op"] for n in model.document["field"]["nodes"]}
    colors, phases = ["albedo.r", "albedo.g", "albedo.b"], ["phase.0", "phase.1"]
    assert model.document["channels"] == {2: colors, 3: phases}[dimensions]
    values = evaluate(path, (-40, 3, -9), (5, 6, 32))
    assert values.std() > 0.01
    if dimensions == 2:
        (waves,) = (n["waves"] for n in model.document["field"]["nodes"] if n["op"] == "periodic")
        assert len(waves) == 5 and waves[4] == [0, 0, 0, 2**30]
        sheet = 2**trainer.generator.levels  # sections of a sheet are one picture
        first = np.arange(-9, 23) // sheet
        for z in range(1, 32):
            same = np.array_equal(values[:, :, z], values[:, :, z - 1])
            assert same == (first[z] == first[z - 1])
    other = ["--code", "0.5,-1,2", "--force", "--phases", "3"]
    assert export_space.main([*arguments, *other]) == 0
    assert not np.array_equal(evaluate(path, (-40, 3, -9), (5, 6, 32)), values)
    for wrong in (["--code", "1,2"], ["--material", "none"], []):
        assert export_space.main([*arguments, *wrong, "--force"]) == 1


def test_a_porous_medium_is_baked_and_measured_as_labels(tmp_path: Path) -> None:
    for name in ("jinja2", "matplotlib", "nrrd", "tifffile"):
        pytest.importorskip(name)
    volumes = list(map(str, save_volumes(tmp_path / "volumes")))
    trainer = run(begin(volumes, save_preset(tmp_path / "p.toml", 3), tmp_path / "result", 3), 3)
    path, box = tmp_path / "model.solidtex", tmp_path / "box.npy"
    arguments = [str(tmp_path / "result"), "-o", str(path), "--material", trainer.textures[0].name]
    assert export_space.main(arguments) == 0
    bake = [str(BAKE), str(path), "--size", "24", "--seed", "1", "--labels", "-o", str(box)]
    subprocess.run(bake, check=True, capture_output=True)
    labels, values = np.load(box).squeeze(), evaluate(path, (0, 0, 0), (24, 24, 24))
    assert np.array_equal(labels, values[..., 1] > values[..., 0])
    assert values.sum(-1) == pytest.approx(1, abs=1e-6)
    parts = ["--without=permeability", "--without=diffusivity", "--representative=none"]
    report = tmp_path / "report.json"
    options = ["--size=24", "--seed=1", "--voxel-size=1um", *parts, "-o", str(report)]
    assert measure.main([str(path), *options]) == 0
    found = json.loads(report.read_text())
    assert "labels are the most probable phase" in found["notes"][0]
    assert 0 < labels.mean() < 1
    assert found["phases"]["1"]["fraction"] == labels.mean()
    source = [str(tmp_path / "result"), "--material", trainer.textures[0].name]
    assert measure.main([*source, *options, "--force"]) == 0
    assert json.loads(report.read_text())["phases"] == found["phases"]
    assert measure.main([source[0], *options, "--force"]) == 1


def evaluate(path: Path, origin: tuple[int, ...], size: tuple[int, ...]) -> np.ndarray:
    with engine.open_model(path, 1) as texture:
        return np.asarray(texture.eval_box(origin, size))


def test_a_picture_lies_upright_in_the_solid() -> None:
    """Columns along x, rows against y: a wave of the generator keeps its directions."""
    generator = Generator(small(2))
    code = torch.randn(3)
    (along_rows, along_columns) = generator.angular_frequencies(code[None])[0, 0].tolist()
    wave = waves_of(generator, code, [0, 0, 0, 0])[0]
    turns = [((w + 2**31) % 2**32 - 2**31) / 2**32 for w in wave]
    expected = [along_columns / (2 * np.pi), -along_rows / (2 * np.pi), 0, 0]
    assert turns == pytest.approx(expected, abs=1e-6)


def test_pairs_of_raw_photographs_are_near_each_other() -> None:
    torch.manual_seed(0)
    rows = torch.arange(200.0)[:, None] + torch.zeros(200, 200)
    image = torch.stack([rows, rows.T])
    far = 0.0
    for _ in range(50):
        a, b = random_pair(image, Crops(size=40, batch=1, pairs="nearby"))
        assert (a[:, 0, 0] - b[:, 0, 0]).abs().max() <= 4
        a, b = random_pair(image, Crops(size=40, batch=1))
        far = max(far, float((a[:, 0, 0] - b[:, 0, 0]).abs().max()))
    assert far > 40


def test_notes_on_volumes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    nrrd = pytest.importorskip("nrrd")
    preset = save_preset(tmp_path / "preset.toml", 3)
    gray = np.random.default_rng(0).random((20, 20, 20)).astype(np.float32)
    labels = (gray > 0.5).astype(np.uint8)
    volumes = {"a": (gray, [2, 2, 2]), "b": (labels, [3, 3, 3]), "flat": (gray, [2, 2, 4])}
    for name, (values, sides) in volumes.items():
        known = {"spacings": sides, "units": ["um"] * 3}
        nrrd.write(str(tmp_path / f"{name}.nrrd"), values, known)

    def train(*names: str) -> tuple[int, str]:
        paths = [str(tmp_path / f"{name}.nrrd") for name in names]
        options = ["--preset", str(preset), "--steps", "1", "--device", "cpu"]
        code = train_space.main([*paths, *options, "-o", str(tmp_path / "-".join(names))])
        return code, capsys.readouterr().err

    code, said = train("a", "b")
    assert code == 0
    assert "a.nrrd: gray values; label 0 is below 0.498" in said and "Otsu" in said
    assert "b.nrrd: labels 0, 1" in said
    assert "volumes have voxels of different sizes: a.nrrd 2 um, b.nrrd 3 um; the model" in said
    assert f"solidtex-export-space {tmp_path / 'a-b'} --material a -o a.solidtex" in said
    code, said = train("a", "flat")
    assert code == 1 and "flat.nrrd: found voxels of 2 x 2 x 4 um, expected cubes" in said
    store = tmp_path / "stores" / "store.zarr"
    store.mkdir(parents=True)
    for folder in (store.parent, store):
        options = ["--preset", str(preset), "-o", str(tmp_path / "no")]
        assert train_space.main([str(folder), *options]) == 1
        assert "store.zarr: found a folder, expected the file" in capsys.readouterr().err


def test_refusals(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    preset = tmp_path / "preset.toml"
    save_preset(preset, 3)
    preset.write_text(preset.read_text().replace("size = 16", "size = 15"))
    with pytest.raises(SettingsError, match=r"crops.size: found 15, expected at least 16"):
        settings.load_space_recipe(str(preset))
    save_preset(preset, 3)
    volumes = {
        "thin.npy": (np.arange(8000).reshape(20, 20, 20) % 2, None),
        "three.npy": (
            np.arange(8000).reshape(20, 20, 20) % 3,
            "found 3 phases with the labels 0, 1, 2, expected 2; merge labels, for",
        ),
        "small.npy": (
            np.arange(3600).reshape(20, 18, 10) % 2,
            "expected at least 16 along each",
        ),
        "one.npy": (np.zeros((20, 20, 20)), "found one label"),
    }
    for name, (volume, message) in volumes.items():
        np.save(tmp_path / name, volume.astype(np.uint8))
        options = [
            "--preset",
            str(preset),
            "--steps",
            "1",
            "-o",
            str(tmp_path / name[:3]),
        ]
        code = train_space.main([str(tmp_path / name), *options, "--device", "cpu"])
        assert code == (1 if message else 0)
        assert (message or "") in capsys.readouterr().err
    assert export_space.main([str(tmp_path / "none"), "-o", "x.solidtex"]) == 1
