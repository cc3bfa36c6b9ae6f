"""Texture spaces: training, resuming, the space file, refusals."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import torch
from PIL import Image
from safetensors import safe_open
from small_spaces import PRESETS, begin, run, save_photos, save_preset

from solidtex_export.commands import export_space, train_space
from solidtex_export.images.file_kinds import ExemplarError
from solidtex_export.settings import SettingsError
from solidtex_export.spaces import settings
from solidtex_export.spaces.colors import color_axes
from solidtex_export.spaces.generators import ConditionedSampler
from solidtex_export.spaces.noise import TiledNoise
from solidtex_export.spaces.photographs import find_sources, load_materials, patches
from solidtex_export.training.divergence import TrainError

torch.set_num_threads(1)


@pytest.fixture
def photos(tmp_path: Path) -> Path:
    return save_photos(tmp_path / "photos")


@pytest.mark.parametrize("name", PRESETS)
def test_an_interrupted_training_resumes_to_the_same_bits_and_is_exported(
    photos: Path, tmp_path: Path, name: str
) -> None:
    preset = save_preset(tmp_path / "preset.toml", name)
    whole = run(begin(photos, preset, tmp_path / "whole", 4), 4)
    run(begin(photos, preset, tmp_path / "parts", 4), 2)
    parts = run(begin(photos, preset, tmp_path / "parts", 4), 4)
    for module in ("generator", "encoder"):
        states = (getattr(t, module).state_dict() for t in (whole, parts))
        for (key, a), b in zip(next(states).items(), next(states).values(), strict=True):
            assert torch.equal(a, b), key
    start = begin(photos, preset, tmp_path / "start", 4).generator.state_dict()
    changed = [k for k, v in whole.generator.state_dict().items() if not torch.equal(v, start[k])]
    assert len(changed) > len(start) / 2
    assert (tmp_path / "whole" / "preview.png").is_file()

    path = tmp_path / "small.solidtex-space"
    assert export_space.main([str(tmp_path / "whole"), "-o", str(path)]) == 0
    with safe_open(path, "np") as file:
        document = json.loads(file.metadata()["solidtex-space"])
        tensors = {k: file.get_tensor(k) for k in file.keys()}  # noqa: SIM118
    assert document["name"] == "small"
    assert [p["license"] for p in document["photographs"]] == ["CC0-1.0"] * 3
    assert tensors["codes"].shape == (3, 4)
    assert all(np.isfinite(v).all() for v in tensors.values())
    assert export_space.main([str(tmp_path / "whole"), "-o", str(path)]) == 1  # exists


@pytest.mark.parametrize("name", ["lattice", "gramgan-space"])
def test_a_gradient_that_is_not_finite_names_its_losses(
    photos: Path, tmp_path: Path, name: str
) -> None:
    trainer = begin(photos, save_preset(tmp_path / "preset.toml", name), tmp_path / "r", 2)
    for parameter in trainer.generator.parameters():
        parameter.data.fill_(torch.nan)
    named = {
        "lattice": "descriptor, wavelets",
        "gramgan-space": "style, adversarial",
    }
    with pytest.raises(
        TrainError, match=f"step 0: found a gradient of {named[name]}.* that is not finite"
    ):
        run(trainer, 2)


@pytest.mark.parametrize(
    ("name", "tolerance"), [("lattice", 0.15), ("sampler", 0.5), ("gramgan-space", 1e-3)]
)
def test_the_encoder_in_the_file_gives_the_trained_codes(
    photos: Path, tmp_path: Path, name: str, tolerance: float
) -> None:
    runtime = pytest.importorskip("onnxruntime")
    preset = save_preset(tmp_path / "preset.toml", name)
    trainer = run(begin(photos, preset, tmp_path / "result", 2), 2)
    path = tmp_path / "small.solidtex-space"
    assert export_space.main([str(tmp_path / "result"), "-o", str(path)]) == 0
    with safe_open(path, "np") as file:
        encoder, codes = file.get_tensor("encoder").tobytes(), file.get_tensor("codes")
    material = trainer.materials[1]
    inputs = patches(material.image, 128, 6)
    if name == "gramgan-space":
        inputs = material.restored(inputs.transpose(0, 1)).transpose(0, 1)
    found = runtime.InferenceSession(encoder).run(None, {"patches": inputs.numpy()})[0]
    # Ours is stored in 8 and 16 bits, which weighs more where there are only three materials.
    errors = np.linalg.norm(found.mean(0) - codes, axis=1)
    assert errors.argmin() == 1
    assert errors[1] < tolerance * np.linalg.norm(codes[1])


def test_noise_is_standard_normal_and_continuous_across_tiles() -> None:
    torch.manual_seed(0)
    noise = TiledNoise(2, torch.device("cpu"))
    corners = torch.randint(-500, 500, (1, 2, 4000, 3)).float()
    torch.manual_seed(1)
    at = noise(corners)
    torch.manual_seed(1)
    near = noise(corners + 1e-3)
    assert (at - near).abs().max() < 0.02
    assert 0.4 < float(at.std()) < 1.0  # trilinear interpolation lowers it


def test_color_axes_restore_a_photograph_and_begin_with_lightness() -> None:
    torch.manual_seed(0)
    light = torch.rand(1, 40, 50)
    image = 0.2 + 0.5 * light + 0.02 * torch.rand(3, 40, 50)
    mean, basis = color_axes(image)
    y = torch.linalg.solve(basis, (image - mean[:, None, None]).flatten(1))
    assert torch.allclose(basis @ y + mean[:, None], image.flatten(1), atol=1e-5)
    assert torch.corrcoef(torch.stack([y[0], light.flatten()]))[0, 1] > 0.99


def test_horizontal_grain_is_turned_where_no_direction_is_given(photos: Path) -> None:
    stripes = photos / "p2.png"  # along rows
    for upright, same in ((False, True), (True, False)):
        (material,) = load_materials(
            find_sources([stripes]), 256, 128, "photograph", (1.0,), upright
        )
        assert (material.image.shape[1] == 136) == same


def test_round_octaves_are_spread_over_the_ladder() -> None:
    sizes = settings.SamplerSettings(octaves=6, hidden_layers=3, grain=8.0, round_octaves=2)
    base = ConditionedSampler(sizes, code=4, style_width=8).base
    assert base is not None
    # Rotations have columns of length 1; that of z is shorter where an octave is longer.
    assert base[:, :, 2].norm(dim=1).tolist() == pytest.approx([1 / 8, 1 / 8, 1] * 2)
    with pytest.raises(ValueError, match="found 7, expected at most 6, all octaves"):
        settings.SamplerSettings(octaves=6, round_octaves=7)


def test_any_row_that_is_not_learned_can_be_held_out(photos: Path) -> None:
    listed = photos / "list.csv"
    learned = [source.path for source in find_sources([listed])]
    assert [path.name for path in learned] == ["p0.png", "p1.png", "p2.png"]
    held_out = find_sources([listed], learned=learned[:2])
    assert [source.path.name for source in held_out] == ["p2.png", "missing.png"]
    with pytest.raises(ExemplarError, match="expected some that are not learned"):
        find_sources([photos], learned=learned)


def test_refusals(photos: Path, tmp_path: Path) -> None:
    with pytest.raises(SettingsError, match="found nothing-such, expected one of"):
        settings.load_space_recipe("nothing-such")
    bad = tmp_path / "bad.toml"
    bad.write_text(save_preset(tmp_path / "p.toml", "lattice").read_text() + "\nslope = 3")
    with pytest.raises(SettingsError, match="slope"):
        settings.load_space_recipe(str(bad))
    listed = tmp_path / "list.csv"
    listed.write_text("name\nx.png\n")
    found = "list.csv: file: found no such column, but name, expected file and licence"
    with pytest.raises(ExemplarError, match=found):
        find_sources([listed])
    listed.write_text("file,licence,split\nx.png,CC0-1.0,test\n")
    with pytest.raises(ExemplarError, match="rows whose split is train or empty"):
        find_sources([listed])
    (missing,) = find_sources([listed], learned=[])
    with pytest.raises(ExemplarError, match=r"list.csv: file: found no .*x.png, .*--folder"):
        load_materials([missing], 256, 128, "photograph", (1.0,))
    (tmp_path / "empty").mkdir()
    with pytest.raises(ExemplarError, match="found no photograph"):
        find_sources([tmp_path / "empty"])
    small = tmp_path / "small.png"
    Image.open(photos / "p0.png").crop((0, 0, 100, 130)).save(small)
    with pytest.raises(ExemplarError, match="found 100 x 130 pixels, expected at least 128 x 128"):
        load_materials(find_sources([small]), 256, 128, "photograph", (1.0,))
    preset = save_preset(tmp_path / "preset.toml", "henzler-space")
    run(begin(photos, preset, tmp_path / "result", 1), 1)
    other = save_preset(tmp_path / "other.toml", "sampler")
    assert train_space.main(
        [str(photos / "list.csv"), "--preset", str(other), "--steps", "1", "-o",
         str(tmp_path / "result")]
    ) == 1  # fmt: skip
    (tmp_path / "result" / "checkpoint.pt").write_bytes(b"damaged")
    output = str(tmp_path / "x.solidtex-space")
    assert export_space.main([str(tmp_path / "result"), "-o", output]) == 1
    assert not Path(output).exists()


def test_two_processes_train_one_space(photos: Path, tmp_path: Path) -> None:
    preset = save_preset(tmp_path / "preset.toml", "lattice")
    launcher = [sys.executable, "-m", "torch.distributed.run", "--standalone"]
    launcher += ["--nproc-per-node", "2", "-m", "solidtex_export.commands.train_space"]
    options = [
        "--preset",
        str(preset),
        "--steps",
        "2",
        "--threads",
        "1",
        "--device",
        "cpu",
    ]
    command = [
        *launcher,
        str(photos / "list.csv"),
        *options,
        "-o",
        str(tmp_path / "result"),
    ]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    state = torch.load(tmp_path / "result" / "checkpoint.pt", weights_only=True)
    assert state["step"] == 2
    assert len(state["ranks"]) == 2
    one = run(begin(photos, preset, tmp_path / "one", 2), 2).generator.state_dict()
    assert any(not torch.equal(v, one[k]) for k, v in state["generator"].items())
