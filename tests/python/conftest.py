"""Shared by the Python tests: a photograph, and a training result without the training."""

import json
from pathlib import Path
from typing import Any

import pytest
import torch
from small_trainings import save_photo

from solidtex_export.export import random_models

SHA256 = "0" * 63 + "1"

torch.manual_seed(0)  # networks that test modules make as they are imported


@pytest.fixture(autouse=True)
def seeded() -> None:
    """The same random numbers in every run, whatever ran before: a test fails always or never."""
    torch.manual_seed(0)


@pytest.fixture
def photo(tmp_path: Path) -> Path:
    return save_photo(tmp_path / "photo.png")


@pytest.fixture
def make_result(tmp_path: Path) -> Any:
    """Writes the result folder of a training that ended with these untrained networks."""

    def make(family: str, photographs: int = 1) -> Path:
        folder = tmp_path / f"result-{family}"
        folder.mkdir()
        if family == "field":
            generator = {"levels": 3, "noise_channels": 2, "step_channels": 3}
            state = random_models.lattice_state(3, 2, 3)
        else:
            generator = {"octaves": 6, "hidden_layers": 4, "width": 9}
            state = random_models.sampler(6, 4, 9).state_dict()
        config = {
            "family": family,
            "size": 128,
            "seed": 0,
            "directions": "xyz",
            "generator": generator,
            "license": "CC0-1.0",
            "source": "a test",
            "exemplars": [{"file": f"{i}.png", "sha256": SHA256} for i in range(photographs)],
        }
        (folder / "config.json").write_text(json.dumps(config))
        torch.save({"generator": state, "step": 12, "seconds": 3.5}, folder / "checkpoint.pt")
        return folder

    return make
