"""Trains, exports and evaluates one exemplar with one preset; skips finished steps.

Every step is a process of its own, and leaves a file when it has succeeded:

    EXEMPLAR/exemplar.png          of an analytic solid, with its maps
    EXEMPLAR/true.npy              of an analytic solid: two blocks of the phase
    EXEMPLAR/METHOD/result/        solidtex-train
    EXEMPLAR/METHOD/training.json  what the plan said when the training had ended
    EXEMPLAR/METHOD/model.solidtex solidtex-export
    EXEMPLAR/METHOD/eval.json, report.html, pictures/  solidtex-eval
    EXEMPLAR/METHOD/solid.json     errors of the 3D statistics
    EXEMPLAR/METHOD/failure.txt    the last line of a step that failed
"""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from solidtex_export.export.verification import engine
from solidtex_export.images.channels import COLOR
from solidtex_export.research.fidelity.plan import CHOSEN, Entry, Plan, photograph
from solidtex_export.research.solids.materials import SOLIDS
from solidtex_export.research.solids.solid import box, exemplar, phase, write_picture
from solidtex_export.research.solids.statistics import solid_error
from solidtex_export.training.presets import SUFFIX, load_recipe
from solidtex_export.whole_file import write_whole

INTERRUPTED = 130
BLOCK = 128  # voxels: side of the blocks for 3D statistics
TRUE_PLACES = ((1000, 1000, 1000), (3000, 1000, 1000))


class Stopped(KeyboardInterrupt):
    """The user interrupted a step."""


class Cell:
    """Folder of one pair; `root` holds all pairs, `photos` the photographs.

    `features` are weights for the feature distance, if any.
    """

    def __init__(
        self,
        plan: Plan,
        entry: Entry,
        method: str,
        root: Path,
        photos: Path,
        features: Path | None = None,
    ) -> None:
        self.entry = entry
        self.method = method
        self._plan = plan
        self._features = features
        self.shared = root / entry.name
        self.folder = self.shared / method
        self._photos = photos
        self.model = self.folder / "model.solidtex"
        self.evaluation = self.folder / "eval.json"
        self._record = self.folder / "training.json"
        self.solid_errors = self.folder / "solid.json"
        self.failure = self.folder / "failure.txt"

    @property
    def photo(self) -> Path:
        if self.entry.solid:
            return self.shared / "exemplar.png"
        return photograph(self.entry, self._photos)

    @property
    def settings(self) -> dict[str, Any]:
        """All that the plan says about this training."""
        method = self._plan.method(self.method)
        parts = (self.entry.model_dump(mode="json"), method.model_dump(mode="json"))
        settings = {**parts[0], **parts[1], **self._plan.budgets}
        if method.preset.endswith(SUFFIX):  # a file of the user's may change
            recipe = load_recipe(method.preset, list(method.set))
            settings["recipe"] = recipe.model_dump(mode="json")
        return settings

    @property
    def trained_by(self) -> dict[str, Any] | None:
        """The settings of the training that has ended here."""
        if not self._record.exists():
            return None
        record: dict[str, Any] = json.loads(self._record.read_text())
        return record

    @property
    def finished(self) -> bool:
        evaluated = self._evaluated and (not self.entry.solid or self.solid_errors.exists())
        return self.model.exists() and evaluated

    @property
    def _evaluated(self) -> bool:
        """Whether the evaluation exists, with the wanted feature distance."""
        if not self.evaluation.exists():
            return False
        used = json.loads(self.evaluation.read_text())["settings"].get("features")
        return self._features is None or used == self._features.name

    def prepare(self) -> None:
        """Make what the exemplar's other cells share."""
        self.shared.mkdir(parents=True, exist_ok=True)
        if self.entry.solid:
            cut_exemplar(self.entry, self.shared)

    def run(self, threads: int) -> bool:
        """Run the missing steps; false if a step fails, with the reason in failure.txt."""
        self.folder.mkdir(parents=True, exist_ok=True)
        self.failure.unlink(missing_ok=True)
        if not self.model.exists():
            result = self.folder / "result"
            if not self._step("train", *self._training(result), "--threads", str(threads)):
                return False
            write_whole(self._record, (json.dumps(self.settings, indent=1) + "\n").encode())
            if not self._step("export", str(result), "-o", str(self.model)):
                return False
        if not self._evaluated and not self._step("evaluate", *self._evaluate_options()):
            return False
        if self.entry.solid and not self.solid_errors.exists():
            errors = solid_errors(self.entry.solid, self.model, self.shared / "true.npy")
            write_whole(self.solid_errors, (json.dumps(errors, indent=1) + "\n").encode())
        return True

    def _training(self, result: Path) -> list[str]:
        entry, plan = self.entry, self._plan
        method = plan.method(self.method)
        options = {
            "preset": None if method.preset == CHOSEN else method.preset,
            "minutes": plan.minutes or plan.processor_minutes,
            "clock": "processor" if plan.processor_minutes else None,
            "steps": plan.steps,
            "size": entry.size,
            "resolution": entry.resolution,
            "crop": ",".join(map(str, entry.crop)) if entry.crop else None,
            "directions": entry.directions,
            "symmetry": entry.symmetry,
        }
        known = [f"--{name}={value}" for name, value in options.items() if value is not None]
        known += [f"--set={override}" for override in method.set]
        return [str(self.photo), "-o", str(result), *known, *method.options, *self._maps()]

    def _evaluate_options(self) -> list[str]:
        files = ["--json", str(self.evaluation), "-o", str(self.folder / "report.html")]
        files += ["--pictures", str(self.folder / "pictures"), "--force"]
        files += [f"--features={self._features}"] if self._features else []
        return [str(self.model), str(self.photo), *files, *self._maps()]

    def _maps(self) -> list[str]:
        if not self.entry.solid:
            return []
        names = SOLIDS[self.entry.solid](0).channels[len(COLOR) :]
        return [f"--map={name}={self.shared / f'exemplar-{name}.png'}" for name in names]

    def _step(self, command: str, *arguments: str) -> bool:
        module = f"solidtex_export.commands.{command}"
        done = subprocess.run(
            [sys.executable, "-m", module, *arguments],
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            check=False,
        )
        if done.returncode == INTERRUPTED:
            raise Stopped
        if done.returncode:
            said = done.stdout.strip().splitlines() or ["no word"]
            write_whole(self.failure, f"{command}: {said[-1]}\n".encode())
        return done.returncode == 0


def cut_exemplar(entry: Entry, folder: Path) -> None:
    """Make the exemplar of an analytic solid, and two blocks of its phase [2, x, y, z], once."""
    assert entry.solid is not None
    truth = folder / "true.npy"
    if truth.exists():
        return
    solid = SOLIDS[entry.solid](0)
    picture = exemplar(solid, entry.pixels, entry.pixels)
    write_picture(folder / "exemplar.png", picture[..., : len(COLOR)], force=True)
    for index, channel in enumerate(solid.channels[len(COLOR) :], len(COLOR)):
        write_picture(folder / f"exemplar-{channel}.png", picture[..., index], force=True)
    blocks = [phase(box(solid, place, (BLOCK,) * 3), solid) for place in TRUE_PLACES]
    temporary = folder / "true.tmp.npy"
    np.save(temporary, np.stack(blocks))
    temporary.replace(truth)


def solid_errors(name: str, model: Path, truth: Path) -> dict[str, dict[str, float]]:
    """Errors of the model's block, and of another block of the true solid, against the first true
    block.
    """
    solid = SOLIDS[name](0)
    first, second = np.load(truth)
    with engine.open_model(model) as texture:
        values = texture.eval_box((0, 0, 0), (BLOCK,) * 3)
    found = {"model": phase(values, solid), "true": second}
    return {key: asdict(solid_error(block, first)) for key, block in found.items()}
