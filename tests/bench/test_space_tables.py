"""benchmarks/space_tables.py: tables and figure of texture spaces, on shipped models."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
import space_tables
from PIL import Image
from safetensors.torch import save_file

from solidtex_export.networks.squeezenet import SqueezeNet

MODEL = Path(__file__).resolve().parents[2] / "models" / "stone-grey.solidtex"


@pytest.fixture(autouse=True)
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(space_tables, "PATCHES", 2)
    monkeypatch.setattr(space_tables, "LEAST", 48)


@pytest.fixture
def features(tmp_path: Path) -> str:
    save_file(SqueezeNet().state_dict(), tmp_path / "squeezenet.safetensors")
    return f"--features={tmp_path / 'squeezenet.safetensors'}"


def save_stone(path: Path, seed: int) -> None:
    grain = np.random.default_rng(seed).integers(90, 140, (96, 96, 1))
    pixels = grain + np.array([0, 5, 10])
    path.parent.mkdir(parents=True, exist_ok=True)
    Image.fromarray(pixels.astype(np.uint8)).save(path)


def test_table_1_has_a_cell_for_each_variant(
    tmp_path: Path, features: str, capsys: pytest.CaptureFixture[str]
) -> None:
    for method in ("gramgan", "henzler"):
        folder = tmp_path / "results" / "granite" / method
        save_stone(folder / "result" / "exemplar-0.png", 0)
        (folder / "result" / "config.json").write_text(json.dumps({"resolution": 48}))
        shutil.copyfile(MODEL, folder / "model.solidtex")
    arguments = ["variants", str(tmp_path / "results"), features, "--slices=2"]
    assert space_tables.main(arguments) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == "| SIFID, 2 slices | gramgan | henzler |"
    assert lines[2].startswith("| granite | ") and lines[2].count("±") == 2
    assert space_tables.main(["variants", str(tmp_path / "nothing"), features]) == 1
    assert "nothing: found no models, expected results of" in capsys.readouterr().err


def test_table_2_ranks_models_and_ground_truth(
    tmp_path: Path, features: str, capsys: pytest.CaptureFixture[str]
) -> None:
    photographs, folder = tmp_path / "photographs", tmp_path / "held-out"
    rows = [f"validation,rock-{i}.jpg,rock" for i in range(3)] + ["train,rock-9.jpg,rock"]
    for i in range(3):
        save_stone(photographs / "validation" / f"rock-{i}.jpg", i)
    (photographs / "SOURCES.csv").write_text("\n".join(["split,file,category", *rows]) + "\n")
    assert space_tables.main(["patches", str(photographs), "--side=48", "-o", str(folder)]) == 0
    names = {path.name for path in (folder / "patches").iterdir()}
    assert names == {path.name for path in (folder / "truth").iterdir()} and len(names) == 2
    for name in names:
        with Image.open(folder / "patches" / name) as patch:
            assert patch.size == (48, 48)
        model = folder / "models" / "ours" / f"{Path(name).stem}.solidtex"
        model.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(MODEL, model)
    picture = tmp_path / "held-out.png"
    arguments = ["held-out", str(folder), features, "--slices=1", f"--picture={picture}"]
    assert space_tables.main(arguments) == 0
    table = capsys.readouterr().out
    assert "| 2 patches | ground truth | ours |" in table
    assert "| rank by feature distance | 1.000 ± 0.000 | 2.000 ± 0.000 |" in table
    assert "average log-likelihood" in table and "SIFID (SqueezeNet)" in table
    with Image.open(picture) as shown:
        assert shown.size == (2 * 48 + space_tables.GAP, 3 * 48 + 2 * space_tables.GAP)


def test_figure_6_has_a_column_for_each_model(tmp_path: Path, features: str) -> None:
    save_stone(tmp_path / "stone.png", 0)
    sheet = tmp_path / "sheet.png"
    arguments = ["sheet", str(tmp_path / "stone.png"), f"encoded={MODEL}", "-o", str(sheet)]
    assert space_tables.main([*arguments, features, "--slices=2", "--resolution=64"]) == 0
    with Image.open(sheet) as image:
        assert image.size == (2 * 64 + space_tables.GAP, 64 + space_tables.LABEL)
        pixels = np.asarray(image)[space_tables.LABEL :]
        assert pixels[:, :64].std() > 5 and pixels[:, 68:].std() > 5
