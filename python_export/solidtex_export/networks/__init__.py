"""Networks trained on photographs, from files of weights that the user provides."""

from __future__ import annotations

from pathlib import Path

from solidtex_export.networks import squeezenet, vgg
from solidtex_export.networks.squeezenet import SqueezeNet, squeezenet_of
from solidtex_export.networks.vgg import Vgg19
from solidtex_export.networks.weights import WeightsError
from solidtex_export.state_file import read_state

EXPECTED = f"{vgg.EXPECTED}, or {squeezenet.EXPECTED}"


def load_network(path: Path) -> Vgg19 | SqueezeNet:
    """The network whose weights are in a file, recognized by the names of its tensors."""
    state = read_state(path, EXPECTED, WeightsError)
    if vgg.recognizes(state):
        return Vgg19(state, path)
    if squeezenet.recognizes(state):
        return squeezenet_of(state, path)
    keys = ", ".join(str(key) for key in list(state)[:3])
    raise WeightsError(f"{path}: found keys {keys} ..., expected {EXPECTED}")
