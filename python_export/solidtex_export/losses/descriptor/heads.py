"""Maps from the descriptor network's features to those of its teacher, SqueezeNet."""

from __future__ import annotations

from torch import Tensor, nn

from solidtex_export.losses.descriptor.network import layer_names

# The network's layer that predicts the teacher's layers of a group.
LAYERS = {"relu1": "conv2_2", "relu2": "conv3_2", "relu3": "conv4_2",
          "half_relu1": "conv3_2", "half_relu2": "conv4_2", "half_relu3": "conv5_2"}  # fmt: skip
CHANNELS = {"relu1": (96,), "relu2": (128, 128, 256), "relu3": (256, 384, 384)}


def group_of(name: str) -> str:
    """relu2 of relu2_1, half_relu2 of half_relu2_1."""
    return name.rsplit("_", 1)[0]


class Heads(nn.ModuleDict):
    """A map of 1 x 1 for each of the teacher's layers, by its name."""

    def __init__(self, widths: tuple[tuple[int, ...], ...]) -> None:
        of_layer = dict(zip(layer_names(widths), sum(widths, ()), strict=True))
        super().__init__({
            f"{group}_{i}": nn.Conv2d(of_layer[layer], channels, 1)
            for group, layer in LAYERS.items()
            for i, channels in enumerate(CHANNELS[group.removeprefix("half_")], 1)
        })  # fmt: skip

    def predicted(self, features: dict[str, Tensor]) -> dict[str, Tensor]:
        """The teacher's features, normalized over its data, at the network's places."""
        return {
            name: head(features[layer])
            for name, head in self.items()
            if (layer := LAYERS[group_of(name)]) in features
        }
