"""The way from the project's Python to the engine."""

import sys
from typing import Any

import numpy as np
import pytest

import solidtex
from solidtex_export.commands import export
from solidtex_export.export.verification import engine


def test_a_shipped_model_is_opened_as_asked() -> None:
    with engine.open_model("granite-grey", 3, "fast") as texture:
        assert isinstance(texture, solidtex.Texture)
        assert (texture.seed, texture.precision) == (3, "fast")
        assert np.isfinite(texture.eval_box((0, 0, 0), (2, 2, 2))).all()


def test_without_the_module_commands_say_how_to_get_it(
    make_result: Any, tmp_path: Any, monkeypatch: pytest.MonkeyPatch, capsys: Any
) -> None:
    monkeypatch.setitem(sys.modules, "solidtex", None)
    output = tmp_path / "stone.solidtex"
    assert export.main([str(make_result("sampler")), "-o", str(output)]) == 1
    said = capsys.readouterr().err
    assert "the Python module solidtex" in said and "build/python" in said
    assert not output.exists()


def test_what_the_engine_refuses_is_a_failure_of_the_command() -> None:
    assert solidtex.Error in engine.errors()
    with pytest.raises(engine.errors(), match="no model is named"):
        engine.open_model("marzipan")
