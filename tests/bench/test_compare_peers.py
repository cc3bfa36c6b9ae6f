"""The comparison with other runtimes runs, and all compute the same. No times are judged."""

import importlib.metadata
import json
import math
import os
from pathlib import Path
from typing import Any

import compare_peers
import numpy as np
import pytest
from peer_cases import random_inputs
from peer_runtimes import PEERS, Peer

from solidtex_export.export import random_models
from solidtex_export.export.onnx.model import onnx_model
from solidtex_export.generators.lattice import Box

BENCH = Path(os.environ["SOLIDTEX_BUILD"]) / "bin" / "solidtex-bench"
INSTALLED = [peer for peer in PEERS if peer.version is not None]
TOLERANCE = 5e-5  # of values of about 1.5: float32 sums in orders, and tiles, of each runtime's own
BOX = Box((-5, 2, 7), (4, 8, 12))
GRAPHS = {
    "every operation": onnx_model(random_models.every_operation_model(), BOX),
    "lattice": onnx_model(random_models.lattice_model(3, 2, 3), BOX),
    "sampler": onnx_model(random_models.sampler_model(6, 4, 9), None),
}


@pytest.mark.parametrize("peer", INSTALLED, ids=lambda peer: peer.name)
@pytest.mark.parametrize("name", GRAPHS)
def test_peers_agree(peer: Peer, name: str) -> None:
    inputs = random_inputs(GRAPHS[name], 7)
    expected = INSTALLED[0].load(GRAPHS[name], inputs, 1)()
    work = peer.load(GRAPHS[name], inputs, 2)
    for _ in range(2):
        np.testing.assert_allclose(work(), expected, rtol=0, atol=TOLERANCE)


def compared(output: Path, *arguments: str) -> dict[str, Any]:
    """The JSON of a quick run."""
    options = ["--quick", "--bench", str(BENCH), "--json", str(output)]
    assert compare_peers.main([*arguments, *options]) == 0
    return json.loads(output.read_text())


def test_every_case_is_compared(tmp_path: Path, capsys: Any) -> None:
    report = compared(tmp_path / "a.json", "--threads", "2", "--clock", "cpu")
    names = [(case["name"], case["threads"]) for case in report["cases"]]
    assert names == [("lattice.256", 2), ("lattice.32", 1), ("sampler.batch", 1)]
    text = capsys.readouterr().out
    for case in report["cases"]:
        assert len(case["peers"]) >= len({peer.package for peer in INSTALLED})
        for name, peer in case["peers"].items():
            assert name in text
            assert peer["seconds"] == min(peer["seconds_by_piece"].values())
            assert math.isclose(peer["ratio"], peer["seconds"] / case["seconds"])
            assert 0 < peer["ratio"] < math.inf
        assert 0 < case["peak_flops"] < math.inf


def test_missing_peers_are_left_out(tmp_path: Path, capsys: Any, monkeypatch: Any) -> None:
    version = importlib.metadata.version

    def without_openvino(package: str) -> str:
        if package == "openvino":
            raise importlib.metadata.PackageNotFoundError
        return version(package)

    monkeypatch.setattr(importlib.metadata, "version", without_openvino)
    report = compared(tmp_path / "a.json", "field.32")
    assert "OpenVINO f32: not installed, left out" in capsys.readouterr().out
    assert report["versions"]["OpenVINO f32"] is None
    assert "OpenVINO f32" not in report["cases"][0]["peers"]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--bench", "absent"], "absent: cannot run"),
        (["--field-model", "stone-grey"], "family: found 'sampler', expected 'lattice'"),
        (["--sampler-model", "marzipan"], "marzipan.solidtex: cannot read"),
        (["--json", "old.json"], "old.json: found an existing file"),
    ],
)
def test_refusals(
    arguments: list[str], message: str, tmp_path: Path, capsys: Any, monkeypatch: Any
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("old.json").write_text("mine")
    assert compare_peers.main(["sampler.batch", "--quick", "--bench", str(BENCH), *arguments]) == 1
    assert message in capsys.readouterr().err
    assert Path("old.json").read_text() == "mine"


@pytest.mark.parametrize(
    ("arguments", "code", "text"),
    [
        (["--help"], 0, "examples:"),
        (["--version"], 0, "0."),
        (["field.17"], 2, "expected one of lattice.256, lattice.32, sampler.batch"),
        (["--threads", "0"], 2, "expected 1 or more"),
    ],
)
def test_usage(arguments: list[str], code: int, text: str, capsys: Any) -> None:
    with pytest.raises(SystemExit) as exit_info:
        compare_peers.main(arguments)
    assert exit_info.value.code == code
    printed = capsys.readouterr()
    assert text in printed.out + printed.err
