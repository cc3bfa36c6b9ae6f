"""Critics on the features of the frozen descriptor network."""

from __future__ import annotations

import pytest
import torch
from small_trainings import of_solid
from torch import Tensor

from solidtex_export.discriminators.projected import ProjectedCritic
from solidtex_export.losses.descriptor.network import DescriptorNetwork, layer_names, smallest_image
from solidtex_export.losses.descriptor.weights import PROCEDURAL, load_weights
from solidtex_export.training.presets import PresetError, load_recipe

LAYERS = ("conv1_2", "conv3_2")


def photograph(channels: int = 3) -> Tensor:
    image = of_solid("marble").image[:, :64, :64].mean(0, keepdim=True)
    image = (image - image.mean()) / image.std()
    return torch.cat([image.roll(7 * i, 2) for i in range(channels)])


def critic(channels: int = 3, layers: tuple[str, ...] = LAYERS) -> ProjectedCritic:
    torch.manual_seed(0)
    return ProjectedCritic(load_weights(PROCEDURAL).network, photograph(channels), layers, 8)


def test_it_learns_to_separate_noise_from_the_photograph() -> None:
    discriminator = critic()
    real = photograph()[None].expand(2, -1, -1, -1)
    adam = torch.optim.Adam(discriminator.parameters(), 1e-2)
    first = None
    for _ in range(30):
        fakes = real.flatten(2)[:, :, torch.randperm(64 * 64)].view_as(real)
        loss = discriminator.loss(fakes, real)
        first = loss.item() if first is None else first
        adam.zero_grad()
        loss.backward()
        adam.step()
    assert loss.item() < 0.2 * first
    on_fakes, on_real = (
        discriminator.score(discriminator.features(images)) for images in (fakes, real)
    )
    assert on_fakes.shape == on_real.shape == (2,)
    assert bool((on_real > on_fakes).all())


def test_the_frozen_network_is_not_part_of_the_state() -> None:
    """The frozen network is neither trained nor saved; what it normalizes by is saved."""
    discriminator = critic()
    assert all("heads" in name for name, _ in discriminator.named_parameters())
    names = set(discriminator.state_dict())
    assert {f"{n}_{part}" for n in LAYERS for part in ("mean", "gain")} <= names
    assert not any("network" in name for name in names)
    assert not any(p.requires_grad for p in load_weights(PROCEDURAL).network.parameters())


@pytest.mark.parametrize("channels", [1, 3, 5])
def test_every_channel_is_used(channels: int) -> None:
    discriminator = critic(channels)
    image = photograph(channels)[None].requires_grad_()
    (slope,) = torch.autograd.grad(discriminator.score(discriminator.features(image)).sum(), image)
    assert bool((slope.abs().amax((0, 2, 3)) > 0).all())


@pytest.mark.parametrize("layer", layer_names())
def test_the_smallest_image_is_enough_and_needed(layer: str) -> None:
    network, side = DescriptorNetwork(), smallest_image([layer])
    discriminator = ProjectedCritic(network, torch.randn(3, side, side), (layer,), 4)
    assert discriminator.score(discriminator.features(torch.randn(1, 3, side, side))).shape == (1,)
    with pytest.raises(ValueError, match=f"found .* pixels, expected .* {layer}"):
        ProjectedCritic(network, torch.randn(3, side - 1, side - 1), (layer,), 4)


def test_layers_are_checked() -> None:
    for layers in ('["conv9_1"]', "[]"):
        with pytest.raises(
            PresetError, match=r"projected_critic\.layers: found .* expected some of conv1_1"
        ):
            load_recipe("sampler", [f"projected_critic.layers={layers}"])
