"""Conditioned generators: one network whose solid depends on a code z.

GramGAN (Portenier et al. 2020), section 3.2: a style w = f(z) scales and shifts the hidden units of
every layer, y = gamma * phi(W x + psi(eta) + b) + delta (equation 5), and Q(z) gives the transforms
T_i of the sampler. In the lattice family gamma and delta take the place of batch normalization,
before the leaky ReLU. For one z all of this folds into plain weights.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import torch
import torch.nn.functional as F
from torch import Tensor, nn

from solidtex_export.generators.lattice import BLOCK_MARGIN, BaseLattice, upsampled
from solidtex_export.generators.planes import XYZ, Axes, PlaneConvolution, from_planes, to_planes
from solidtex_export.generators.regions import Box
from solidtex_export.generators.sampler import HiddenLayer, _equalized, _rotations, ladder
from solidtex_export.spaces.noise import TiledNoise
from solidtex_export.spaces.settings import LatticeSettings, SamplerSettings

STYLE_SLOPE = 0.2
CONDITION_GAIN = 0.3  # initial deviation of gamma and delta around 1 and 0
MATRIX_SHARE = 0.5  # of bounded transforms: the largest entry that is added to the unit matrix
SCALE_SHARE = 0.5
STRETCH_SHARE = 0.9
BOUNDED, LINEAR = 11, 9  # numbers of Q for one octave


class TwoLayers(nn.Module):
    """Two dense layers with a leaky ReLU between them: f and Q."""

    def __init__(self, inputs: int, width: int, outputs: int, last_gain: float = 1.0) -> None:
        super().__init__()
        self.first = nn.Linear(inputs, width)
        self.last = nn.Linear(width, outputs)
        nn.init.kaiming_normal_(self.first.weight, a=STYLE_SLOPE)
        nn.init.normal_(self.last.weight, 0, last_gain / math.sqrt(width))
        for layer in (self.first, self.last):
            nn.init.zeros_(layer.bias)

    def forward(self, x: Tensor) -> Tensor:
        return self.last(F.leaky_relu(self.first(x), STYLE_SLOPE))

    def tensors(self, name: str) -> dict[str, Tensor]:
        return {
            f"{name}.0.weight": self.first.weight,
            f"{name}.0.bias": self.first.bias,
            f"{name}.1.weight": self.last.weight,
            f"{name}.1.bias": self.last.bias,
        }


class Conditions(nn.Module):
    """g_l of equation 5: gamma and delta [batch, channel] of each layer from the style."""

    def __init__(self, style_width: int, channels: dict[str, int]) -> None:
        super().__init__()
        self.heads = nn.ModuleDict()
        for name, count in channels.items():
            head = nn.Linear(style_width, 2 * count)
            nn.init.normal_(head.weight, 0, CONDITION_GAIN / math.sqrt(style_width))
            nn.init.zeros_(head.bias)
            self.heads[name.replace(".", "-")] = head

    def forward(self, style: Tensor) -> dict[str, tuple[Tensor, Tensor]]:
        found = {}
        for name, head in self.heads.items():
            gamma, delta = head(style).chunk(2, dim=1)
            found[name.replace("-", ".")] = (1 + gamma, delta)
        return found

    def tensors(self) -> dict[str, Tensor]:
        found = {}
        for name, head in self.heads.items():
            for kind in ("weight", "bias"):
                found[f"condition.{name.replace('-', '.')}.{kind}"] = getattr(head, kind)
        return found


class ConditionedSampler(nn.Module):
    """Sampler S of equations 1 and 5, with transforms Q(z)."""

    scales: Tensor

    def __init__(self, settings: SamplerSettings, code: int, style_width: int) -> None:
        super().__init__()
        n, width, layers = settings.octaves, settings.width, settings.hidden_layers
        if settings.noise_at == "hidden" and n % (layers - 1):
            raise ValueError(f"octaves: found {n}, expected a multiple of {layers - 1}")
        self.settings = settings
        self.bin_size = n // (layers - 1) if settings.noise_at == "hidden" else n
        self.constant = nn.Parameter(torch.randn(width))
        self.hidden: Sequence[HiddenLayer] = nn.ModuleList(  # type: ignore[assignment]
            HiddenLayer(width, self._octaves(l), settings.slope) for l in range(layers)
        )
        self.output_weight = nn.Parameter(torch.randn(3, width))
        self.output_bias = nn.Parameter(torch.zeros(3))
        self.style = TwoLayers(code, style_width, style_width)
        names = [f"hidden.{l}" for l in range(layers)]
        names = names if settings.condition_at == "hidden" else names[:1]
        self.conditions = Conditions(style_width, dict.fromkeys(names, width))
        self.register_buffer(
            "scales", ladder(1 / settings.coarsest, 1 / settings.finest, n).flatten()
        )
        base = _rotations(n)
        stretch = torch.full((n, 1), settings.grain)
        for i in range(1, settings.round_octaves + 1):
            stretch[i * n // settings.round_octaves - 1] = 1
        base[:, :, 2] /= stretch
        bounded = settings.transforms == "bounded"
        self.base = nn.Parameter(base) if bounded else None
        self.transforms = TwoLayers(code, style_width, n * (BOUNDED if bounded else LINEAR), 0.5)
        if not bounded:
            with torch.no_grad():
                self.transforms.last.bias.copy_(base.flatten())

    def _octaves(self, layer: int) -> int:
        if self.settings.noise_at == "input":
            first = 1 if self.settings.condition_at == "input" else 0
            return self.settings.octaves if layer == first else 0
        return self.bin_size if layer < self.settings.hidden_layers - 1 else 0

    def octave_transforms(self, codes: Tensor) -> Tensor:
        """T_i [batch, octave, 3, 3]."""
        q = self.transforms(codes).view(len(codes), self.settings.octaves, -1)
        scales = self.scales[:, None, None]
        if self.base is None:
            return scales * q.unflatten(2, (3, 3))
        soft = q / (1 + q.abs())
        matrix = torch.eye(3, device=q.device) + MATRIX_SHARE * soft[..., :9].unflatten(2, (3, 3))
        t = SCALE_SHARE * soft[..., 9, None, None]
        e = STRETCH_SHARE * soft[..., 10]
        transforms = scales * (1 + t) / (1 - t) * (matrix @ self.base)
        stretch = torch.stack([torch.ones_like(e), torch.ones_like(e), (1 + e) / (1 - e)], dim=-1)
        return transforms * stretch[:, :, None, :]

    def forward(self, codes: Tensor, points: Tensor, noise: TiledNoise) -> Tensor:
        """Values [batch, point, channel] at points [batch, point, 3]."""
        with torch.autocast(points.device.type, enabled=False):
            positions = torch.einsum(
                "bnij,bpj->bnpi", self.octave_transforms(codes.float()), points
            )
            eta = noise(positions).transpose(1, 2)
        conditions = self.conditions(self.style(codes))
        x = self.constant.expand(len(codes), 1, -1)
        first = 0
        for l, layer in enumerate(self.hidden):
            octaves = self._octaves(l)
            x = layer(x, eta[:, :, first : first + octaves] if octaves else None)
            first += octaves
            if f"hidden.{l}" in conditions:
                gamma, delta = conditions[f"hidden.{l}"]
                if self.settings.condition_at == "input":
                    gamma = torch.ones_like(gamma)
                x = torch.addcmul(delta[:, None].to(x.dtype), x, gamma[:, None].to(x.dtype))
        return F.linear(x, _equalized(self.output_weight), self.output_bias)

    @torch.no_grad()
    def tensors(self) -> dict[str, Tensor]:
        """Tensors of the space file, of five hidden layers with a bin of octaves each but the last.

        Where the network has none, transforms, noise columns and conditions are zero.
        """
        width, layers = self.settings.width, self.settings.hidden_layers
        found: dict[str, Tensor] = {"constant": self.constant}
        found |= self.style.tensors("style")
        if self.settings.noise_at == "hidden":
            found |= self.transforms.tensors("transforms") | {"scales": self.scales}
            if self.base is not None:
                found["base"] = self.base
        else:
            found |= self._padded_transforms()
        conditions = self.conditions.tensors()
        for l, layer in enumerate(self.hidden):
            name = f"hidden.{l}"
            found |= {f"{name}.{k}": v for k, v in layer.effective().items()}
            if l < layers - 1 and layer.noise is None:
                found[f"{name}.noise"] = torch.zeros(width, self.bin_size)
            weight = conditions.get(f"condition.{name}.weight")
            bias = conditions.get(f"condition.{name}.bias")
            if weight is None or bias is None:
                weight, bias = (
                    torch.zeros(2 * width, self.style.last.out_features),
                    torch.zeros(2 * width),
                )
            elif self.settings.condition_at == "input":
                weight, bias = weight.clone(), bias.clone()
                weight[:width], bias[:width] = 0, 0
            found[f"condition.{name}.weight"], found[f"condition.{name}.bias"] = weight, bias
        found["output.weight"] = _equalized(self.output_weight)
        found["output.bias"] = self.output_bias
        return found

    def _padded_transforms(self) -> dict[str, Tensor]:
        """Q with one bin of all octaves, in the place of the layer that receives them."""
        n, bins = self.settings.octaves, self.settings.hidden_layers - 1
        place = next(l for l in range(bins) if self._octaves(l))
        tensors = self.transforms.tensors("transforms")
        each = tensors["transforms.1.bias"].numel() // n
        weight = torch.zeros(bins * n * each, tensors["transforms.1.weight"].shape[1])
        bias, scales = torch.zeros(bins * n * each), torch.zeros(bins * n)
        rows = slice(place * n * each, (place + 1) * n * each)
        weight[rows], bias[rows] = tensors["transforms.1.weight"], tensors["transforms.1.bias"]
        scales[place * n : (place + 1) * n] = self.scales
        tensors |= {"transforms.1.weight": weight, "transforms.1.bias": bias, "scales": scales}
        if self.base is not None:
            base = torch.eye(3).repeat(bins * n, 1, 1)
            base[place * n : (place + 1) * n] = self.base
            tensors["base"] = base
        return tensors

    def document(self) -> dict[str, object]:
        s = self.settings
        octaves = s.octaves * (1 if s.noise_at == "hidden" else s.hidden_layers - 1)
        return {
            "octaves": octaves,
            "hidden_layers": s.hidden_layers,
            "width": s.width,
            "slope": s.slope,
            "transforms": s.transforms,
        }


class ConditionedLattice(BaseLattice):
    """Gutierrez et al.'s generator with gamma and delta in place of batch normalization."""

    def __init__(self, settings: LatticeSettings, code: int, style_width: int) -> None:
        super().__init__(settings.levels, settings.noise_channels, 3)
        self.settings = settings
        self.convolutions = nn.ModuleDict()
        step, channels = settings.step_channels, {}
        for stage in range(1, settings.levels + 1):
            blocks = {f"cb{stage}_1": (settings.noise_channels, step)}
            if stage > 1:
                blocks[f"cb{stage}_2"] = (stage * step, stage * step)
            for block, (inputs, outputs) in blocks.items():
                for i, kernel in ((1, 3), (2, 3), (3, 1)):
                    name = f"{block}.conv{i}"
                    self.convolutions[name.replace(".", "-")] = PlaneConvolution(
                        inputs if i == 1 else outputs, outputs, kernel
                    )
                    channels[name] = outputs
        self.last_conv = PlaneConvolution(settings.levels * step, 3, 1)
        self.style = TwoLayers(code, style_width, style_width)
        self.conditions = Conditions(style_width, channels)
        self._smooth_coarse_features()

    @torch.no_grad()
    def _smooth_coarse_features(self, share: float = 0.5) -> None:
        """As generators/init.py: begin with smooth upsampling, so that outlines form first."""
        row = torch.tensor([1.0, 2.0, 1.0])
        kernel = torch.einsum("x,y,z->xyz", row, row, row)
        kernel /= kernel.norm()
        for stage in range(2, self.levels + 1):
            weight = self.convolution(f"cb{stage}_2.conv1").weight
            coarse = weight[:, : (stage - 1) * self.settings.step_channels]
            size = coarse.square().sum((2, 3, 4)).mean().sqrt()
            mixing = size * torch.randn(coarse.shape[:2])
            coarse.mul_((1 - share) ** 0.5)
            coarse.add_(share**0.5 * mixing[..., None, None, None] * kernel)

    def convolution(self, name: str) -> PlaneConvolution:
        found = self.convolutions[name.replace(".", "-")]
        assert isinstance(found, PlaneConvolution)
        return found

    def noise_boxes(self, box: Box) -> list[Box]:
        boxes = self.feature_boxes(box)
        fine = [b.grown(2 * BLOCK_MARGIN) for b in boxes[:-1]]
        return [*fine, boxes[-1].grown(BLOCK_MARGIN)]

    def forward(
        self, codes: Tensor, noise: Sequence[Tensor], box: Box, axes: Axes = XYZ,
        measure: bool = False,
    ) -> Tensor:  # fmt: skip
        """Values [batch, channel, x, y, z] of `box`, as LatticeGenerator.forward.

        `measure` scales each convolution so that its output has zero mean and unit variance.
        """
        conditions = self.conditions(self.style(codes))
        boxes = self.feature_boxes(box)

        def block(x: Tensor, name: str) -> Tensor:
            for i in (1, 2, 3):
                layer = f"{name}.conv{i}"
                convolution = self.convolution(layer)
                y = convolution(x, axes)
                if measure:
                    convolution.bias -= y.float().mean((0, 1, 2, 3))
                    deviation = y.float().std((0, 1, 2, 3)) + 1e-5
                    convolution.weight /= deviation.view(-1, 1, 1, 1, 1)
                    convolution.bias /= deviation
                    y = convolution(x, axes)
                gamma, delta = (c[:, None, None, None].to(y.dtype) for c in conditions[layer])
                x = F.leaky_relu(torch.addcmul(delta, y, gamma), self.settings.slope)
            return x

        y = block(to_planes(noise[-1]), "cb1_1")
        for stage in range(2, self.levels + 1):
            level = self.levels - stage
            joint = boxes[level].grown(BLOCK_MARGIN)
            coarse = upsampled(y, boxes[level + 1], joint)
            fine = block(to_planes(noise[level]), f"cb{stage}_1")
            y = block(torch.cat([coarse, fine], dim=4), f"cb{stage}_2")
        y = from_planes(self.last_conv(y, axes))
        if measure:
            self.last_conv.weight /= y.float().std()
        return y

    @torch.no_grad()
    def measure(self, codes: Tensor) -> None:
        """Normalize the initial activations, in place of batch normalization."""
        box = Box((0, 0, 0), (48, 48, 48))
        self(codes, self.draw_noise(box, len(codes)), box, measure=True)

    @torch.no_grad()
    def tensors(self) -> dict[str, Tensor]:
        """Tensors of the space file."""
        found = self.style.tensors("style") | self.conditions.tensors()
        layers = {n: self.convolution(n) for n in (k.replace("-", ".") for k in self.convolutions)}
        layers["last_conv"] = self.last_conv
        for name, layer in layers.items():
            found |= {f"{name}.weight": layer.weight, f"{name}.bias": layer.bias}
        return found

    def document(self) -> dict[str, object]:
        return self.settings.model_dump()
