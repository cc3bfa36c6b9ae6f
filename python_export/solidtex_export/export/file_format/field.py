"""The lattice family's part of a model file: the graph, and the tensors that it needs."""

from collections.abc import Callable
from dataclasses import dataclass

from solidtex_export.export.file_format.checks import Fields, Shape, check_name, fail, show

MAX_NODES = 4096
MAX_CHANNELS = 4096
MAX_LEVEL = 20
MAX_CONV_KERNEL = 15
MAX_TRANSPOSE_KERNEL = 16
MAX_VOXEL_VALUES = 1 << 26
MAX_VOXEL_WORK = 1 << 36


@dataclass
class Node:
    """A node with everything known about its tensor."""

    name: str
    op: str
    inputs: list[int]
    level: int
    channels: int
    tensors: dict[str, Shape]
    kernel: int = 1
    padding: int = 0


@dataclass
class Context:
    """What a node's reader sees: its JSON object, and the nodes before it."""

    fields: Fields
    nodes: list[Node]
    indices: dict[str, int]
    noise_scheme: str


def field_tensors(field: Fields, channel_count: int, noise_scheme: str) -> dict[str, Shape]:
    """Checks the graph; returns the tensors that must be in the file."""
    field.allow_only(("nodes", "output"))
    nodes: list[Node] = []
    indices: dict[str, int] = {}
    for index, value in enumerate(field.array("nodes", 1, MAX_NODES)):
        fields = Fields(field.label, f"{field.where}.nodes[{index}]", value)
        node = _read_node(Context(fields, nodes, indices, noise_scheme))
        nodes.append(node)
        indices[node.name] = index
    _check_output(field, nodes, channel_count)
    _check_cost(field, nodes)
    return {name: shape for node in nodes for name, shape in node.tensors.items()}


def _read_node(context: Context) -> Node:
    fields = context.fields
    name = fields.name("name")
    if name in context.indices:
        raise fields.wrong("name", "a name that no earlier node has")
    node = _READERS[fields.choice("op", tuple(_READERS))](context)
    if not 1 <= node.channels <= MAX_CHANNELS:
        found, expected = f"{node.channels} channels", f"1 to {MAX_CHANNELS}"
        raise fail(fields.label, f"{fields.where} ({show(name)})", found, expected)
    return node


def _inputs(context: Context, low: int, high: int) -> list[int]:
    fields = context.fields
    names = fields.array("inputs", low, high)
    for position, name in enumerate(names):
        where = f"{fields.path('inputs')}[{position}]"
        check_name(fields.label, where, name)
        if name not in context.indices:
            raise fail(fields.label, where, show(name), "the name of an earlier node")
    return [context.indices[name] for name in names]


def _read_noise(context: Context) -> Node:
    fields = context.fields
    fields.allow_only(("name", "op", "level", "channels", "distribution"))
    distribution = fields.choice("distribution", ("uniform", "normal"))
    if distribution == "normal" and context.noise_scheme == "solidtexturenets":
        raise fields.wrong("distribution", '"uniform", the only one of scheme "solidtexturenets"')
    level = fields.integer("level", 0, MAX_LEVEL)
    channels = fields.integer("channels", 1, MAX_CHANNELS)
    return Node(fields.string("name"), "noise", [], level, channels, {})


def _read_conv3d(context: Context) -> Node:
    fields = context.fields
    fields.allow_only(("name", "op", "inputs", "out_channels", "kernel"))
    (index,) = _inputs(context, 1, 1)
    source = context.nodes[index]
    name = fields.string("name")
    channels = fields.integer("out_channels", 1, MAX_CHANNELS)
    kernel = fields.integer("kernel", 1, MAX_CONV_KERNEL)
    if kernel % 2 == 0:
        raise fields.wrong("kernel", "an odd integer")
    tensors: dict[str, Shape] = {
        f"{name}.weight": (channels, source.channels, kernel, kernel, kernel),
        f"{name}.bias": (channels,),
    }
    return Node(name, "conv3d", [index], source.level, channels, tensors, kernel)


def _read_conv_transpose3d(context: Context) -> Node:
    fields = context.fields
    fields.allow_only(("name", "op", "inputs", "out_channels", "kernel", "padding"))
    (index,) = _inputs(context, 1, 1)
    source = context.nodes[index]
    name = fields.string("name")
    channels = fields.integer("out_channels", 1, MAX_CHANNELS)
    kernel = fields.integer("kernel", 1, MAX_TRANSPOSE_KERNEL)
    padding = fields.integer("padding", 0, kernel - 1)
    tensors: dict[str, Shape] = {
        f"{name}.weight": (source.channels, channels, kernel, kernel, kernel),
        f"{name}.bias": (channels,),
    }
    level = _finer_level(context, source)
    return Node(name, "conv_transpose3d", [index], level, channels, tensors, kernel, padding)


def _read_upsample(context: Context) -> Node:
    fields = context.fields
    fields.allow_only(("name", "op", "inputs"))
    (index,) = _inputs(context, 1, 1)
    source = context.nodes[index]
    level = _finer_level(context, source)
    return Node(fields.string("name"), "upsample", [index], level, source.channels, {})


def _finer_level(context: Context, source: Node) -> int:
    if source.level == 0:
        raise context.fields.wrong("inputs", "an input on level 1 or coarser")
    return source.level - 1


def _read_concat(context: Context) -> Node:
    fields = context.fields
    fields.allow_only(("name", "op", "inputs"))
    inputs = _inputs(context, 2, MAX_CHANNELS)
    levels = [context.nodes[index].level for index in inputs]
    if len(set(levels)) > 1:
        found = f"levels {show(levels)}"
        raise fail(fields.label, fields.path("inputs"), found, "inputs on one level")
    channels = sum(context.nodes[index].channels for index in inputs)
    return Node(fields.string("name"), "concat", inputs, levels[0], channels, {})


def _read_affine(context: Context) -> Node:
    context.fields.allow_only(("name", "op", "inputs"))
    node = _pointwise(context, "affine")
    shape = (node.channels,)
    node.tensors = {f"{node.name}.scale": shape, f"{node.name}.shift": shape}
    return node


def _read_leaky_relu(context: Context) -> Node:
    context.fields.allow_only(("name", "op", "inputs", "slope"))
    context.fields.number("slope", 0, 1)
    return _pointwise(context, "leaky_relu")


def _read_tanh(context: Context) -> Node:
    context.fields.allow_only(("name", "op", "inputs"))
    return _pointwise(context, "tanh")


def _read_sigmoid(context: Context) -> Node:
    context.fields.allow_only(("name", "op", "inputs"))
    return _pointwise(context, "sigmoid")


def _pointwise(context: Context, op: str) -> Node:
    (index,) = _inputs(context, 1, 1)
    source = context.nodes[index]
    return Node(context.fields.string("name"), op, [index], source.level, source.channels, {})


_READERS: dict[str, Callable[[Context], Node]] = {
    "noise": _read_noise,
    "conv3d": _read_conv3d,
    "conv_transpose3d": _read_conv_transpose3d,
    "upsample": _read_upsample,
    "concat": _read_concat,
    "affine": _read_affine,
    "leaky_relu": _read_leaky_relu,
    "tanh": _read_tanh,
    "sigmoid": _read_sigmoid,
}


def _check_output(field: Fields, nodes: list[Node], channel_count: int) -> None:
    """Nodes only refer backwards and all are needed, so the output is the last one."""
    output = nodes[-1]
    if field.name("output") != output.name:
        raise field.wrong("output", f"the last node, {show(output.name)}")
    where = f"{field.path('output')} ({show(output.name)})"
    if output.level != 0:
        raise fail(field.label, where, f"level {output.level}", "level 0")
    if output.channels != channel_count:
        found, expected = f"{output.channels} channels", f"{channel_count}, as in channels"
        raise fail(field.label, where, found, expected)
    used = {index for node in nodes for index in node.inputs}
    for index, node in enumerate(nodes[:-1]):
        if index not in used:
            where = f"{field.where}.nodes[{index}] ({show(node.name)})"
            raise fail(field.label, where, "a node that nothing uses", "a use in the graph")


def _check_cost(field: Fields, nodes: list[Node]) -> None:
    """One voxel must stay computable: bounds the regions it needs and the work on them.

    Chained kernels grow the region by a few voxels each; thousands of them, each legal, would ask
    for more memory than there is. Regions are intervals along each axis for the worst position of
    the voxel, relative to the voxel of the node's level that contains it.
    """
    regions: dict[int, tuple[int, int]] = {len(nodes) - 1: (0, 0)}
    values = work = 0
    for index in reversed(range(len(nodes))):
        node = nodes[index]
        low, high = regions[index]  # every node is used by a later one
        voxels = (high - low + 1) ** 3
        fan_in = nodes[node.inputs[0]].channels if "conv" in node.op else 1
        values += voxels * node.channels
        work += voxels * node.channels * fan_in * node.kernel**3
        if values > MAX_VOXEL_VALUES or work > MAX_VOXEL_WORK:
            where = f"{field.where}.nodes[{index}] ({show(node.name)})"
            found = f"{values} values and {work} operations for one voxel"
            expected = f"at most {MAX_VOXEL_VALUES} and {MAX_VOXEL_WORK}"
            raise fail(field.label, where, found, expected)
        for source in node.inputs:
            need_low, need_high = _needed(node, low, high)
            known_low, known_high = regions.get(source, (need_low, need_high))
            regions[source] = (min(need_low, known_low), max(need_high, known_high))


def _needed(node: Node, low: int, high: int) -> tuple[int, int]:
    if node.op == "conv3d":
        return low - node.kernel // 2, high + node.kernel // 2
    if node.op == "conv_transpose3d":
        return _needed_by_transpose(low, high, node.kernel, node.padding)
    if node.op == "upsample":
        return _needed_by_transpose(low, high, 2, 0)
    return low, high


def _needed_by_transpose(low: int, high: int, kernel: int, padding: int) -> tuple[int, int]:
    """o is even or odd inside its coarse voxel; i = (o + padding - t) / 2 for taps t."""
    return (low + padding - kernel + 2) // 2, (high + 1 + padding) // 2
