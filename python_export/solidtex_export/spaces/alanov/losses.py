"""Losses of section 2 of Alanov et al. 2019, from the discriminators' logits.

The generator's and the encoder's losses replace log(1 - D) by -log D, as equations 2, 4 and 6.
"""

from __future__ import annotations

from dataclasses import dataclass

import torch
import torch.nn.functional as F
from torch import Tensor

from solidtex_export.spaces.alanov.settings import Weights


@dataclass(frozen=True)
class Logits:
    """Logits of the three discriminators for one step.

    `prior` and `reproduced` are those of D_psi for G(z) of the prior's and of the encoder's codes.
    """

    real: Tensor
    prior: Tensor
    reproduced: Tensor
    real_pairs: Tensor
    fake_pairs: Tensor
    prior_codes: Tensor
    codes: Tensor


def judged_real(logits: Tensor) -> Tensor:
    """-log D, averaged over samples and positions."""
    return F.softplus(-logits).mean()


def judged_fake(logits: Tensor) -> Tensor:
    """-log(1 - D), averaged over samples and positions."""
    return F.softplus(logits).mean()


def patch_discriminator_loss(found: Logits) -> Tensor:
    """-V_x of equation 1."""
    fake = judged_fake(found.prior) + judged_fake(found.reproduced)
    return judged_real(found.real) + fake


def pair_discriminator_loss(found: Logits) -> Tensor:
    """-V_xx of equation 3."""
    return judged_real(found.real_pairs) + judged_fake(found.fake_pairs)


def code_discriminator_loss(found: Logits) -> Tensor:
    """-V_z of equation 5."""
    return judged_real(found.prior_codes) + judged_fake(found.codes)


def generator_loss(found: Logits, weights: Weights) -> Tensor:
    """Equation 7."""
    patches = judged_real(found.prior) + judged_real(found.reproduced)
    pairs = judged_real(found.fake_pairs)
    return weights.generator_patches * patches + weights.generator_pairs * pairs


def encoder_loss(found: Logits, weights: Weights) -> Tensor:
    """Equation 8."""
    codes, pairs = judged_real(found.codes), judged_real(found.fake_pairs)
    return weights.encoder_codes * codes + weights.encoder_pairs * pairs


def sampled_codes(mean: Tensor, deviation: Tensor) -> Tensor:
    """Codes of q(z | x), differentiable in both (the reparameterization trick)."""
    return mean + deviation * torch.randn_like(mean)
