"""Lattice family on the GPU: compute passes in WGSL, one for each node of the graph.

A pass fills the box of a tensor in a storage buffer. `LatticeProgram` is data: the source, the
weights and the steps. `LatticeProgram.passes` states sizes and shifts for one box of voxels.
"""

from __future__ import annotations

import base64
import math
import struct
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from importlib import resources

import numpy as np

from solidtex_export.export.file_format.checks import ModelFileError
from solidtex_export.export.file_format.model_file import ModelFile
from solidtex_export.export.shader.emitter import Emitter
from solidtex_export.export.shader.languages import Glsl, Wgsl
from solidtex_export.export.shader.network import noise_functions
from solidtex_export.export.shader.program import Program
from solidtex_export.export.verification import noise
from solidtex_export.generators.regions import Box, Node, needed, regions

GROUP = (8, 8, 1)
"""Invocations of a workgroup along z, y, and x times the groups of four channels."""
RUN = 4
"""Voxels along z that an invocation of a convolution computes."""
MAX_SOURCES = 2


@dataclass(frozen=True)
class Step:
    """One compute pass, for any box."""

    name: str
    """Of the tensor that it fills."""
    entry: str
    """Entry point of the source."""
    sources: tuple[str, ...]
    channels: int
    node: Node
    weights: int = 0
    """Its first element of the weights."""
    slope: float = 1.0

    @property
    def groups(self) -> int:
        return -(-self.channels // 4)

    @property
    def reads_weights(self) -> bool:
        return self.entry.startswith(("noise", "periodic", "conv", "affine"))

    def workgroups(self, size: Sequence[int]) -> tuple[int, int, int]:
        run = RUN if self.entry.startswith("conv3d") else 1
        counts = (-(-size[2] // run), size[1], size[0] * self.groups)
        x, y, z = (-(-count // group) for count, group in zip(counts, GROUP, strict=True))
        return x, y, z


@dataclass(frozen=True)
class Pass:
    """A step for one box."""

    step: Step
    box: Box
    elements: int
    """Of four channels, in the tensor that it fills."""
    uniform: bytes
    workgroups: tuple[int, int, int]

    def document(self) -> dict[str, object]:
        """For programs without this package: docs/shader-export.md."""
        step = self.step
        found: dict[str, object] = {
            "entry": step.entry,
            "tensor": step.name,
            "sources": step.sources,
            "reads_weights": step.reads_weights,
            "elements": self.elements,
            "workgroups": self.workgroups,
            "uniform": base64.b64encode(self.uniform).decode(),
        }
        if not step.sources:
            keys = step.channels if step.node["op"] == "noise" else 0
            numbers = {"level": step.node["level"], "lo": self.box.lo}
            found["noise"] = numbers | {"weights": step.weights, "keys": keys}
        return found


@dataclass(frozen=True)
class LatticeProgram:
    source: str
    """WGSL. Bindings of group 0: the pass's uniform, weights, two sources, the result."""
    weights: np.ndarray
    """uint32 [element, 4]"""
    steps: Sequence[Step]
    output: str
    channels: int
    nodes: Sequence[Node]

    def passes(self, box: Box) -> list[Pass]:
        """What to run, in order, for the voxels of a box."""
        boxes = regions(list(self.nodes), box)
        # Parts of a concatenation have its box.
        boxes |= {step.name: boxes[step.node["name"]] for step in self.steps}
        channels = {step.name: step.channels for step in self.steps}
        return [self._pass(step, boxes, channels) for step in self.steps]

    def _pass(self, step: Step, boxes: dict[str, Box], channels: dict[str, int]) -> Pass:
        box = boxes[step.name]
        lo = [v & 0xFFFFFFFF for v in box.lo]
        data = struct.pack("<4i3Ii", *box.size, step.channels, *lo, step.weights)
        for name in step.sources:
            shift = _shift(step.node, box, boxes[name])
            groups = -(-channels[name] // 4)
            data += struct.pack("<8i", *boxes[name].size, channels[name], *shift, groups)
        data += bytes(32 * (MAX_SOURCES - len(step.sources)))
        data += struct.pack("<2if4x", step.groups, step.node.get("kernel", 0), step.slope)
        elements = math.prod(box.size) * step.groups
        return Pass(step, box, elements, data, step.workgroups(box.size))


def _shift(node: Node, box: Box, source: Box) -> list[int]:
    """What a step adds to a voxel of its box for a voxel of its source, before it halves."""
    if node["op"] in ("upsample", "conv_transpose3d"):
        return [l + node.get("padding", 0) - 2 * s for l, s in zip(box.lo, source.lo, strict=True)]
    return [l - s for l, s in zip(needed(node, box).lo, source.lo, strict=True)]


def lattice_program(model: ModelFile, seed: int = 0) -> LatticeProgram:
    document = model.document
    if document["family"] != "field":
        raise ModelFileError(
            f"{document['name']}: found a model of the sampler family, expected the lattice family"
        )
    exporter = _Exporter(model, seed)
    for node in document["field"]["nodes"]:
        exporter.add(node)
    steps = exporter.fused()
    weights = np.concatenate([*exporter.weights, np.zeros((1, 4), np.uint32)])
    output = document["field"]["output"]
    channels = len(document["channels"])
    nodes = document["field"]["nodes"]
    return LatticeProgram(_source(steps), weights, steps, output, channels, nodes)


def _source(steps: Sequence[Step]) -> str:
    package = resources.files(__package__)
    parts = [package.joinpath("lattice.wgsl").read_text()]
    parts.append(_noise_source(Wgsl))
    kernels = {step.node["kernel"] for step in steps if step.node["op"] == "conv3d"}
    parts += [_conv3d_source(kernel) for kernel in sorted(kernels)]
    return "\n".join(parts)


def fragment_source() -> str:
    """The passes of all models as one fragment shader of WebGL 2, from behind its version.

    ENTRY has to be defined as the operation, a step's entry without the size of its kernel, and ROW
    as the elements in a row of the textures.
    """
    template = resources.files(__package__).joinpath("lattice.glsl").read_text()
    head, tail = template.split("\n\n", 1)
    return "\n\n".join([head, _noise_source(Glsl), tail])


def _noise_source(language: type[Emitter]) -> str:
    program = Program("noise", noise_functions("noise"), [], np.zeros((0, 4), np.float32), [])
    emitter = language(program, "constant", "float")
    return "\n".join(emitter.function(f) for f in program.functions)


def _conv3d_source(kernel: int) -> str:
    """Loops along z are written out: arrays that an index addresses leave the registers."""
    run, columns = range(RUN), range(RUN + kernel - 1)
    sums = [f"  var sum{v} = weight(w);" for v in run]
    # The last run may read behind its row: those sums are not stored.
    reads = [f"        let in{v} = first[row + {v}];" for v in columns]
    products = []
    for z in range(kernel):
        rows = ", ".join(f"weight(w + {4 * z + c})" for c in range(4))
        products.append(f"        let taps{z} = mat4x4<f32>({rows});")
        products += [f"        sum{v} += taps{z} * in{v + z};" for v in run]
    stores = [
        f"  if (at.voxel.z + {v} < step.size.z) {{ put(Place(at.voxel + vec3<i32>(0, 0, {v}),"
        f" at.group), rectified(sum{v}, step.slope)); }}"
        for v in run
    ]
    return f"""
// conv3d with a kernel of {kernel}^3

@compute @workgroup_size(8, 8) fn conv3d_{kernel}(@builtin(global_invocation_id) id: vec3<u32>) {{
  let at = place(id, {RUN});
  if (!is_inside(at)) {{ return; }}
  let source = step.sources[0];
  var w = at.group * (1 + 4 * source.groups * {kernel**3});
{_lines(sums)}
  w++;
  for (var q = 0; q < source.groups; q++) {{
    for (var x = 0; x < {kernel}; x++) {{
      for (var y = 0; y < {kernel}; y++) {{
        let row = element_of(0, q, at.voxel + vec3<i32>(x, y, 0));
{_lines(reads)}
{_lines(products)}
        w += {4 * kernel};
      }}
    }}
  }}
{_lines(stores)}
}}
"""


def _lines(lines: Sequence[str]) -> str:
    return "\n".join(lines)


class _Exporter:
    """Adds the nodes in order."""

    def __init__(self, model: ModelFile, seed: int) -> None:
        self.model, self.seed = model, seed
        self.weights: list[np.ndarray] = []
        self.steps: dict[str, Step] = {}

    def add(self, node: Node) -> None:
        if node["op"] not in _OPERATIONS:
            raise ModelFileError(
                f"{self.model.document['name']}: node {node['name']}: found the operation"
                f" {node['op']!r}, expected one of {', '.join(_OPERATIONS)}; a newer solidtex may"
                " export it"
            )
        _OPERATIONS[node["op"]](self, node)

    def step(
        self,
        node: Node,
        entry: str,
        channels: int,
        weights: np.ndarray | None = None,
        slope: float = 1.0,
    ) -> None:
        sources = tuple(node.get("inputs", []))
        first = self.store(weights)
        self.steps[node["name"]] = Step(node["name"], entry, sources, channels, node, first, slope)

    def store(self, weights: np.ndarray | None) -> int:
        first = sum(map(len, self.weights))
        if weights is not None:
            self.weights.append(weights.astype(np.float32).view(np.uint32)
                                if weights.dtype.kind == "f" else weights)  # fmt: skip
        return first

    def tensor(self, node: Node, name: str) -> np.ndarray:
        return self.model.tensors[f"{node['name']}.{name}"]

    def channels(self, node: Node) -> int:
        """Of the first input."""
        return self.steps[node["inputs"][0]].channels

    def fused(self) -> list[Step]:
        """Steps in order; a convolution applies the rectifier that alone reads it."""
        readers = [name for step in self.steps.values() for name in step.sources]
        result: dict[str, Step] = {}
        for step in self.steps.values():
            source = result.get(step.sources[0]) if step.sources else None
            is_alone = source is not None and readers.count(source.name) == 1
            if source and is_alone and step.entry == "leaky_relu" and "conv" in source.entry:
                del result[source.name]
                step = replace(source, name=step.name, slope=step.slope)
            result[step.name] = step
        return list(result.values())


def _noise(exporter: _Exporter, node: Node) -> None:
    scheme = exporter.model.document["noise"]["scheme"]
    if scheme != "solidtex-1":
        raise ModelFileError(
            f"{exporter.model.document['name']}: noise scheme: found {scheme!r}, expected"
            " 'solidtex-1': a shader has integers of 32 bits"
        )
    keys = [
        [int(word) for word in noise.solidtex_1_key(exporter.seed, node["level"], channel)]
        for channel in range(node["channels"])
    ]
    entry = f"noise_{node['distribution']}"
    exporter.step(node, entry, node["channels"], np.array(keys, np.uint32))


def _periodic(exporter: _Exporter, node: Node) -> None:
    waves = np.array(node["waves"], np.uint32)
    exporter.step(node, "periodic", len(waves), waves)


def _conv3d(exporter: _Exporter, node: Node) -> None:
    packed = _packed(exporter.tensor(node, "weight"), exporter.tensor(node, "bias"))
    exporter.step(node, f"conv3d_{node['kernel']}", node["out_channels"], packed)


def _conv_transpose3d(exporter: _Exporter, node: Node) -> None:
    weight = exporter.tensor(node, "weight").swapaxes(0, 1)
    packed = _packed(weight, exporter.tensor(node, "bias"))
    exporter.step(node, "conv_transpose3d", node["out_channels"], packed)


def _packed(weight: np.ndarray, bias: np.ndarray) -> np.ndarray:
    """For each four outputs: their biases, then their weights by four inputs, tap and input."""
    outputs, inputs = (-(-n // 4) for n in weight.shape[:2])
    padding = [(0, 4 * outputs - weight.shape[0]), (0, 4 * inputs - weight.shape[1])]
    taps = np.pad(weight.reshape(*weight.shape[:2], -1), [*padding, (0, 0)])
    taps = taps.reshape(outputs, 4, inputs, 4, -1).transpose(0, 2, 4, 3, 1)
    biases = np.pad(bias, padding[0]).reshape(outputs, 1, 4)
    return np.concatenate([biases, taps.reshape(outputs, -1, 4)], axis=1).reshape(-1, 4)


def _upsample(exporter: _Exporter, node: Node) -> None:
    exporter.step(node, "upsample", exporter.channels(node))


def _concat(exporter: _Exporter, node: Node) -> None:
    """Two at a time."""
    inputs, name = node["inputs"], node["name"]
    left = inputs[0]
    for index, right in enumerate(inputs[1:], 1):
        is_last = index == len(inputs) - 1
        channels = sum(exporter.steps[source].channels for source in (left, right))
        made = name if is_last else f"{name}/{index}"
        exporter.steps[made] = Step(made, "concat", (left, right), channels, node)
        left = made


def _affine(exporter: _Exporter, node: Node) -> None:
    channels = exporter.channels(node)
    padding = (0, -channels % 4)
    rows = [np.pad(exporter.tensor(node, name).ravel(), padding).reshape(-1, 4)
            for name in ("scale", "shift")]  # fmt: skip
    exporter.step(node, "affine", channels, np.stack(rows, axis=1).reshape(-1, 4))


def _leaky_relu(exporter: _Exporter, node: Node) -> None:
    exporter.step(node, "leaky_relu", exporter.channels(node), slope=float(node["slope"]))


def _function(entry: str) -> Callable[[_Exporter, Node], None]:
    return lambda exporter, node: exporter.step(node, entry, exporter.channels(node))


_OPERATIONS: dict[str, Callable[[_Exporter, Node], None]] = {
    "noise": _noise,
    "periodic": _periodic,
    "conv3d": _conv3d,
    "conv_transpose3d": _conv_transpose3d,
    "upsample": _upsample,
    "concat": _concat,
    "affine": _affine,
    "leaky_relu": _leaky_relu,
    "tanh": _function("tanh_"),
    "sigmoid": _function("sigmoid"),
    "softmax": _function("softmax"),
}
