"""solidtex-import-solidtexturenets against an independent evaluation of the published network."""

import itertools
from collections import OrderedDict
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
import torch.nn.functional as F

from solidtex import Texture
from solidtex_export.commands import import_solidtexturenets
from solidtex_export.export import random_models
from solidtex_export.export.file_format import model_file
from solidtex_export.export.verification import noise

TOLERANCE = 2e-4
ORIGINS = [(0, 0, 0), (32, -64, 96), (-7, 13, 30), (-33, -1, -100), (1001, 2, -5)]
SIZE = (6, 5, 7)


def published_state(levels: int = 6, noise_channels: int = 3, step: int = 4) -> dict[str, Any]:
    """A state dict as the public implementation saves it: outputs of BGR * 255 less the means."""
    state = random_models.lattice_state(levels, noise_channels, step, seed=5)
    for key in ("color_mean", "color_basis"):
        del state[key]
    state["last_conv.weight"] = state["last_conv.weight"] * 90
    state["last_conv.bias"] = torch.tensor([10.0, -20.0, 35.0])
    return OrderedDict(state)


def normed(state: dict[str, torch.Tensor], name: str, x: torch.Tensor) -> torch.Tensor:
    weight, bias, mean, var = (
        state[f"{name}.{part}"].double()
        for part in ("weight", "bias", "running_mean", "running_var")
    )
    return F.batch_norm(x, mean, var, weight, bias, training=False, eps=1e-5)


def block(state: dict[str, torch.Tensor], name: str, x: torch.Tensor) -> torch.Tensor:
    for i in (1, 2, 3):
        weight, bias = (state[f"{name}.conv{i}.{part}"].double() for part in ("weight", "bias"))
        x = F.leaky_relu(normed(state, f"{name}.bn{i}", F.conv3d(x, weight, bias)), 0.01)
    return x


def exact(state: dict[str, torch.Tensor], origin: tuple[int, ...], size: tuple[int, ...]) -> Any:
    """The network in float64, level by level, with margins that are wide enough and cut at the end.

    Every tensor carries the absolute coordinate of its first voxel.
    """
    levels = max(int(key[2]) for key in state if key.startswith("cb") and key[3] == "_")
    channels = state["cb1_1.conv1.weight"].shape[1]
    x, first = None, (0, 0, 0)
    for stage in range(1, levels + 1):
        level = levels - stage
        lo = tuple((o >> level) - 12 for o in origin)
        hi = tuple(((o + s - 1) >> level) + 13 for o, s in zip(origin, size, strict=True))
        z = noise.block("solidtexturenets", "uniform", 0, level, channels, lo, hi)
        fine = block(state, f"cb{stage}_1", torch.from_numpy(z)[None])
        fine_first = tuple(l + 2 for l in lo)
        if x is None:
            x, first = fine, fine_first
            continue
        up = normed(state, f"up{stage - 1}.bn", F.interpolate(x, scale_factor=2, mode="nearest"))
        up_first = tuple(2 * f for f in first)
        joint, first = common(up, up_first, fine, fine_first)
        x = block(state, f"cb{stage}_2", joint)
        first = tuple(f + 2 for f in first)
    weight, bias = (state[f"last_conv.{part}"].double() for part in ("weight", "bias"))
    bgr = F.conv3d(x, weight, bias)[0] / 255
    bgr = bgr + torch.tensor([0.40760392, 0.45795686, 0.48501961]).double().view(3, 1, 1, 1)
    cut = tuple(slice(o - f, o - f + s) for o, f, s in zip(origin, first, size, strict=True))
    return bgr[(slice(None), *cut)].flip(0).permute(1, 2, 3, 0).numpy()


def common(a: torch.Tensor, a_first: Any, b: torch.Tensor, b_first: Any) -> Any:
    """Both volumes, cut to where they overlap, one after the other along the channels."""
    parts, first = [], tuple(map(max, a_first, b_first))
    ends = [
        min(fa + na, fb + nb)
        for fa, na, fb, nb in zip(a_first, a.shape[2:], b_first, b.shape[2:], strict=True)
    ]
    for volume, begin in ((a, a_first), (b, b_first)):
        cut = [slice(f - g, e - g) for f, e, g in zip(first, ends, begin, strict=True)]
        parts.append(volume[:, :, cut[0], cut[1], cut[2]])
    return torch.cat(parts, dim=1), first


@pytest.mark.parametrize("sizes", [(6, 3, 4), (3, 1, 5)])
def test_imported_model_is_the_published_network(
    sizes: tuple[int, int, int], tmp_path: Path
) -> None:
    state = published_state(*sizes)
    checkpoint, output = tmp_path / "params.pytorch", tmp_path / "marble.solidtex"
    torch.save(state, checkpoint)
    assert import_solidtexturenets.main([str(checkpoint), "-o", str(output)]) == 0
    worst = 0.0
    with Texture(output) as texture:
        for origin in ORIGINS:
            found, expected = texture.eval_box(origin, SIZE), exact(state, origin, SIZE)
            assert expected.std() > 0.02  # a difference in the texture would be seen
            worst = max(worst, float(np.abs(found - expected).max()))
    print(f"\nsizes {sizes}: largest difference {worst:.2e}")
    assert worst <= TOLERANCE


def test_metadata_and_older_checkpoints(tmp_path: Path) -> None:
    """Without num_batches_tracked, as parameters, in torch's old container."""
    state = published_state(2, 2, 3)
    state = {k: v for k, v in state.items() if not k.endswith("num_batches_tracked")}
    state["last_conv.bias"] = torch.nn.Parameter(state["last_conv.bias"])
    checkpoint, output = tmp_path / "params.pytorch", tmp_path / "marble.solidtex"
    torch.save(state, checkpoint, _use_new_zipfile_serialization=False)
    options = ["--name", "Marble 3", "--license", "CC0-1.0", "--source", "a quarry"]
    assert import_solidtexturenets.main([str(checkpoint), "-o", str(output), *options]) == 0
    document = model_file.read(output).document
    assert document["name"] == "Marble 3" and document["license"] == "CC0-1.0"
    assert document["noise"] == {"scheme": "solidtexturenets"}
    assert document["exemplar"] == {"source": "a quarry"}
    slopes = {node["slope"] for node in document["field"]["nodes"] if node["op"] == "leaky_relu"}
    assert slopes == {0.01}


class Unsafe:
    def __reduce__(self) -> Any:
        return print, ("executed",)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda s: s.pop("cb2_1.bn1.running_var"), "cb2_1.bn1.running_var: found nothing"),
        (lambda s: s.update({"cb9": torch.ones(1)}), "cb9: found an unexpected key"),
        (lambda s: s.update({"up1.bn.bias": torch.ones(7)}), "up1.bn.bias: found shape (7,)"),
        (lambda s: s.update({"up1.bn.bias": "text"}), "up1.bn.bias: found str"),
        (lambda s: s.update({"color_mean": torch.ones(3)}), "use solidtex-export"),
        (lambda s: s.update({"unsafe": Unsafe()}), "no state dict that loads safely"),
        (
            lambda s: s.update(
                {"last_conv.weight": torch.ones(4, 6, 1, 1, 1), "last_conv.bias": torch.ones(4)}
            ),
            "last_conv.weight: found shape (4, 6, 1, 1, 1), expected 3 outputs",
        ),
    ],
)
def test_wrong_checkpoints_are_named(
    change: Any, message: str, tmp_path: Path, capsys: Any
) -> None:
    state = published_state(2, 2, 3)
    change(state)
    checkpoint, output = tmp_path / "params.pytorch", tmp_path / "marble.solidtex"
    torch.save(state, checkpoint)
    assert import_solidtexturenets.main([str(checkpoint), "-o", str(output)]) == 1
    printed = capsys.readouterr()
    assert str(checkpoint) in printed.err and message in printed.err
    assert "executed" not in printed.out
    assert not output.exists()


def test_missing_checkpoint(tmp_path: Path, capsys: Any) -> None:
    arguments = [str(tmp_path / "none.pytorch"), "-o", str(tmp_path / "m.solidtex")]
    assert import_solidtexturenets.main(arguments) == 1
    assert "none.pytorch: found no such file" in capsys.readouterr().err


def test_evaluation_of_this_test_does_not_depend_on_the_box() -> None:
    state = published_state(3, 2, 2)
    whole = exact(state, (-3, 30, 5), (4, 5, 3))
    for voxel in itertools.product(range(0, 4, 3), range(0, 5, 2), range(3)):
        origin = tuple(o + v for o, v in zip((-3, 30, 5), voxel, strict=True))
        np.testing.assert_allclose(
            exact(state, origin, (1, 1, 1))[0, 0, 0], whole[voxel], atol=1e-9
        )
