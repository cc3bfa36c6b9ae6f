"""Every preset of texture spaces in small, for tests: settings, photographs, trainings."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from solidtex_export.commands import train_space
from solidtex_export.settings import read_toml
from solidtex_export.spaces import settings
from solidtex_export.spaces.reptile import StartTrainer
from solidtex_export.spaces.trainer import SpaceTrainer

SMALL = {
    "lattice": {"lattice": {"levels": 3, "step_channels": 2}},
    "sampler": {"sampler": {"octaves": 4, "round_octaves": 1, "hidden_layers": 3, "width": 8}},
    "gramgan-space": {
        "sampler": {"octaves": 4, "hidden_layers": 3, "width": 8},
        "critic": {"widths": [4, 6]},
        "encoder": {"width": 4},
    },
    "henzler-space": {
        "sampler": {"octaves": 4, "hidden_layers": 3, "width": 8},
        "encoder": {"width": 4},
    },
    "start-lattice": {
        "generator": {"sizes": {"levels": 3, "step_channels": 2}},
        "reptile": {"steps": 2},
    },
}
PRESETS = sorted(set(SMALL) - {"start-lattice"})


def value(v: object) -> str:
    if isinstance(v, dict):
        return "{ " + ", ".join(f"{k} = {value(x)}" for k, x in v.items()) + " }"
    return json.dumps(v)


def save_preset(path: Path, name: str) -> Path:
    """The preset with small networks and small slices, as a file."""
    tables = read_toml(Path(settings.__file__).parents[1] / "presets" / "spaces" / f"{name}.toml")
    for table, values in SMALL[name].items():
        tables[table] = tables[table] | values
    tables["slicing"] = tables["slicing"] | {"size": 40, "batch": 2}
    if name != "start-lattice":
        tables |= {"code": 4, "style_width": 8}
    plain = [f"{k} = {value(v)}" for k, v in tables.items() if not isinstance(v, dict)]
    parts = [
        "\n".join([f"[{k}]", *(f"{n} = {value(x)}" for n, x in v.items())])
        for k, v in tables.items()
        if isinstance(v, dict)
    ]
    path.write_text("\n".join(plain + parts))
    return path


def save_photos(folder: Path) -> Path:
    """Folder of three photographs and the CSV that lists them."""
    random = np.random.default_rng(1)
    folder.mkdir()
    with (folder / "list.csv").open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["split", "file", "licence", "source"])
        for i, step in enumerate((2, 5, 9)):
            pixels = random.integers(60 + 20 * i, 160, (136, 144, 3))
            pixels[::step] = (200, 120, 60)
            Image.fromarray(pixels.astype(np.uint8)).save(folder / f"p{i}.png")
            writer.writerow(["train", f"p{i}.png", "CC0-1.0", "drawn by the test"])
        writer.writerow(["validation", "missing.png", "CC0-1.0", ""])
    return folder


def begin(photos: Path, preset: Path, result: Path, steps: int) -> SpaceTrainer | StartTrainer:
    arguments = [str(photos / "list.csv"), "--preset", str(preset), "--device", "cpu"]
    arguments += ["--steps", str(steps), "-o", str(result)]
    return train_space.make_trainer(train_space.parser().parse_args(arguments))


def run(trainer: Any, steps: int) -> Any:
    trainer.run(lambda: trainer.step >= steps, lambda _: None)
    return trainer
