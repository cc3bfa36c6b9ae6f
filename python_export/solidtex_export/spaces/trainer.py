"""Training of a texture space.

A step draws a few materials at random, encodes a patch of each, generates a slice of each, and
compares every slice with its own photograph. GramGAN (Portenier et al. 2020), section 3.2: the
critic, where a recipe has one, is not conditioned.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import torch
from torch import Tensor, nn
from torch.optim import Adam

from solidtex_export.discriminators.critic import Critic, Penalties, adversarial_loss, style_loss
from solidtex_export.generators.regions import Box
from solidtex_export.generators.slices import SLICE_AXES, random_plane
from solidtex_export.images.exemplar import random_crops, random_symmetry
from solidtex_export.images.sheet import sheet_of_rows
from solidtex_export.spaces.encoder import make_encoder
from solidtex_export.spaces.generators import ConditionedLattice, ConditionedSampler
from solidtex_export.spaces.noise import TiledNoise
from solidtex_export.spaces.photographs import Material, patches
from solidtex_export.spaces.settings import SpaceRecipe
from solidtex_export.spaces.targets import load_descriptor, make_targets
from solidtex_export.training.acceleration import fast_autocast
from solidtex_export.training.divergence import DivergenceWatch, gradient_not_finite, not_finite
from solidtex_export.training.loop import ResumableTraining
from solidtex_export.training.optimizer import half_cosine, parameter_groups
from solidtex_export.training.ranks import Ranks
from solidtex_export.training.reproducible import make_reproducible
from solidtex_export.training.result import ResultFolder

PATCH = 128  # pixels
PATCHES = 6  # of each photograph
NOISE_STEPS = 500  # after which the sampler's tiles of noise are drawn anew


class SpaceTrainer(ResumableTraining):
    """A space's training; `run` may be interrupted between any two steps and resumed later."""

    def __init__(
        self,
        recipe: SpaceRecipe,
        materials: Sequence[Material],
        held_out: Sequence[Material],
        seed: int,
        device: torch.device,
        folder: ResultFolder,
        ranks: Ranks | None = None,
    ) -> None:
        make_reproducible(seed, device)
        self.recipe, self.materials, self.held_out = recipe, materials, held_out
        self.device, self.folder, self.ranks = device, folder, ranks or Ranks()
        self.watch = DivergenceWatch()
        self.generator = make_generator(recipe).to(device)
        self.encoder = make_encoder(recipe.encoder, recipe.code).to(device)
        self._images = [m.image.to(device) for m in materials]
        self._summaries = self._summarize(materials)
        self.encoder.calibrate(self._summaries.flatten(0, 1))
        if isinstance(self.generator, ConditionedLattice):
            self.generator.measure(self.encoder.code(self._summaries[:8, 0]))
        self._make_targets()
        self.critic: Critic | None = None
        if recipe.critic is not None:
            c = recipe.critic
            penalties = Penalties(c.penalty, c.drift, c.rms)
            self.critic = Critic(3, c.widths, c.equalized_learning_rate, penalties).to(device)
            self._critic_adam = Adam(self.critic.parameters(), c.learning_rate, c.betas)
        self._trained = nn.ModuleList([self.generator, self.encoder])
        groups = parameter_groups(self._trained, recipe.optimizer.per_layer_scaling)
        self._adam = Adam(groups, recipe.optimizer.learning_rate, recipe.optimizer.betas)
        if not self.ranks.is_main:
            torch.manual_seed(self.ranks.seed(seed))
        self._noise: TiledNoise | None = None

    def _summarize(self, materials: Sequence[Material]) -> Tensor:
        """Encoder inputs [material, patch, ...] that do not change in training."""
        parts = [patches(m.image, PATCH, PATCHES).to(self.device) for m in materials]
        return torch.stack([self.encoder.summary(p) for p in parts])

    def _make_targets(self) -> None:
        losses = self.recipe.losses
        self._targets = make_targets(losses, self.recipe.slicing, load_descriptor(losses))
        with fast_autocast(self.device):
            for image in self._images:
                for _, measured in self._targets.values():
                    measured.add(image)

    def _train_step(self) -> dict[str, float]:
        """One step; its losses."""
        settings = self.recipe.optimizer
        rate = settings.learning_rate * min(1.0, (self.step + 1) / max(1, settings.warmup_steps))
        rate *= half_cosine(self.progress, 1.0, settings.final_rate)
        for group in self._adam.param_groups:
            group["lr"] = rate * group["scale"]
        self._adam.zero_grad(set_to_none=True)
        count = self.recipe.slicing.batch
        chosen = torch.randperm(len(self.materials))[:count].tolist()
        with fast_autocast(self.device):
            slices = self.draw(self._codes(chosen), self.recipe.slicing.size)
        gradient, sums = self._gradient(slices.detach().float(), chosen)
        if not gradient.isfinite().all():
            raise gradient_not_finite(self.step, sums)
        slices.backward(gradient.to(slices.dtype))
        self.ranks.average_gradients(self._trained)
        if self.recipe.gradient_norm:
            norm = self.recipe.gradient_norm
            torch.nn.utils.clip_grad_norm_(self._trained.parameters(), norm)
        self._adam.step()
        if self.critic is not None:
            sums["critic"] = self._train_critic(slices.detach().float(), chosen)
        self.watch.check(self.step, sums)
        self.step += 1
        return {"rate": rate, **sums}

    def _codes(self, chosen: Sequence[int]) -> Tensor:
        """A code of one patch of each material, with the recipe's noise."""
        patch = torch.randint(self._summaries.shape[1], (len(chosen),)).tolist()
        picked = torch.stack([self._summaries[i, p] for i, p in zip(chosen, patch, strict=True)])
        codes = self.encoder.code(picked)
        return codes + self.recipe.losses.code_noise * torch.randn_like(codes)

    def draw(self, codes: Tensor, size: int) -> Tensor:
        """Slices [material, channel, size, size] of the solids of `codes`."""
        if isinstance(self.generator, ConditionedLattice):
            return self._draw_lattice(codes, size)
        points = torch.stack([self._plane(size) for _ in codes]).to(self.device)
        if self._noise is None or self.step % NOISE_STEPS == 0:
            self._noise = TiledNoise(self.generator.settings.octaves, self.device)
        y = self.generator(codes, points, self._noise)
        return y.transpose(1, 2).unflatten(2, (size, size))

    def _draw_lattice(self, codes: Tensor, size: int) -> Tensor:
        assert isinstance(self.generator, ConditionedLattice)
        directions = self.recipe.directions
        normal = "xyz".index(directions[self.step % len(directions)])
        columns, rows = SLICE_AXES["xyz"[normal]]
        period = 2 ** (self.generator.levels - 1)
        lo = tuple(int(v) for v in torch.randint(period, (3,)))
        box = Box(lo, (lo[0] + 1, lo[1] + size, lo[2] + size))
        noise = self.generator.draw_noise(box, len(codes))
        y = self.generator(codes, noise, box, (normal, rows, columns))
        return y.squeeze(2).flip(2)

    def _plane(self, size: int) -> Tensor:
        planes = self.recipe.slicing.planes
        direction = "xyz"[int(torch.randint(3, ()))] if planes == "axes" else ""
        return random_plane(planes, direction, size)

    def _gradient(self, slices: Tensor, chosen: Sequence[int]) -> tuple[Tensor, dict[str, float]]:
        """Gradient with respect to all slices, and the mean of each loss."""
        slices.requires_grad_()
        gradient = torch.zeros_like(slices)
        sums: dict[str, float] = {}
        unit = self.recipe.losses.mixing == "unit-gradients"
        with fast_autocast(self.device):
            for place, index in enumerate(chosen):
                one = slices[place : place + 1].detach().requires_grad_()
                turned = random_symmetry(one, self.recipe.slicing.symmetry)
                terms = {n: (w, t.loss(index, turned)) for n, (w, t) in self._targets.items()}
                terms |= self._critic_terms(turned, index)
                for name, (weight, loss) in terms.items():
                    (part,) = torch.autograd.grad(loss, one, retain_graph=True)
                    scale = 1 / (part.norm() + 1e-12) if unit else 1.0
                    gradient[place] += weight / len(chosen) * scale * part[0]
                    sums[name] = sums.get(name, 0.0) + loss.item() / len(chosen)
        return gradient, sums

    def _critic_terms(self, one: Tensor, index: int) -> dict[str, tuple[float, Tensor]]:
        if self.critic is None:
            return {}
        losses, terms = self.recipe.losses, {}
        features = self.critic.features(one)
        if losses.style:
            real = self._reals(index, 1)
            terms["style"] = (losses.style, style_loss(self.critic, features, real))
        if losses.adversarial:
            terms["adversarial"] = (losses.adversarial, adversarial_loss(self.critic, features))
        return terms

    def _reals(self, index: int, count: int) -> Tensor:
        size = self.recipe.slicing.size
        crops = random_crops(self._images[index], count, size, size)
        return random_symmetry(crops, self.recipe.slicing.symmetry)

    def _train_critic(self, slices: Tensor, chosen: Sequence[int]) -> float:
        assert self.critic is not None
        reals = torch.cat([self._reals(index, 1) for index in chosen])
        self._critic_adam.zero_grad(set_to_none=True)
        with fast_autocast(self.device):
            loss = self.critic.loss(slices, reals)
        loss.backward()
        self.ranks.average_gradients(self.critic)
        self._critic_adam.step()
        if not math.isfinite(loss.item()):
            raise not_finite(self.step, "the critic's loss")
        return loss.item()

    @torch.no_grad()
    def material_codes(self, materials: Sequence[Material] | None = None) -> Tensor:
        """Mean code [material, code] of each material's patches."""
        summaries = self._summaries if materials is None else self._summarize(materials)
        return torch.stack([self.encoder.code(s).mean(0) for s in summaries])

    @torch.no_grad()
    def save_preview(self) -> None:
        """Sheet of pairs: photograph and slice; first training photographs, then held-out ones."""
        if not self.ranks.is_main:
            return
        shown = [*self.materials[:: max(1, len(self.materials) // 8)][:8], *self.held_out[:16]]
        with torch.random.fork_rng(devices=[self.device] if self.device.type == "cuda" else []):
            torch.manual_seed(0)
            kept, self._noise, step, self.step = self._noise, None, self.step, 1
            codes = self.material_codes(shown)
            images = []
            for material, code in zip(shown, codes, strict=True):
                y = self.draw(code[None], PATCH)[0].float().cpu()
                photograph = material.restored(material.image)[:, :PATCH, :PATCH]
                images += [photograph, material.restored(y)]
            self._noise, self.step = kept, step
        self.folder.save_preview(sheet_of_rows(images, 8))

    def state(self) -> dict[str, Any]:
        critic = None
        if self.critic is not None:
            critic = {"model": self.critic.state_dict(), "adam": self._critic_adam.state_dict()}
        cuda = torch.cuda.get_rng_state(self.device) if self.device.type == "cuda" else None
        tiles = None if self._noise is None else self._noise.state()
        own = {"rng": torch.get_rng_state(), "cuda_rng": cuda, "noise": tiles}
        return {
            "generator": self.generator.state_dict(),
            "encoder": self.encoder.state_dict(),
            "optimizer": self._adam.state_dict(),
            "critic": critic,
            "codes": self.material_codes().cpu(),
            "colors": torch.stack([m.colors for m in self.materials]),
            "watch": self.watch.state(),
            "step": self.step,
            "seconds": self.seconds,
            "ranks": self.ranks.gather(own),
        }

    def restore(self, state: dict[str, Any]) -> None:
        own = self.ranks.own(state["ranks"])
        self.generator.load_state_dict(state["generator"])
        self.encoder.load_state_dict(state["encoder"])
        self._adam.load_state_dict(state["optimizer"])
        if self.critic is not None:
            self.critic.load_state_dict(state["critic"]["model"])
            self._critic_adam.load_state_dict(state["critic"]["adam"])
        self.watch.restore(state["watch"])
        self.step, self.seconds = state["step"], state["seconds"]
        if own["noise"] is not None:
            self._noise = TiledNoise.restored(own["noise"].to(self.device))
        torch.set_rng_state(own["rng"])
        if own["cuda_rng"] is not None and self.device.type == "cuda":
            torch.cuda.set_rng_state(own["cuda_rng"], self.device)
        if self.ranks.is_main:
            self.folder.trim_log(self.step)


def make_generator(recipe: SpaceRecipe) -> ConditionedLattice | ConditionedSampler:
    if recipe.lattice is not None:
        return ConditionedLattice(recipe.lattice, recipe.code, recipe.style_width)
    assert recipe.sampler is not None
    return ConditionedSampler(recipe.sampler, recipe.code, recipe.style_width)
