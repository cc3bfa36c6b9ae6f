"""Training of Alanov et al. 2019, algorithm 2: generator, encoder and three discriminators.

All losses of a step are those of the networks before it, so every network is evaluated once.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import torch
from torch import Tensor, nn
from torch.optim import Adam
from torch.optim.swa_utils import AveragedModel, get_ema_multi_avg_fn

from solidtex_export.generators.regions import Box
from solidtex_export.images.sheet import sheet_of_rows
from solidtex_export.spaces.alanov import losses
from solidtex_export.spaces.alanov.losses import Logits
from solidtex_export.spaces.alanov.materials import Texture, random_pair
from solidtex_export.spaces.alanov.networks import (
    MEASURED_BATCHES,
    CodeDiscriminator,
    Encoder,
    Generator,
    PairDiscriminator,
    PatchDiscriminator,
    networks_of,
)
from solidtex_export.spaces.alanov.settings import AlanovRecipe
from solidtex_export.training.acceleration import fast_autocast
from solidtex_export.training.divergence import DivergenceWatch, not_finite
from solidtex_export.training.loop import ResumableTraining
from solidtex_export.training.ranks import Ranks
from solidtex_export.training.reproducible import make_reproducible
from solidtex_export.training.result import ResultFolder

SHOWN = 16  # materials in a preview
REPRODUCTIONS = 3  # of each


class AlanovTrainer(ResumableTraining):
    """A training that may be interrupted between any two steps and resumed later."""

    def __init__(
        self,
        recipe: AlanovRecipe,
        textures: Sequence[Texture],
        held_out: Sequence[Texture],
        seed: int,
        device: torch.device,
        folder: ResultFolder,
        ranks: Ranks | None = None,
    ) -> None:
        make_reproducible(seed, device)
        self.recipe, self.textures, self.held_out = recipe, textures, held_out
        self.device, self.folder, self.ranks = device, folder, ranks or Ranks()
        self.watch = DivergenceWatch()
        self.generator = Generator(recipe)
        self.encoder = Encoder(recipe)
        self.networks: dict[str, nn.Module] = {
            "generator": self.generator,
            "encoder": self.encoder,
            "patches": PatchDiscriminator(recipe),
            "pairs": PairDiscriminator(recipe),
            "codes": CodeDiscriminator(recipe),
        }
        settings = recipe.optimizer
        self._adams: dict[str, Adam] = {}
        for name, network in self.networks.items():
            network.to(device).train()
            self._adams[name] = Adam(
                network.parameters(),
                settings.learning_rate,
                settings.betas,
                weight_decay=settings.weight_decay,
            )
        self._model = nn.ModuleDict({"generator": self.generator, "encoder": self.encoder})
        self._averages: AveragedModel | None = None
        if recipe.average:
            average = get_ema_multi_avg_fn(recipe.average)
            self._averages = AveragedModel(self._model, multi_avg_fn=average)
        if not self.ranks.is_main:
            torch.manual_seed(self.ranks.seed(seed))

    def _shown(self) -> tuple[Generator, Encoder]:
        """The generator and the encoder that are the model."""
        return networks_of(self._averages.module if self._averages else self._model)

    def _train_step(self) -> dict[str, float]:
        """One step of all networks; their losses."""
        with fast_autocast(self.device):
            found = self._logits()
            weights = self.recipe.losses
            wanted = {
                "patches": losses.patch_discriminator_loss(found),
                "pairs": losses.pair_discriminator_loss(found),
                "codes": losses.code_discriminator_loss(found),
                "generator": losses.generator_loss(found, weights),
                "encoder": losses.encoder_loss(found, weights),
            }
        for name, loss in wanted.items():
            self._differentiate(name, loss)
        for name, adam in self._adams.items():
            self.ranks.average_gradients(self.networks[name])
            adam.step()
        if self._averages:
            self._averages.update_parameters(self._model)
        sums = {name: loss.item() for name, loss in wanted.items()}
        self.watch.check(self.step, sums)
        self.step += 1
        return sums

    def _logits(self) -> Logits:
        first, second = self._real_pairs()
        codes = losses.sampled_codes(*(v.float() for v in self.encoder(first)))
        prior = torch.randn_like(codes)
        # One batch: both kinds of codes are normalized by the same statistics, as in the end.
        box = self.generator.random_box(self.recipe.crops.size)
        fakes = self.generator(torch.cat([prior, codes]), box)
        reproduced = fakes[len(prior) :]
        patches, pairs, judge = (self.networks[n] for n in ("patches", "pairs", "codes"))
        assert isinstance(pairs, PairDiscriminator)
        embeddings = pairs.embed(torch.cat([first, second, reproduced])).chunk(3)
        on_prior, on_reproduced = patches(fakes).chunk(2)
        found = (
            patches(first),
            on_prior,
            on_reproduced,
            pairs.compare(embeddings[0], embeddings[1]),
            pairs.compare(embeddings[0], embeddings[2]),
            judge(prior),
            judge(codes),
        )
        return Logits(*(logits.float() for logits in found))

    def _real_pairs(self) -> tuple[Tensor, Tensor]:
        """Two batches of crops; the same place in both has the same texture."""
        chosen = torch.randint(len(self.textures), (self.recipe.crops.batch,)).tolist()
        pairs = [random_pair(self.textures[i].values, self.recipe.crops) for i in chosen]
        first, second = (torch.stack(crops).to(self.device) for crops in zip(*pairs, strict=True))
        return first, second

    def _differentiate(self, name: str, loss: Tensor) -> None:
        """Set the gradients of one network; a loss says nothing about the others."""
        parameters = list(self.networks[name].parameters())
        gradients = torch.autograd.grad(loss, parameters, retain_graph=True, allow_unused=True)
        for parameter, gradient in zip(parameters, gradients, strict=True):
            if gradient is not None and not gradient.isfinite().all():
                raise not_finite(self.step, f"a gradient of the {name}")
            parameter.grad = gradient

    def material_codes(self, textures: Sequence[Texture] | None = None) -> Tensor:
        """Mean code [material, code] of each material's crops."""
        return torch.stack([codes.mean(0) for codes in self._crop_codes(textures)])

    @torch.no_grad()
    def _crop_codes(self, textures: Sequence[Texture] | None = None) -> list[Tensor]:
        """Codes [crop, code] of each material."""
        _, encoder = self._shown()
        with self._fixed_draws():
            encoder.measure(self._real_pairs()[0] for _ in range(MEASURED_BATCHES))
        codes = []
        for texture in self.textures if textures is None else textures:
            crops = texture.crops_for_code(self.recipe.crops.size)
            codes.append(torch.cat([encoder(c[None].to(self.device))[0] for c in crops]))
        encoder.train()
        return codes

    @contextmanager
    def _fixed_draws(self) -> Iterator[None]:
        """Random numbers that are always the same, and leave those of the training alone."""
        with torch.random.fork_rng(devices=[self.device] if self.device.type == "cuda" else []):
            torch.manual_seed(0)
            yield

    @torch.no_grad()
    def save_preview(self) -> None:
        """Sheet of rows: a crop and reproductions of it, first of training materials."""
        if not self.ranks.is_main:
            return
        textures = [*self.textures[: SHOWN - len(self.held_out)], *self.held_out][:SHOWN]
        size = self.recipe.crops.size
        generator, _ = self._shown()
        codes = self.material_codes(textures)
        with self._fixed_draws():
            batch = torch.randn(MEASURED_BATCHES, *codes.shape, device=self.device)
            generator.measure(torch.cat([batch, codes.expand_as(batch)], dim=1), size)
            images = []
            for texture, code in zip(textures, codes, strict=True):
                box = Box((0,) * self.recipe.dimensions, (size,) * self.recipe.dimensions)
                samples = generator(code.expand(REPRODUCTIONS, -1), box).float().cpu()
                images += [_picture(texture.crops_for_code(size)[0]), *map(_picture, samples)]
            generator.train()
        self.folder.save_preview(sheet_of_rows(images, 2 * (1 + REPRODUCTIONS)))

    def state(self) -> dict[str, Any]:
        cuda = torch.cuda.get_rng_state(self.device) if self.device.type == "cuda" else None
        codes = self._crop_codes()
        return {
            **{name: network.state_dict() for name, network in self.networks.items()},
            "averages": self._averages.state_dict() if self._averages else None,
            "optimizers": {name: adam.state_dict() for name, adam in self._adams.items()},
            "material_codes": torch.stack([c.mean(0) for c in codes]).cpu(),
            "crop_codes": torch.cat(codes).cpu(),
            "watch": self.watch.state(),
            "step": self.step,
            "seconds": self.seconds,
            "ranks": self.ranks.gather({"rng": torch.get_rng_state(), "cuda_rng": cuda}),
        }

    def restore(self, state: dict[str, Any]) -> None:
        own = self.ranks.own(state["ranks"])
        for name, network in self.networks.items():
            network.load_state_dict(state[name])
            self._adams[name].load_state_dict(state["optimizers"][name])
        if self._averages:
            self._averages.load_state_dict(state["averages"])
        self.watch.restore(state["watch"])
        self.step, self.seconds = state["step"], state["seconds"]
        torch.set_rng_state(own["rng"])
        if own["cuda_rng"] is not None and self.device.type == "cuda":
            torch.cuda.set_rng_state(own["cuda_rng"], self.device)
        if self.ranks.is_main:
            self.folder.trim_log(self.step)


def _picture(values: Tensor) -> Tensor:
    """Colors [3, row, column] of an image, or of the middle section of a volume."""
    if values.ndim == 4:
        values = values[:, :, :, values.shape[3] // 2].transpose(1, 2).flip(1)
    return (0.5 + 0.5 * values).expand(3, -1, -1)
