"""Every preset in small, for tests: its settings, a photograph, and trainers of a few steps."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import torch
from PIL import Image

from solidtex_export.commands import train as cli_train
from solidtex_export.images.channels import COLOR
from solidtex_export.images.exemplar import Exemplar
from solidtex_export.networks import vgg
from solidtex_export.research.solids.materials import SOLIDS
from solidtex_export.research.solids.solid import exemplar
from solidtex_export.training.trainer import Trainer

LATTICE = ["generator.sizes.levels=3", "generator.sizes.step_channels=2"]
SAMPLER = ["generator.sizes.octaves=4", "generator.sizes.hidden_layers=3"]
SAMPLER += ["generator.sizes.width=8"]
CRITIC = ["critic.widths=[4,6]", "critic.batch=2", "projected_critic.head_width=4"]
SMALL = {
    "lattice": [*LATTICE, *CRITIC],
    "sampler": [*SAMPLER, "grain.short_octaves=1", *CRITIC],
    "gutierrez": LATTICE,
    "babichev": LATTICE,
    "sts-gan": ["generator.sizes.levels=3", "generator.sizes.width=4", *CRITIC],
    "gramgan": [*SAMPLER, *CRITIC],
    "henzler": SAMPLER,
}
STARTING = {
    "space-lattice": SMALL["lattice"],
    "start-lattice": SMALL["lattice"],
    "space-sampler": SMALL["sampler"],
    "gramgan-extrapolate": SMALL["gramgan"],
}
"""Presets of trainings that start from a texture space or from learned weights."""
SMALL |= STARTING
PRESETS = sorted(set(SMALL) - set(STARTING))


SIZE = 44
"""Of slices, in texels, where `arguments` begin a training."""


def arguments(photo: Path, result: Path, *more: str) -> list[str]:
    return [str(photo), "-o", str(result), "--size", str(SIZE), "--device", "cpu", *more]


def save_photo(path: Path) -> Path:
    """Two-colored stripes and specks."""
    random = np.random.default_rng(1)
    pixels = random.integers(90, 140, (56, 64, 3))
    pixels[:, ::5] = (200, 120, 60)
    Image.fromarray(pixels.astype(np.uint8)).save(path)
    return path


def save_specks(path: Path) -> Path:
    """Every pixel a color of its own."""
    pixels = np.random.default_rng(1).integers(0, 255, (48, 56, 3))
    Image.fromarray(pixels.astype(np.uint8)).save(path)
    return path


def of_solid(name: str, seed: int = 0, side: int = 144) -> Exemplar:
    """The colors of an analytic solid, on side x side pixels."""
    picture = exemplar(SOLIDS[name](seed), side, side)[..., : len(COLOR)]
    return Exemplar(name, "", torch.from_numpy(picture.astype(np.float32)).permute(2, 0, 1))


def save_vgg(path: Path) -> Path:
    """Random weights of VGG-19, as torchvision names them."""
    widths = [w for w, n in zip(vgg.WIDTHS, vgg.CONVOLUTIONS, strict=True) for _ in range(n)]
    state = {}
    for index, ins, outs in zip(vgg.TORCHVISION_INDICES, [3, *widths], widths, strict=False):
        state[f"features.{index}.weight"] = torch.randn(outs, ins, 3, 3) * (2 / (9 * ins)) ** 0.5
        state[f"features.{index}.bias"] = torch.zeros(outs)
    torch.save(state, path)
    return path


def begin(*arguments: str) -> Trainer:
    """What solidtex-train makes of these arguments, before its first step."""
    p = cli_train.parser()
    args = p.parse_args([*arguments, "--device", "cpu"])
    asked = cli_train.request_of(p, args)
    return cli_train.make_trainer(asked, args.result, use_cuda=False, compiled=args.compile)


def make_trainer(photos: list[Path], result: Path, preset: str, *more: str) -> Trainer:
    settings = [part for setting in SMALL[preset] for part in ("--set", setting)]
    arguments = [*map(str, photos), "-o", str(result), "--preset", preset, "--steps", "4"]
    return begin(*arguments, *settings, *more, "--size", "32", "--resolution", "48")


def train(trainer: Trainer, steps: int | None = None) -> Trainer:
    trainer.run(lambda: trainer.step == steps, lambda t: None)
    return trainer


def assert_equal(first: dict[str, torch.Tensor], second: dict[str, torch.Tensor]) -> None:
    """Of two networks, to the bit."""
    assert first.keys() == second.keys()
    for key, value in first.items():
        assert torch.equal(value, second[key]), key


def config_of(photo: Path, result: Path, *options: str) -> dict[str, object]:
    """That of a training which was not begun."""
    begin(str(photo), "-o", str(result), "--size", "48", "--steps", "1", *options)
    document: dict[str, object] = json.loads((result / "config.json").read_text())
    return document
