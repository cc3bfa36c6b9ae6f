"""Whole models: the C++ engine against float64, within the bound of docs/numerics.md."""

from pathlib import Path

import pytest

from solidtex_export.commands import measure_numerics
from solidtex_export.export.file_format import model_file
from solidtex_export.export.verification import verify

REPOSITORY = Path(__file__).resolve().parents[2]
SHIPPED = sorted((REPOSITORY / "models").glob("*.solidtex"))


def check(name: str, path: Path) -> None:
    found = verify.differences(path)
    print("\n" + measure_numerics.line(name, found))
    assert found.largest <= verify.BOUND


@pytest.mark.parametrize("name", measure_numerics.RANDOM_MODELS)
def test_untrained_model(name: str, tmp_path: Path) -> None:
    path = tmp_path / "random.solidtex"
    model_file.write(path, measure_numerics.RANDOM_MODELS[name]())
    check(name, path)


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.stem)
def test_shipped_model(path: Path) -> None:
    check(path.stem, path)
