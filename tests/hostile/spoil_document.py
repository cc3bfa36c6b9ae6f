"""One wrong thing in the JSON document: metadata, graph, sizes."""

from collections.abc import Callable, Iterator
from typing import Any

from base_files import Document, nested

Spoiled = tuple[str, str, Callable[[Document], None], tuple[str, ...]]


def put(path: str, value: Any) -> Callable[[Document], None]:
    """Sets `a.b.2.c` of the document."""

    def change(document: Document) -> None:
        parent, key = _locate(document, path)
        parent[key] = value

    return change


def drop(path: str) -> Callable[[Document], None]:
    def change(document: Document) -> None:
        parent, key = _locate(document, path)
        del parent[key]

    return change


def node(position: int, value: Document) -> Callable[[Document], None]:
    """Inserts a node into the graph."""
    return lambda document: document["field"]["nodes"].insert(position, value)


def _locate(document: Document, path: str) -> tuple[Any, Any]:
    *parents, last = [int(key) if key.isdigit() else key for key in path.split(".")]
    target: Any = document
    for key in parents:
        target = target[key]
    return target, last


def spoiled_documents() -> Iterator[Spoiled]:
    yield from _metadata()
    yield from _graph_structure()
    yield from _graph_parameters()
    yield from _gigantic()
    yield from _sampler()


def _metadata() -> Iterator[Spoiled]:
    yield "version_unknown", "field", put("version", 2), ("version", "found 2")
    yield "version_float", "field", put("version", 1.0), ("version", "1.0")
    yield "version_true", "field", put("version", True), ("version", "true")
    yield "version_missing", "sampler", drop("version"), ("version", "nothing")
    yield "key_unknown", "field", put("shader", "x"), ("shader", "unknown key")
    yield "name_empty", "field", put("name", ""), ("name", '""')
    yield "name_long", "field", put("name", "n" * 257), ("name", "256")
    yield "name_with_zero", "field", put("name", "a\0b"), ("name", "\\u0000")
    yield "name_with_escape", "field", put("name", "a\x1b[2J"), ("name", "\\u001b")
    yield "name_with_c1", "field", put("name", "a\x9b2J"), ("name", "\\u009b")
    yield "name_number", "field", put("name", 7), ("name", "found 7")
    yield "family_unknown", "field", put("family", "mesh"), ("family", '"mesh"', "sampler")
    yield "family_both", "field", put("sampler", {}), ("sampler", "only field")
    yield "family_other", "field", put("family", "sampler"), ("field", "only sampler")
    yield "family_missing", "sampler", drop("sampler"), ("sampler", "nothing")
    yield "family_array", "sampler", put("sampler", []), ("sampler", "an object")
    yield "color_space_unknown", "field", put("color_space", "rgb"), ("color_space", '"rgb"')
    yield "scheme_unknown", "field", put("noise.scheme", "perlin"), ("noise.scheme", '"perlin"')
    yield "noise_key_unknown", "field", put("noise.seed", 1), ("noise.seed", "unknown key")
    yield "noise_missing", "field", drop("noise"), ("noise", "nothing")
    yield "channels_empty", "field", put("channels", []), ("channels", "0 entries")
    yield "channels_string", "field", put("channels", "rgb"), ("channels", "an array")
    duplicate = ["albedo.r", "albedo.g", "albedo.r"]
    yield "channels_duplicate", "field", put("channels", duplicate), ("channels[2]", "albedo.r")
    many = [f"c{i}" for i in range(65)]
    yield "channels_too_many", "field", put("channels", many), ("channels", "65 entries")
    yield "exemplar_hash", "field", put("exemplar.sha256", "abc"), ("exemplar.sha256", '"abc"')
    yield "exemplar_key", "field", put("exemplar.path", "x"), ("exemplar.path", "unknown key")
    yield "exemplar_four", "field", put("exemplar", [{}] * 4), ("exemplar", "4 entries")
    yield "license_number", "field", put("license", 1), ("license", "a string")
    yield "training_string", "field", put("training", "x"), ("training", "an object")
    yield "training_deep", "field", put("training.deep", nested(31)), ("deeply nested", "32")


def _graph_structure() -> Iterator[Spoiled]:
    spare = {"name": "spare", "op": "noise", "level": 0, "channels": 1, "distribution": "uniform"}
    yield "node_unused", "field", node(0, spare), ("nodes[0]", "spare", "nothing uses")
    yield "node_duplicate", "field", node(1, {**spare, "name": "z1"}), ("nodes[1].name", '"z1"')
    yield "node_after_output", "field", node(10, spare), ("field.output", "spare")
    yield "node_is_number", "field", put("field.nodes.3", 5), ("nodes[3]", "an object")
    yield "nodes_empty", "field", put("field.nodes", []), ("field.nodes", "0 entries")
    yield "op_unknown", "field", put("field.nodes.9.op", "relu"), ("nodes[9].op", '"relu"')
    yield "op_missing", "field", drop("field.nodes.9.op"), ("nodes[9].op", "nothing")
    yield "node_key_unknown", "field", put("field.nodes.5.bias", 1), ("nodes[5].bias", "unknown")
    yield "field_key_unknown", "field", put("field.levels", 2), ("field.levels", "unknown key")
    inputs = "nodes[8].inputs[0]"
    yield "self_reference", "field", put("field.nodes.8.inputs", ["bounded"]), (inputs, "bounded")
    yield "cycle", "field", put("field.nodes.8.inputs", ["color"]), (inputs, "color")
    yield "reference_unknown", "field", put("field.nodes.8.inputs", ["q"]), (inputs, '"q"')
    yield "inputs_missing", "field", drop("field.nodes.8.inputs"), ("nodes[8].inputs", "nothing")
    yield "inputs_empty", "field", put("field.nodes.8.inputs", []), ("nodes[8].inputs", "0 entries")
    two = ["active", "scaled"]
    yield "inputs_two", "field", put("field.nodes.8.inputs", two), ("nodes[8].inputs", "2 entries")
    yield "inputs_number", "field", put("field.nodes.8.inputs", [7]), (inputs, "found 7")
    yield (
        "concat_one",
        "field",
        put("field.nodes.4.inputs", ["up"]),
        ("nodes[4].inputs", "1 entries"),
    )
    mixed = ["up", "deconv", "z1"]
    yield "concat_levels", "field", put("field.nodes.4.inputs", mixed), ("nodes[4].inputs", "level")
    yield "output_unknown", "field", put("field.output", "picture"), ("output", "picture")
    yield "output_inside", "field", put("field.output", "active"), ("output", "active")
    yield "output_coarse", "field", _raise_levels, ("output", "level 1", "level 0")
    rgba = ["albedo.r", "albedo.g", "albedo.b", "alpha"]
    yield "channel_mismatch", "field", put("channels", rgba), ("output", "3 channels")
    yield "below_level_zero", "field", put("field.nodes.0.level", 0), ("nodes[2].inputs", "level 1")


def _raise_levels(document: Document) -> None:
    document["field"]["nodes"][0]["level"] = 2
    document["field"]["nodes"][1]["level"] = 1


def _graph_parameters() -> Iterator[Spoiled]:
    yield "kernel_even", "field", put("field.nodes.5.kernel", 4), ("nodes[5].kernel", "odd")
    yield "kernel_zero", "field", put("field.nodes.5.kernel", 0), ("nodes[5].kernel", "found 0")
    yield "kernel_negative", "field", put("field.nodes.5.kernel", -3), ("nodes[5].kernel", "-3")
    yield "kernel_float", "field", put("field.nodes.5.kernel", 3.5), ("nodes[5].kernel", "3.5")
    yield "kernel_string", "field", put("field.nodes.5.kernel", "3"), ("nodes[5].kernel", '"3"')
    yield "padding_large", "field", put("field.nodes.3.padding", 4), ("nodes[3].padding", "3")
    yield "padding_negative", "field", put("field.nodes.3.padding", -1), ("nodes[3].padding", "-1")
    yield "slope_negative", "field", put("field.nodes.7.slope", -0.1), ("nodes[7].slope", "-0.1")
    yield "slope_large", "field", put("field.nodes.7.slope", 2), ("nodes[7].slope", "found 2")
    yield "slope_missing", "field", drop("field.nodes.7.slope"), ("nodes[7].slope", "nothing")
    yield "level_negative", "field", put("field.nodes.1.level", -1), ("nodes[1].level", "-1")
    yield (
        "channels_zero",
        "field",
        put("field.nodes.0.channels", 0),
        ("nodes[0].channels", "found 0"),
    )
    unknown = put("field.nodes.1.distribution", "cauchy")
    yield "distribution_unknown", "field", unknown, ("nodes[1].distribution", '"cauchy"')
    yield from _waves()
    legacy = put("noise.scheme", "solidtexturenets")
    yield "legacy_scheme_normal", "field", legacy, ("nodes[1].distribution", "solidtexturenets")


def _waves() -> Iterator[Spoiled]:
    good = [1, 2, 3, 4]
    other = {"name": "w", "op": "periodic", "level": 0, "waves": [good]}
    bare = {key: other[key] for key in ("name", "op", "level")}
    yield "waves_missing", "field", node(0, bare), ("nodes[0].waves", "nothing")
    wrong: dict[str, tuple[Any, tuple[str, ...]]] = {
        "empty": ([], ("nodes[0].waves", "0 entries")),
        "number": (7, ("nodes[0].waves", "an array")),
        "many": ([good] * 4097, ("nodes[0].waves", "4097 entries")),
        "short": ([good, [1, 2, 3]], ("nodes[0].waves[1]", "4 integers")),
        "object": ([{}], ("nodes[0].waves[0]", "4 integers")),
        "negative": ([[1, -1, 3, 4]], ("nodes[0].waves[0][1]", "-1", "4294967295")),
        "large": ([[1, 2, 3, 2**32]], ("nodes[0].waves[0][3]", "4294967296", "4294967295")),
        "gigantic": ([[10**300, 2, 3, 4]], ("nodes[0].waves[0][0]", "4294967295")),
        "fraction": ([[0.5, 2, 3, 4]], ("nodes[0].waves[0][0]", "0.5")),
    }
    for name, (waves, message) in wrong.items():
        yield f"waves_{name}", "field", node(0, {**other, "waves": waves}), message
    yield "waves_unused", "field", node(0, other), ("nodes[0]", "nothing uses")
    yield "waves_level", "field", node(0, {**other, "level": 21}), ("nodes[0].level", "found 21")
    yield "waves_channels", "field", node(0, {**other, "channels": 1}), ("channels", "unknown key")


def _gigantic() -> Iterator[Spoiled]:
    yield "level_gigantic", "field", put("field.nodes.1.level", 21), ("nodes[1].level", "found 21")
    yield "kernel_gigantic", "field", put("field.nodes.5.kernel", 17), ("nodes[5].kernel", "17")
    huge = 10**18
    yield (
        "kernel_overflow",
        "field",
        put("field.nodes.3.kernel", huge),
        ("nodes[3].kernel", str(huge)),
    )
    beyond = 2**64
    yield "level_beyond_64_bit", "field", put("field.nodes.1.level", beyond), ("nodes[1].level",)
    wide = put("field.nodes.5.out_channels", 4097)
    yield "out_channels_gigantic", "field", wide, ("nodes[5].out_channels", "4097")
    yield "concat_gigantic", "field", _wide_concat, ("nodes[3]", "8192 channels")
    yield "nodes_too_many", "field", _many_nodes, ("field.nodes", "4097 entries")


def _wide_concat(document: Document) -> None:
    document["field"]["nodes"][0]["channels"] = 4096
    wide = {"name": "wide", "op": "concat", "inputs": ["up", "up"]}
    document["field"]["nodes"].insert(3, wide)


def _many_nodes(document: Document) -> None:
    nodes = document["field"]["nodes"]
    nodes += [
        {"name": f"n{i}", "op": "tanh", "inputs": ["color"]} for i in range(4097 - len(nodes))
    ]


def _sampler() -> Iterator[Spoiled]:
    yield (
        "octaves_indivisible",
        "sampler",
        put("sampler.octaves", 5),
        ("sampler.octaves", "found 5"),
    )
    yield "octaves_gigantic", "sampler", put("sampler.octaves", 258), ("sampler.octaves", "258")
    yield "octaves_zero", "sampler", put("sampler.octaves", 0), ("sampler.octaves", "found 0")
    yield "layers_one", "sampler", put("sampler.hidden_layers", 1), ("sampler.hidden_layers", "1")
    layers = put("sampler.hidden_layers", 65)
    yield "layers_gigantic", "sampler", layers, ("sampler.hidden_layers", "65")
    yield "width_gigantic", "sampler", put("sampler.width", 4097), ("sampler.width", "4097")
    yield "width_mismatch", "sampler", put("sampler.width", 6), ("tensor", "[6")
    yield "width_null", "sampler", put("sampler.width", None), ("sampler.width", "null")
    yield "sampler_slope", "sampler", put("sampler.slope", -1), ("sampler.slope", "-1")
    yield "sampler_key", "sampler", put("sampler.period", 64), ("sampler.period", "unknown key")
    legacy = put("noise.scheme", "solidtexturenets")
    yield "sampler_legacy_scheme", "sampler", legacy, ("noise.scheme", "solidtexturenets")
    yield "sampler_channels", "sampler", put("channels", ["a"]), ("output.weight", "[1, 5]")
