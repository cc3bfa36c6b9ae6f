"""Every shipped model verifies, says where it comes from, and together they stay small."""

import json
import os
import subprocess
from pathlib import Path

import pytest

from solidtex_export.export.file_format.model_file import read

REPOSITORY = Path(__file__).resolve().parents[2]
INFO = Path(os.environ.get("SOLIDTEX_BUILD", REPOSITORY / "build")) / "bin" / "solidtex-info"
MODELS = sorted((REPOSITORY / "models").glob("*.solidtex"))


@pytest.mark.parametrize("path", MODELS, ids=lambda path: path.stem)
def test_model_is_complete_and_found_by_its_bare_name(path: Path) -> None:
    document = read(path).document
    assert document["name"] == path.stem
    exemplars = document["exemplar"]
    for exemplar in exemplars if isinstance(exemplars, list) else [exemplars]:
        assert {"file", "sha256", "license", "source"} <= exemplar.keys()
    assert document["license"] and document["training"]
    result = subprocess.run(
        [INFO, path.stem, "--json"],
        env={**os.environ, "SOLIDTEX_MODEL_PATH": str(path.parent)},
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert result.returncode == 0, result.stderr
    report = json.loads(result.stdout)
    assert Path(report["file"]).samefile(path)
    assert all(-1 < value < 2 for value in report["voxel"]["values"])


def test_models_are_small_together() -> None:
    assert sum(path.stat().st_size for path in MODELS) < 12_000_000


def test_both_families_are_shipped() -> None:
    families = [read(path).document["family"] for path in MODELS]
    assert families.count("field") >= 3
    assert families.count("sampler") >= 2
