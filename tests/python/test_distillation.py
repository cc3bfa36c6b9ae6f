"""The descriptor network learns the features of SqueezeNet."""

from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

import numpy as np
import pytest
import torch
from PIL import Image
from safetensors import safe_open
from safetensors.torch import save_file

from solidtex_export.commands import pretrain_descriptor
from solidtex_export.losses.descriptor.heads import LAYERS
from solidtex_export.losses.descriptor.network import DescriptorNetwork
from solidtex_export.losses.descriptor.weights import WeightsError, load_weights
from solidtex_export.losses.learned import LearnedDescriptor
from solidtex_export.networks.squeezenet import SqueezeNet
from solidtex_export.research.descriptor import distil
from solidtex_export.research.procedural import families

Network = TypeVar("Network", bound=torch.nn.Module)


def positive(network: Network) -> Network:
    """Weights by which each pixel of a feature's field of view raises the feature."""
    for name, parameter in network.named_parameters():
        parameter.data = parameter.data.abs() if "weight" in name else 0 * parameter.data + 1
    return network


def seen_from(features: Callable[[torch.Tensor], torch.Tensor], index: int) -> float:
    """The middle of the columns that change a feature of a row, in pixels."""
    image = torch.zeros(1, 3, 192, 192)
    before = features(image)[0, 0, :, index]
    changed = []
    for column in range(192):
        image[..., column] = 100
        if not torch.equal(features(image)[0, 0, :, index], before):
            changed.append(column)
        image[..., column] = 0
    assert changed[0] > 0 and changed[-1] < 191, "the border hides a part"
    return (changed[0] + changed[-1]) / 2


@pytest.mark.parametrize(("layer", "index"), [("conv2_2", 30), ("conv3_2", 20), ("conv4_2", 11)])
def test_places_of_the_network(layer: str, index: int) -> None:
    network = positive(DescriptorNetwork(((2, 2), (2, 2), (2, 2), (2, 2), (2, 2))))
    grid = distil.NETWORK_GRIDS[layer]
    with torch.no_grad():
        middle = seen_from(lambda image: network.features(image)[layer], index)
    assert middle == grid.first + grid.stride * index


TEACHERS = {"relu1_1": 30, "relu2_2": 20, "relu3_1": 10, "half_relu1_1": 20, "half_relu2_1": 10}


@pytest.mark.parametrize(("layer", "index"), TEACHERS.items())
def test_places_of_the_teacher(layer: str, index: int) -> None:
    network = positive(SqueezeNet())
    grid = distil.teacher_grid(layer.rsplit("_", 1)[0])
    with torch.no_grad():
        middle = seen_from(lambda image: network.named_features(image)[layer], index)
    assert middle == grid.first + grid.stride * index


@pytest.mark.parametrize("group", list(LAYERS))
def test_resampling_reads_at_the_teachers_places(group: str) -> None:
    grid, wanted = distil.NETWORK_GRIDS[LAYERS[group]], distil.teacher_grid(group)
    size = 9
    places = grid.first + grid.stride * torch.arange(size, dtype=torch.float32)
    ramps = torch.stack(torch.meshgrid(places, places, indexing="ij"))[None]
    rows, columns = distil.resampled(ramps, grid, wanted)[0]
    inside = [p for i in range(200) if places[0] <= (p := wanted.first + wanted.stride * i)]
    expected = torch.tensor([p for p in inside if p <= places[-1]])
    torch.testing.assert_close(rows[:, 0], expected.float())
    torch.testing.assert_close(columns[0], expected.float())


@pytest.fixture
def files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Options of a small distillation."""
    monkeypatch.setattr(families, "ROUND", 2)
    for name, value in {"STATISTICS_STEPS": 1, "PHOTOGRAPHS": 2, "PROCEDURAL": 1, "SIDE": 96,
                        "BATCH": 2}.items():  # fmt: skip
        monkeypatch.setattr(distil, name, value)
    monkeypatch.setattr(pretrain_descriptor, "SIDE", 96)
    torch.manual_seed(0)
    save_file(SqueezeNet().state_dict(), tmp_path / "squeezenet.safetensors")
    pixels = np.random.default_rng(1).integers(0, 256, (120, 140, 3), np.uint8)
    Image.fromarray(pixels).save(tmp_path / "photo.png")
    return ["--features", str(tmp_path / "squeezenet.safetensors"),
            "--photos", str(tmp_path / "photo.png"), "--seed", "3"]  # fmt: skip


def test_a_resumed_distillation_equals_an_uninterrupted_one(
    files: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def train(name: str) -> int:
        return pretrain_descriptor.main([*files, "--steps", "3", "-o", str(tmp_path / name)])

    assert train("whole") == 0
    step = pretrain_descriptor.Pretrainer._train_step

    def interrupted(pretrainer: pretrain_descriptor.Pretrainer) -> dict[str, float]:
        if pretrainer.step == 2:
            pretrainer.save()
            raise OSError("stopped")
        return step(pretrainer)

    with monkeypatch.context() as m:
        m.setattr(pretrain_descriptor.Pretrainer, "_train_step", interrupted)
        assert train("parts") == 1
    assert train("parts") == 0
    one, other = (tmp_path / p / "weights.safetensors" for p in ("whole", "parts"))
    assert one.read_bytes() == other.read_bytes()

    trained = load_weights(one)
    assert trained.heads is not None
    assert trained.metadata["photographs"][0]["name"] == "photo"
    descriptor = LearnedDescriptor(trained)
    torch.manual_seed(2)
    image, other_image = torch.randn(2, 1, 3, 96, 96)
    target = descriptor.measure(image)
    assert float(descriptor.distance(image, target)) == 0
    assert float(descriptor.distance(other_image.cumsum(3) / 5, target)) > 0


def test_a_distilled_file_without_a_head_is_refused(files: list[str], tmp_path: Path) -> None:
    assert pretrain_descriptor.main([*files, "--steps", "1", "-o", str(tmp_path / "a")]) == 0
    path = tmp_path / "a" / "weights.safetensors"
    with safe_open(path, "pt") as file:
        metadata = file.metadata()
        tensors = {k: file.get_tensor(k) for k in file.keys()}  # noqa: SIM118
    del tensors["heads.relu2_3.bias"]
    save_file(tensors, path, metadata)
    with pytest.raises(WeightsError, match=r"heads.relu2_3.bias: found nothing, expected \(256,\)"):
        load_weights(path)


def test_options_belong_together(files: list[str], tmp_path: Path) -> None:
    with pytest.raises(SystemExit) as refused:
        pretrain_descriptor.main([*files[:2], "-o", str(tmp_path / "a")])
    assert refused.value.code == 2
