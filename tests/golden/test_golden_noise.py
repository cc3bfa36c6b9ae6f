"""Both noise schemes in the C++ engine against the Python definition, through bare noise models."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from solidtex import Texture
from solidtex_export.export import random_models
from solidtex_export.export.file_format import model_file
from solidtex_export.export.file_format.model_file import ModelFile
from solidtex_export.export.verification import noise

ORIGINS = [(0, 0, 0), (-40, 7, -3), (65530, -65540, 131070), (2**30, -(2**30), 2**30 - 9)]
SIZE = (5, 6, 70)  # longer along z than a vector
SEEDS = [0, 1, 2**64 - 1]


def noise_model(scheme: str, distribution: str, level: int, channels: int) -> ModelFile:
    """Noise of a level, replicated down to voxels by upsampling."""
    source = {"level": level, "channels": channels, "distribution": distribution}
    nodes: list[dict[str, Any]] = [{"name": "z", "op": "noise", **source}]
    for finer in range(level):
        nodes.append({"name": f"up{finer}", "op": "upsample", "inputs": [nodes[-1]["name"]]})
    field = {"nodes": nodes, "output": nodes[-1]["name"]}
    document = random_models.document("field", field, scheme)
    document["channels"] = [f"noise.{channel}" for channel in range(channels)]
    return ModelFile(document, {})


@pytest.mark.parametrize(
    ("scheme", "distribution", "bound"),
    [
        ("solidtex-1", "uniform", 0.0),
        ("solidtex-1", "normal", 2e-6),  # float32, and the engine's own polynomial
        ("solidtexturenets", "uniform", 0.0),
    ],
)
@pytest.mark.parametrize("level", [0, 2, 5])
def test_noise(scheme: str, distribution: str, bound: float, level: int, tmp_path: Path) -> None:
    path = tmp_path / "noise.solidtex"
    channels = 4
    model_file.write(path, noise_model(scheme, distribution, level, channels))
    worst = 0.0
    for seed in SEEDS:
        with Texture(path, seed) as texture:
            for origin in ORIGINS:
                found = texture.eval_box(origin, SIZE)
                axes = [np.arange(o, o + s) >> level for o, s in zip(origin, SIZE, strict=True)]
                grid = np.meshgrid(*axes, indexing="ij")
                draw = noise.DISTRIBUTIONS[distribution]
                expected = [
                    draw(scheme, seed, level, channel, *grid) for channel in range(channels)
                ]
                worst = max(worst, float(np.abs(found - np.stack(expected, axis=-1)).max()))
    print(f"\n{scheme} {distribution} level {level}: largest difference {worst:.2e}")
    assert worst <= bound
