"""The notebooks of docs/notebooks/ run from the first cell to the last and show their pictures.

Small sizes replace those of the cell that is tagged "parameters", so that a test takes seconds.
`SOLIDTEX_BUILD=build python tests/notebooks/test_notebooks.py` runs them as they are, for minutes,
and writes their pictures anew.
"""

import os
import sys
from pathlib import Path
from typing import Any

import pytest

nbformat = pytest.importorskip("nbformat")
nbclient = pytest.importorskip("nbclient")
pytest.importorskip("ipykernel")

REPOSITORY = Path(__file__).resolve().parents[2]
NOTEBOOKS = REPOSITORY / "docs" / "notebooks"
SMALL = {
    "artist": "%env TRAINING=--steps 2 --size 32\n%env RENDER=--spp 2 --size 64,48\n"
    "%env ATLAS=--size 64 --texels-per-unit 20",
    "researcher": "SIDE, STEPS = 32, 2",
    "scientist": "%env TRAINING=--steps 2 --size 32\nSIDE = 24",
}


def read(name: str) -> Any:
    return nbformat.read(NOTEBOOKS / f"{name}.ipynb", as_version=4)


def run(notebook: Any) -> None:
    """Execute it in place, with the programs and modules of this build first."""
    build = Path(os.environ["SOLIDTEX_BUILD"]).resolve()
    path = f"{build / 'bin'}:{Path(sys.executable).parent}:{os.environ['PATH']}"
    module = f"{REPOSITORY / 'python_export'}:{build / 'python'}"
    environment = {"PATH": path, "PYTHONPATH": module}
    client = nbclient.NotebookClient(
        notebook,
        timeout=3600,
        coalesce_streams=True,
        resources={"metadata": {"path": str(NOTEBOOKS)}},
    )
    client.execute(env=os.environ | environment)


def pictures(notebook: Any) -> list[int]:
    """The cells that show a picture."""
    return [
        index
        for index, cell in enumerate(notebook.cells)
        if any(
            {"image/png", "image/jpeg"} & o.get("data", {}).keys() for o in cell.get("outputs", [])
        )
    ]


IS_LONG = bool(os.environ.get("SOLIDTEX_LONG_TESTS"))


@pytest.mark.parametrize("name", SMALL)
def test_it_runs_in_small(name: str) -> None:
    if name == "scientist" and not IS_LONG:
        pytest.skip("counting the fractions of phases takes more than a minute")
    notebook = read(name)
    shown = pictures(notebook)
    (parameters,) = [c for c in notebook.cells if "parameters" in c.metadata.get("tags", [])]
    parameters.source = SMALL[name]
    run(notebook)
    assert pictures(notebook) == shown and len(shown) >= 3


@pytest.mark.parametrize("name", SMALL)
def test_it_was_run_in_order_and_names_no_machine(name: str) -> None:
    notebook = read(name)
    code = [cell for cell in notebook.cells if cell.cell_type == "code"]
    assert [cell.execution_count for cell in code] == list(range(1, len(code) + 1))
    text = nbformat.writes(notebook)
    assert str(REPOSITORY) not in text and "/tmp/" not in text and '"error"' not in text


@pytest.mark.skipif(not IS_LONG, reason="takes minutes")
@pytest.mark.parametrize("name", SMALL)
def test_it_runs_as_it_is(name: str) -> None:
    run(read(name))


if __name__ == "__main__":
    for name in sys.argv[1:] or SMALL:
        notebook = read(name)
        run(notebook)
        for cell in notebook.cells:
            cell.metadata.pop("execution", None)  # times
            if "outputs" in cell:  # results only, no talk
                cell.outputs = [o for o in cell.outputs if o.get("name") != "stderr"]
        nbformat.write(notebook, NOTEBOOKS / f"{name}.ipynb")
