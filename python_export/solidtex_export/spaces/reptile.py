"""Training of a start: weights that adapt to a photograph in few steps.

Reptile (Nichol, Achiam and Schulman 2018, "On first-order meta-learning algorithms"); Tancik et al.
2021 learn the initial weights of coordinate networks in the same way. A step adapts the start to
one random photograph with a short training, as solidtex-train runs it, and moves the start towards
the adapted weights.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import torch
from torch import Tensor

from solidtex_export.generators.build import Generator, build_generator
from solidtex_export.generators.lattice import LatticeGenerator
from solidtex_export.generators.sampler import OctaveSampler
from solidtex_export.generators.settings import family_of
from solidtex_export.generators.slices import LatticeSlices, SamplerSlices, SliceSource
from solidtex_export.images.exemplar import random_symmetry
from solidtex_export.images.sheet import sheet_of_rows
from solidtex_export.spaces.photographs import Material
from solidtex_export.spaces.settings import StartRecipe
from solidtex_export.spaces.targets import Targets, load_descriptor, make_targets
from solidtex_export.training.acceleration import fast_autocast
from solidtex_export.training.batch_norm import measure_statistics
from solidtex_export.training.divergence import DivergenceWatch, not_finite
from solidtex_export.training.loop import ResumableTraining
from solidtex_export.training.optimizer import GeneratorOptimizer, half_cosine
from solidtex_export.training.ranks import Ranks
from solidtex_export.training.reproducible import make_reproducible
from solidtex_export.training.result import ResultFolder

SHOWN = 6  # photographs in the preview, held-out ones if there are any
PREVIEW_SIDE = 128


class StartTrainer(ResumableTraining):
    """Reptile over the photographs of `materials`."""

    log_steps = 5

    def __init__(
        self,
        recipe: StartRecipe,
        materials: Sequence[Material],
        held_out: Sequence[Material],
        seed: int,
        device: torch.device,
        folder: ResultFolder,
    ) -> None:
        make_reproducible(seed, device)
        self.recipe, self.materials, self.held_out = recipe, materials, held_out
        self.device, self.folder, self.ranks = device, folder, Ranks()
        self.watch = DivergenceWatch()
        self._descriptor = load_descriptor(recipe.losses)
        self._targets: dict[str, list[tuple[float, Targets]]] = {}
        self.generator = make_start_generator(recipe).to(device)
        self.slices: SliceSource
        if isinstance(self.generator, OctaveSampler):
            self.slices = SamplerSlices(self.generator, recipe.slicing.planes)
        else:
            assert isinstance(self.generator, LatticeGenerator)
            self.slices = LatticeSlices(self.generator)
        size = recipe.slicing.size
        measure_statistics(self.generator, self.slices, recipe.directions, size, self.ranks)

    def _train_step(self) -> dict[str, float]:
        settings = self.recipe.reptile
        material = self.materials[int(torch.randint(len(self.materials), ()))]
        start = [p.detach().clone() for p in self.generator.parameters()]
        first, last = self.adapt(material)
        rate = settings.rate * half_cosine(self.progress, 1.0, settings.final_rate)
        with torch.no_grad():
            for parameter, before in zip(self.generator.parameters(), start, strict=True):
                parameter.copy_(torch.lerp(before, parameter, rate))
        self.watch.check(self.step, {"first": first, "last": last})
        self.step += 1
        return {"rate": rate, "first": first, "last": last}

    def adapt(self, material: Material) -> tuple[float, float]:
        """Train the generator on one photograph; the loss of the first and of the last quarter."""
        steps, directions = self.recipe.reptile.steps, self.recipe.directions
        optimizer = GeneratorOptimizer(self.generator, self.recipe.optimizer)
        slicing = self.recipe.slicing
        losses = []
        for step in range(steps):
            optimizer.prepare(step, 0.0)
            with fast_autocast(self.device):
                drawn = self.slices.draw(
                    directions[step % len(directions)], slicing.size, slicing.batch
                )
            gradient, loss = self._gradient(drawn, material)
            if not gradient.isfinite().all():
                raise not_finite(self.step, "a gradient")
            drawn.backward(gradient.to(drawn.dtype))
            optimizer.step()
            losses.append(loss)
        part = max(1, steps // 4)
        return sum(losses[:part]) / part, sum(losses[-part:]) / part

    def _gradient(self, drawn: Tensor, material: Material) -> tuple[Tensor, float]:
        slices = drawn.detach().float().requires_grad_()
        gradient, total = torch.zeros_like(slices), 0.0
        unit = self.recipe.losses.mixing == "unit-gradients"
        with fast_autocast(self.device):
            turned = random_symmetry(slices, self.recipe.slicing.symmetry)
            for weight, targets in self._targets_of(material):
                loss = targets.loss(0, turned)
                (part,) = torch.autograd.grad(loss, slices, retain_graph=True)
                scale = 1 / (part.norm() + 1e-12) if unit else 1.0
                gradient += weight * scale * part
                total += weight * loss.item()
        return gradient, total

    def _targets_of(self, material: Material) -> list[tuple[float, Targets]]:
        """Losses of a photograph, measured when it is first drawn: always the same."""
        if material.name not in self._targets:
            recipe = self.recipe
            found = list(make_targets(recipe.losses, recipe.slicing, self._descriptor).values())
            with torch.random.fork_rng(devices=[]):
                torch.manual_seed(0)
                for _, targets in found:
                    targets.add(material.image.to(self.device))
            self._targets[material.name] = found
        return self._targets[material.name]

    def save_preview(self) -> None:
        """Sheet of triples: photograph, slice of the start, slice after an inner training."""
        before = {k: v.clone() for k, v in self.generator.state_dict().items()}
        images = []
        with torch.random.fork_rng(devices=[self.device] if self.device.type == "cuda" else []):
            for material in (self.held_out or self.materials)[:SHOWN]:
                torch.manual_seed(0)
                images.append(material.restored(material.image)[:, :PREVIEW_SIDE, :PREVIEW_SIDE])
                images.append(self._slice(material))
                self.adapt(material)
                images.append(self._slice(material))
                self.generator.load_state_dict(before)
        self.folder.save_preview(sheet_of_rows(images, 6))

    @torch.no_grad()
    def _slice(self, material: Material) -> Tensor:
        y = self.slices.draw(self.recipe.directions[0], PREVIEW_SIDE, 1)[0]
        return material.restored(y.float().cpu())

    def state(self) -> dict[str, Any]:
        cuda = torch.cuda.get_rng_state(self.device) if self.device.type == "cuda" else None
        return {
            "generator": self.generator.state_dict(),
            "watch": self.watch.state(),
            "step": self.step,
            "seconds": self.seconds,
            "rng": torch.get_rng_state(),
            "cuda_rng": cuda,
        }

    def restore(self, state: dict[str, Any]) -> None:
        self.generator.load_state_dict(state["generator"])
        self.watch.restore(state["watch"])
        self.step, self.seconds = state["step"], state["seconds"]
        torch.set_rng_state(state["rng"])
        if state["cuda_rng"] is not None and self.device.type == "cuda":
            torch.cuda.set_rng_state(state["cuda_rng"], self.device)
        self.folder.trim_log(self.step)


def make_start_generator(recipe: StartRecipe) -> Generator:
    kind = recipe.generator.kind
    return build_generator(family_of(kind), {"kind": kind, **recipe.generator.sizes})
