"""Settings of the models of Alanov et al. 2019, for textures in 2D and porous media in 3D."""

from __future__ import annotations

from typing import Annotated, Literal

from solidtex_export.settings import Array, Pair, Settings, within

Width = Annotated[int, within(1, 4096)]
Weight = Annotated[float, within(0, 1e6)]
Slope = Annotated[float, within(0, 1)]


class NoiseSizes(Settings):
    """Channels of the noise tensor beside the code."""

    local: Annotated[int, within(1, 256)] = 20
    """d^l: independent normal values."""
    periodic: Annotated[int, within(0, 64)] = 4
    """d^p: sines whose frequencies depend on the code."""
    hidden: Width = 40
    """Hidden units between the code and the frequencies."""


class Networks(Settings):
    """Channels of the hidden layers, and the negative slope of all leaky ReLUs."""

    generator: Array[Width] = (512, 256, 128, 64)
    encoder: Array[Width] = (64, 128, 256, 512)
    patches: Array[Width] = (64, 128, 256, 512)
    pairs: Array[Width] = (64, 128, 256, 512)
    embedding: Width = 96
    """Channels of the embeddings whose products the discriminator of pairs receives."""
    products: Array[Width] = (48,)
    """Channels of its 1x1 convolutions."""
    codes: Array[Width] = (512, 256)
    slope: Slope = 0.2


class Crops(Settings):
    """Crops of one step."""

    size: Annotated[int, within(8, 1024)] = 160
    batch: Annotated[int, within(1, 1024)] = 64
    pairs: Literal["anywhere", "nearby"] = "anywhere"
    """nearby: both crops of a pair from one window that is a tenth larger (algorithm 1), for
    photographs of several materials.
    """


class Weights(Settings):
    """Weights of the losses, equations 7 and 8."""

    generator_patches: Weight = 1.0
    generator_pairs: Weight = 1.0
    encoder_codes: Weight = 1.0
    encoder_pairs: Weight = 1.0


class AdamSettings(Settings):
    """Adam for all five networks."""

    learning_rate: Annotated[float, within(1e-9, 10)] = 2e-4
    betas: Pair[Annotated[float, within(0, 0.99999)]] = (0.5, 0.999)
    weight_decay: Annotated[float, within(0, 1)] = 1e-4


class AlanovRecipe(Settings):
    """Everything of a training that does not depend on the materials."""

    dimensions: Literal[2, 3]
    """2: photographs; 3: volumes of two phases."""
    code: Annotated[int, within(1, 1024)] = 2
    """d^g"""
    noise: NoiseSizes = NoiseSizes()
    networks: Networks = Networks()
    crops: Crops = Crops()
    losses: Weights = Weights()
    optimizer: AdamSettings = AdamSettings()
    average: Annotated[float, within(0, 0.99999)] = 0.0
    """What a step keeps of the moving average of generator and encoder, which are the model then;
    0: there is no average, as in the paper.
    """

    @property
    def channels(self) -> int:
        return 3 if self.dimensions == 2 else 1

    @property
    def smallest_crop(self) -> int:
        """Side of the smallest crop that every discriminator and the encoder accept."""
        deepest = max(map(len, (self.networks.encoder, self.networks.patches, self.networks.pairs)))
        return 2**deepest * (1 if self.dimensions == 2 else 4)
