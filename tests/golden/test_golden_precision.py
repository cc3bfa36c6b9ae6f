"""Fast precision against full precision, within what docs/numerics.md states."""

from pathlib import Path

import pytest

from solidtex_export.commands import measure_numerics, measure_precision
from solidtex_export.export.file_format import model_file

SAMPLERS = [name for name in measure_numerics.RANDOM_MODELS if name.startswith("sampler")]


def check(name: str, path: Path) -> None:
    found = measure_precision.shift(path)
    print("\n" + measure_precision.line(name, found))
    assert found.within_one >= 0.999


@pytest.mark.parametrize("name", SAMPLERS)
def test_untrained_model(name: str, tmp_path: Path) -> None:
    path = tmp_path / "random.solidtex"
    model_file.write(path, measure_numerics.RANDOM_MODELS[name]())
    check(name, path)


@pytest.mark.parametrize("name", measure_precision.TRAINED)
def test_trained_model(name: str) -> None:
    check(name, measure_numerics.SHIPPED / f"{name}.solidtex")
