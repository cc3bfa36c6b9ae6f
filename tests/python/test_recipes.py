"""What every preset means: its resolved recipe is that of recipes.json.

A change of a preset is written there by `python tests/python/test_recipes.py`.
"""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest
import torch

from solidtex_export.losses import own
from solidtex_export.training.presets import PresetError, load_recipe, shipped
from solidtex_export.training.recipe import Recipe

RECIPES = Path(__file__).with_name("recipes.json")
PAGE = Path(__file__).resolve().parents[2] / "docs" / "methods.md"


def resolved() -> dict[str, object]:
    return {name: load_recipe(name).model_dump(mode="json") for name in shipped()}


def test_every_preset_means_what_it_did() -> None:
    assert resolved() == json.loads(RECIPES.read_text())


@pytest.mark.parametrize("name", shipped())
def test_a_saved_recipe_is_read_as_the_same(name: str) -> None:
    recipe = load_recipe(name)
    assert Recipe.model_validate_json(recipe.model_dump_json()) == recipe


OLD = """
[optimiser]
equalised = true
[critic]
memory = 7
equalised = true
[losses.tones]
weight = 3
"""


def test_older_keys_are_accepted(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    path.write_text('extends = "lattice-grains"\n' + OLD)
    recipe = load_recipe(str(path), ["optimiser.learning_rate=0.125", "projected_critic.memory=5"])
    assert recipe.optimizer.per_layer_scaling and recipe.optimizer.learning_rate == 0.125
    assert recipe.critic.replay_buffer == 7 and recipe.critic.equalized_learning_rate
    assert recipe.projected_critic.replay_buffer == 5
    assert recipe.losses["color_distribution"].weight == 3


def test_a_preset_changes_what_it_extends(tmp_path: Path) -> None:
    (tmp_path / "base.toml").write_text('extends = "sts-gan"\n[critic]\nbatch = 9\n')
    child = tmp_path / "child.toml"
    child.write_text('extends = "base.toml"\n[losses.near]\nkind = "descriptor"\n')
    recipe, parent = load_recipe(str(child)), load_recipe("sts-gan")
    assert recipe.critic == parent.critic.model_copy(update={"batch": 9})
    assert list(recipe.losses) == ["near", "adversarial"]  # in order of kind
    assert recipe.generator == parent.generator


def test_the_examples_of_the_page_are_right(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The preset, and the loss with the options of its command."""
    page = PAGE.read_text()
    (preset,) = re.findall(r"^```toml\n(.*?)^```", page, re.M | re.S)
    (module,) = re.findall(r"^```python\n(# mine\.py\n.*?)^```", page, re.M | re.S)
    (tmp_path / "preset.toml").write_text(preset)
    (tmp_path / "mine.py").write_text(module)
    monkeypatch.syspath_prepend(tmp_path)
    recipe = load_recipe(
        str(tmp_path / "preset.toml"), re.findall(r"--set (losses\.mine\S+)", page)
    )
    assert recipe.slicing.oblique_share == 0.25 and "spectrum" not in recipe.losses
    assert recipe.losses["mine"].kind == "mine:brightness" and recipe.losses["mine"].weight == 0.5
    slices = torch.full((1, 3, 32, 32), 3.0, requires_grad=True)
    assert own.loss("mine", "mine:brightness", slices, torch.ones(1, 3, 32, 32)) == 2


def test_the_order_of_tables_does_not_matter(tmp_path: Path) -> None:
    tables = ["[losses.spectrum]", "[losses.descriptor]", "[losses.wavelets]"]
    orders = []
    for name, order in (("a", tables), ("b", tables[::-1])):
        path = tmp_path / f"{name}.toml"
        path.write_text("\n".join(['[generator]\nkind = "lattice"', *order, "[optimizer]",
                                   "learning_rate = 1"]))  # fmt: skip
        orders.append(list(load_recipe(str(path)).losses))
    assert orders == [["descriptor", "wavelets", "spectrum"]] * 2


def test_an_unknown_preset_is_refused() -> None:
    with pytest.raises(PresetError, match="--preset: found alchemy, expected one of babichev"):
        load_recipe("alchemy")


if __name__ == "__main__":
    RECIPES.write_text(json.dumps(resolved(), indent=1) + "\n")
