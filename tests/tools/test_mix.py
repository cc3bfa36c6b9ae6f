"""solidtex-mix as a program."""

import os
import re
from pathlib import Path

import numpy as np
import pytest
from mixing import change_document, document, folder, mix, mixed, run, tensors_equal

from solidtex_export.spaces.random_space import Sizes, random_space

__all__ = ["folder"]


def test_mixture_of_two_models(folder: Path) -> None:
    half = mixed(folder, "half.solidtex", "a.solidtex", "b.solidtex")
    found, ends = document(half), [document(folder / f"{n}.solidtex") for n in "ab"]
    codes = [np.array(d["training"]["space"]["code"]) for d in (*ends, found)]
    assert np.allclose(codes[2], (codes[0] + codes[1]) / 2, atol=1e-6)
    colors = [np.array(d["training"]["space"]["colors"]) for d in (*ends, found)]
    assert np.allclose(colors[2][:, 3], (colors[0] + colors[1])[:, 3] / 2, atol=1e-6)
    assert found["name"] == "half"
    assert found["license"] == "CC0-1.0"
    names = [m["name"] for m in found["training"]["mix"]]
    files = [[e["file"] for e in m["exemplars"]] for m in found["training"]["mix"]]
    assert (names, files) == (["a", "b"], [["stone-0"], ["stone-1"]])
    assert run("solidtex-info", half).returncode == 0
    again = mixed(folder, "again.solidtex", "half.solidtex", "pebbles:stone-2")
    assert document(again)["training"]["mix"][0]["exemplars"][1]["file"] == "stone-1"


def test_weights(folder: Path) -> None:
    a, b = folder / "a.solidtex", folder / "b.solidtex"
    only = mixed(folder, "only.solidtex", a, b, "--weights", "0,3")
    assert tensors_equal(only, b)
    scaled = mixed(folder, "scaled.solidtex", a, b, "--weights", "2,6")
    plain = mixed(folder, "plain.solidtex", a, b, "--weights", "0.25,0.75")
    assert tensors_equal(scaled, plain)
    assert not tensors_equal(scaled, b)


def test_walk(folder: Path) -> None:
    result = mix(folder, "a.solidtex", "b.solidtex", "pebbles:stone-2", "--animate", 5,
                 "-o", "walk-###.solidtex")  # fmt: skip
    assert result.returncode == 0, result.stderr
    walk = sorted(folder.glob("walk-*"))
    assert [p.name for p in walk] == [f"walk-{i:03}.solidtex" for i in range(5)]
    half = mixed(folder, "half.solidtex", "a.solidtex", "b.solidtex")
    assert tensors_equal(walk[0], folder / "a.solidtex")
    assert tensors_equal(walk[1], half)
    assert tensors_equal(walk[2], folder / "b.solidtex")
    places = ["--weights", "1,0", "--weights", "0.5,0.5"]
    mix(folder, "a.solidtex", "b.solidtex", *places, "--animate", 2, "-o", "w#.solidtex")
    assert tensors_equal(folder / "w1.solidtex", half)


def test_existing_models_are_replaced_with_force_only(folder: Path) -> None:
    arguments = ("pebbles:stone-2", "b.solidtex", "-o", "a.solidtex")
    before = (folder / "a.solidtex").read_bytes()
    result = mix(folder, *arguments)
    assert result.returncode == 1
    assert "a.solidtex: exists already" in result.stderr
    assert (folder / "a.solidtex").read_bytes() == before
    assert mix(folder, *arguments, "--force").returncode == 0
    assert (folder / "a.solidtex").read_bytes() != before
    own = mix(folder, "a.solidtex", "b.solidtex", "-o", "./a.solidtex", "--force")
    assert own.returncode == 1 and "found the file of the input a.solidtex" in own.stderr


def refusal(folder: Path, *arguments: object, output: str = "out.solidtex") -> str:
    """The message of a refused mixture, of which nothing is written."""
    before = sorted(os.listdir(folder))
    result = mix(folder, *arguments, "-o", output)
    assert result.returncode == 1
    assert sorted(os.listdir(folder)) == before
    assert result.stderr.startswith("solidtex-mix: ")
    return result.stderr


def test_models_that_cannot_be_mixed(folder: Path) -> None:
    other = random_space(Sizes(family="sampler", name="woods"), seed=4)
    (folder / "woods.solidtex-space").write_bytes(other.encode())
    mixed(folder, "wood.solidtex", "woods:stone-0", "woods:stone-1")
    assert re.search(r"wood.solidtex: found a model of the space woods .* of different spaces",
                     refusal(folder, "a.solidtex", "wood.solidtex"))  # fmt: skip
    photograph = refusal(folder, "a.solidtex", "woods:stone-0")
    assert "found a photograph of the space woods, expected the space of a.solidtex" in photograph
    given = refusal(folder, "a.solidtex", "b.solidtex", "--space", "woods")
    assert "found a model of the space pebbles" in given
    assert "expected the space of --space, " in given
    (folder / "bad.solidtex").write_bytes(b"")
    for first in ("absent.solidtex", "bad.solidtex", "./bad.solidtex-space:stone-0"):
        assert refusal(folder, first, "b.solidtex").count(first.split(":")[0]) == 1
    missing = refusal(folder, "a.solidtex", "pebbles:stone-9")
    assert 'found "stone-9"' in missing and "(stone-0, stone-1, stone-2, ...;" in missing
    assert f"solidtex-info {folder / 'pebbles.solidtex-space'} lists them" in missing
    assert "(stone-3, " in refusal(folder, "a.solidtex", "pebbles:Stone3")
    change_document(folder / "a.solidtex", folder / "tuned.solidtex", {"fine_tuned": {"steps": 9}})
    assert "found a model that was fine-tuned" in refusal(folder, "a.solidtex", "tuned.solidtex")
    change_document(folder / "a.solidtex", folder / "none.solidtex", {"space": None})
    assert "found a model of no texture space" in refusal(folder, "none.solidtex", "a.solidtex")
    short = document(folder / "a.solidtex")["training"]["space"] | {"code": [1, 2]}
    change_document(folder / "a.solidtex", folder / "short.solidtex", {"space": short})
    assert "training.space.code: found 2 values" in refusal(folder, "a.solidtex", "short.solidtex")


def test_missing_and_changed_spaces(folder: Path) -> None:
    space = folder / "pebbles.solidtex-space"
    family = document(folder / "a.solidtex")["family"].replace("field", "lattice")
    changed = random_space(Sizes(family=family, name="pebbles"), seed=5)
    (folder / "kept").mkdir()
    space.rename(folder / "kept" / space.name)
    message = refusal(folder, "a.solidtex", "b.solidtex")
    assert 'a.solidtex: no texture space is named "pebbles"' in message
    space.write_bytes(changed.encode())
    message = refusal(folder, "a.solidtex", "b.solidtex")
    assert "a.solidtex: found a model of another version of the space pebbles" in message
    mixed(folder, "c.solidtex", "a.solidtex", "b.solidtex", "--space", f"kept/{space.name}")
    mixed(folder, "d.solidtex", f"kept/{space.name}:stone-0", "b.solidtex")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--weights", "0.5"), "--weights: found 0.5, expected 2 numbers of 0 or more"),
        (("--weights", "1,-1"), "found 1,-1"),
        (("--weights", "0,0"), "found 0,0"),
        (("--weights", "1,nan"), "found 1,nan"),
        (("--weights", "1,x"), "found 1,x"),
        (("--weights", "1,1", "--weights", "1,0"), "expected once without --animate"),
        (("--animate", "3"), "found one name for 3 models"),
    ],
)
def test_invalid_options(folder: Path, arguments: tuple[str, ...], words: str) -> None:
    assert words in refusal(folder, "a.solidtex", "b.solidtex", *arguments)


def test_usage(folder: Path) -> None:
    assert mix(folder, "a.solidtex", "-o", "c.solidtex").returncode == 2
    assert mix(folder, "a.solidtex", "b.solidtex").returncode == 2
    assert "expected a name that ends with .solidtex" in refusal(
        folder, "a.solidtex", "b.solidtex", output="c.png"
    )
    assert re.fullmatch(r"solidtex-mix \d+\.\d+\.\d+\n", mix(folder, "--version").stdout)
    (photograph,) = re.findall(r"stones:\S+", mix(folder, "--help").stdout)
    models = Path(__file__).resolve().parents[2] / "models"
    space = f"{models}/stones.solidtex-space:{photograph.removeprefix('stones:')}"
    mixed(folder, "stone.solidtex", space, space)
