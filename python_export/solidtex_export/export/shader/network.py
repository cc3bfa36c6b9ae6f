"""The sampler family as a program: octave noise, footprint fading, network."""

from __future__ import annotations

from dataclasses import dataclass

from solidtex_export.export.file_format.checks import ModelFileError
from solidtex_export.export.file_format.model_file import ModelFile
from solidtex_export.export.shader.fade_steps import (
    COARSEST,
    fade_steps,
    light_channels,
    plain_steps,
)
from solidtex_export.export.shader.program import (
    AnyType,
    Array,
    Expression,
    Function,
    Name,
    Program,
    Table,
    TableEntry,
    Weights,
    built_in,
    convert,
    integer,
    mix,
    number,
    uint,
)
from solidtex_export.export.shader.tables import (
    OCTAVE_FLOATS,
    OCTAVE_WORDS,
    check_transforms,
    octave_floats,
    octave_words,
    packed_weights,
)

# Rational quantile of the normal distribution in s = t - QUANTILE_START (engine/noise/normal.h).
QUANTILE_START = 1.1774100065231323
QUANTILE_TOP = (1.4756630659103394, 1.5872911214828491, 0.466167688369751, 0.03596135973930359)
QUANTILE_BOTTOM = (1.0, 1.239675760269165, 0.4253420829772949, 0.03593936190009117)

WORDS, FLOATS, FADE = "words", "floats", "fade"
AXES = range(3)


def sampler_program(model: ModelFile, name: str, seed: int, corrects_means: bool) -> Program:
    """Program whose functions begin with `name`; the last two are for the caller."""
    _check(model)
    steps = fade_steps(model, seed) if corrects_means else plain_steps(model)
    functions = _functions(_Network.of(model), name)
    document = model.document
    tables = [
        Table(WORDS, "uint", octave_words(model, seed)),
        Table(FLOATS, "float", octave_floats(model)),
        Table(FADE, "float", steps.ravel()),
    ]
    comment = [
        f"{document['name']}, a solid texture of solidtex, seed {seed}.",
        f"{name}(texel, footprint): color at a point. Coordinates are in texels; footprint is half",
        "the edge of the cube over which the color is averaged, 0 for the point itself.",
        f"{name}_at(origin, texel, footprint): the same at origin + texel, for points far away.",
        f"Color space: {document['color_space']}, not clamped.",
    ]
    if license_ := document.get("license"):
        space = document.get("training", {}).get("space")
        is_inherited = isinstance(space, dict) and "license" in space
        owner = "texture space, not of the material" if is_inherited else "material"
        comment.append(f"License of the {owner}: {license_}.")
    return Program(name, functions, tables, packed_weights(model), comment)


def _check(model: ModelFile) -> None:
    if model.document["family"] != "sampler":
        raise ModelFileError(
            f"{model.document['name']}: found a model of the lattice family, expected the sampler"
            " family: a shader evaluates points, a lattice is computed in blocks. Train it with"
            " solidtex-train --preset sampler, or bake the lattice to a volume (solidtex-bake)"
        )
    check_transforms(model)


def color_channels(model: ModelFile) -> list[int]:
    """Red, green and blue; three times the first channel of a model without color."""
    names = model.document["channels"]
    albedo = [f"albedo.{part}" for part in "rgb"]
    return [names.index(a) for a in albedo] if set(albedo) <= set(names) else [0, 0, 0]


@dataclass(frozen=True)
class _Network:
    """Sizes of the network, and which channels are its color."""

    octaves: int
    hidden_layers: int
    width: int
    slope: float
    light: list[bool]
    color: list[int]

    @staticmethod
    def of(model: ModelFile) -> _Network:
        sizes = {key: model.document["sampler"][key]
                 for key in ("octaves", "hidden_layers", "width", "slope")}  # fmt: skip
        return _Network(**sizes, light=light_channels(model), color=color_channels(model))

    @property
    def octaves_per_layer(self) -> int:
        return self.octaves // (self.hidden_layers - 1)


def _functions(network: _Network, name: str) -> list[Function]:
    bits, deviate = noise_functions(name)
    add = _add_product(f"{name}_add_product")
    place = _place(f"{name}_place", add)
    octave = _octave(f"{name}_octave", bits, deviate, place)
    channels = _channels(f"{name}_channels", network, octave)
    at = _color_at(f"{name}_at", network, channels)
    return [bits, deviate, add, place, octave, channels, at, _color(name, at)]


def noise_functions(name: str) -> tuple[Function, Function]:
    """32 random bits of a lattice point, and a normal number of them."""
    return _bits(f"{name}_bits"), _normal(f"{name}_deviate")


def _bits(name: str) -> Function:
    """Scheme solidtex-1 (docs/noise.md)."""
    words = ("x", "y", "z", "k0", "k1", "k2", "k3")
    f = Function(name, dict.fromkeys(words, "uint"), "uint", "32 random bits of a lattice point.")
    x, y, z, k0, k1, k2, k3 = f.arguments()
    lcg = (uint(1664525), uint(1013904223))
    entered = [(x ^ k0), (y ^ k1), (z ^ k2), k3]
    names = ("a", "b", "c", "d")
    word = {n: f.let(n, e * lcg[0] + lcg[1]) for n, e in zip(names, entered, strict=True)}
    for pass_ in range(2):
        for to, left, right in ("abd", "bca", "cab", "dbc"):
            f.set(word[to], word[to] + word[left] * word[right])
        if pass_ == 0:
            for w in word.values():
                f.set(w, w ^ (w >> 16))
    a, d = word["a"], word["d"]
    t = f.let("t", a ^ (a << 11))
    f.give((d ^ (d >> 19)) ^ (t ^ (t >> 8)))
    return f


def _normal(name: str) -> Function:
    f = Function(name, {"word": "uint"}, "float", "Standard normal number of 32 random bits.")
    (word,) = f.arguments()
    half = (convert("float", word & uint(0x7FFFFFFF)) + number(0.5)) * number(2.0**-32)
    # The product may round up to 1/2, where the root is smallest.
    root = built_in("sqrt", number(-2.0) * built_in("log", half))
    s = f.let("s", root - number(QUANTILE_START))
    size = f.let("size", (s * _polynomial(s, QUANTILE_TOP)) / _polynomial(s, QUANTILE_BOTTOM))
    with f.when(word < uint(0x80000000)):
        f.give(number(0.0) - size)
    f.give(size)
    return f


def _polynomial(x: Expression, terms: tuple[float, ...]) -> Expression:
    sum_ = number(terms[-1])
    for term in reversed(terms[:-1]):
        sum_ = sum_ * x + number(term)
    return sum_


def _add_product(name: str) -> Function:
    """One entry of a transform times a whole number of texels."""
    words: dict[str, AnyType] = dict.fromkeys(("whole", "high", "middle", "low"), "uint")
    f = Function(
        name,
        {"sum": Array("uint", 2), **words},
        None,
        "sum += whole * (high + middle / 2^32 + low / 2^48): sum[0] is whole, sum[1] / 2^32.",
    )
    total, whole, high, middle, low = f.arguments()
    half = uint(0xFFFF)
    a = [f.let("a0", whole & half), f.let("a1", whole >> 16)]
    b = [f.let("b0", middle & half), f.let("b1", middle >> 16)]
    p00, p01 = f.let("p00", a[0] * b[0]), f.let("p01", a[0] * b[1])
    p10, p11 = f.let("p10", a[1] * b[0]), f.let("p11", a[1] * b[1])
    carry = f.let("carry", (p00 >> 16) + (p01 & half) + (p10 & half))
    upper = f.let("upper", p11 + (p01 >> 16) + (p10 >> 16) + (carry >> 16) + whole * high)
    lower = f.let("lower", (p00 & half) | (carry << 16))
    rest = f.let("rest", a[1] * low + ((a[0] * low) >> 16))
    for addend in (rest, total[integer(1)]):
        f.set(lower, lower + addend)
        with f.when(lower < addend):
            f.set(upper, upper + uint(1))
    f.set(total[integer(0)], total[integer(0)] + upper)
    f.set(total[integer(1)], lower)
    return f


def _place(name: str, add: Function) -> Function:
    f = Function(
        name,
        {
            "index": "int",
            "cell": "ivec3",
            "rest": "vec3",
            "corner": Array("uint", 3),
            "fraction": Array("float", 3),
        },
        None,
        "Lattice point below a texel in an octave, modulo 2^32, and the way to the next one.",
    )
    index, cell, rest, corner, fraction = f.arguments()
    word = f.let("word", index * integer(OCTAVE_WORDS) + integer(4))
    first = f.let("first", index * integer(OCTAVE_FLOATS))
    whole = [f.let(f"whole{axis}", convert("uint", cell.part(axis)) ^ uint(0x80000000))
             for axis in AXES]  # fmt: skip
    sum_ = f.array("sum", "uint", 2)
    with f.loop("axis", 3) as axis:
        for k in range(2):
            f.set(sum_[integer(k)], TableEntry("uint", WORDS, word + integer(k)))
        for column in AXES:
            entry = [
                TableEntry("uint", WORDS, word + integer(2 + 3 * column + k)) for k in range(3)
            ]
            f.run(add(sum_, whole[column], *entry))
        f.set(word, word + integer(2 + 3 * 3))
        shift = _sum([TableEntry("float", FLOATS, first + integer(k)) * rest.part(k) for k in AXES])
        fine = convert("float", sum_[integer(1)] >> 8) * number(2.0**-24)
        position = f.let("position", fine + shift)
        below = f.let("below", built_in("floor", position))
        f.set(corner[axis], sum_[integer(0)] + convert("uint", convert("int", below)))
        f.set(fraction[axis], position - below)
        f.set(first, first + integer(3))
    return f


def _sum(terms: list[Expression]) -> Expression:
    total = terms[0]
    for term in terms[1:]:
        total = total + term
    return total


def _octave(name: str, bits: Function, deviate: Function, place: Function) -> Function:
    f = Function(
        name,
        {"index": "int", "cell": "ivec3", "rest": "vec3"},
        "float",
        "Noise of an octave: normal numbers at lattice points, interpolated.",
    )
    index, cell, rest = f.arguments()
    corner, fraction = f.array("corner", "uint", 3), f.array("fraction", "float", 3)
    f.run(place(index, cell, rest, corner, fraction))
    word = f.let("word", index * integer(OCTAVE_WORDS))
    key = [f.let(f"k{k}", TableEntry("uint", WORDS, word + integer(k))) for k in range(4)]
    edge = f.array("edge", "float", 4)
    with f.loop("i", 4) as i:
        x = f.let("x", corner[integer(0)] + (convert("uint", i) >> 1))
        y = f.let("y", corner[integer(1)] + convert("uint", i & integer(1)))
        z = f.let("z", corner[integer(2)])
        low = f.let("low", deviate(bits(x, y, z, *key)))
        high = f.let("high", deviate(bits(x, y, z + uint(1), *key)))
        f.set(edge[i], mix(low, high, fraction[integer(2)]))
    sides = [f.let(f"side{k}", mix(edge[integer(2 * k)], edge[integer(2 * k + 1)],
                                   fraction[integer(1)])) for k in range(2)]  # fmt: skip
    f.give(mix(sides[0], sides[1], fraction[integer(0)]))
    return f


def _channels(name: str, network: _Network, octave: Function) -> Function:
    count = len(network.light)
    f = Function(
        name,
        {
            "origin": "ivec3",
            "texel": "vec3",
            "footprint": "float",
            "values": Array("float", count),
        },
        None,
        "All channels of the material at origin + texel.",
    )
    origin, texel, footprint, values = f.arguments()
    axis_cells, rests = [], []
    for axis in AXES:
        below = f.let(f"below{axis}", built_in("floor", texel.part(axis)))
        axis_cells.append(origin.part(axis) + convert("int", below))
        rests.append(texel.part(axis) - below)
    cell = f.let("cell", built_in("ivec3", *axis_cells))
    rest = f.let("rest", built_in("vec3", *rests))
    largest = 2.0**COARSEST / 2
    radius = built_in("max", built_in("min", footprint, number(largest)), number(0.0))
    radius = f.let("radius", radius)
    eta = f.array("eta", "float", network.octaves)
    _octaves(f, network, octave, (cell, rest, radius), eta)
    _layers(f, network, eta, values)
    with f.when(number(0.0) < radius):
        _fade(f, network, radius, values)
    return f


def _octaves(
    f: Function,
    network: _Network,
    octave: Function,
    at: tuple[Expression, Expression, Expression],
    eta: Expression,
) -> None:
    cell, rest, radius = at
    spread = f.let("spread", number(0.5) * radius * radius)
    with f.loop("i", network.octaves) as i:
        first = f.let("first", i * integer(OCTAVE_FLOATS) + integer(9))
        term = [TableEntry("float", FLOATS, first + integer(k)) for k in range(3)]
        faded = spread * (term[0] + spread * (term[1] + spread * term[2]))
        f.set(eta[i], octave(i, cell, rest) / (number(1.0) + faded))


def _layers(f: Function, network: _Network, eta: Expression, values: Expression) -> None:
    """Each layer reads its weights one after another."""
    padded = -(-network.width // 4) * 4
    x, y = f.array("x", "float", padded), f.array("y", "float", padded)
    k = f.let("k", integer(0))
    bin_ = network.octaves_per_layer
    for l in range(network.hidden_layers):
        with f.loop(f"g{l}", padded // 4) as group:
            total = _bias(f, k)
            if l > 0:
                _add_inputs(f, k, total, x, network.width)
            if l + 1 < network.hidden_layers:
                _add_inputs(f, k, total, eta, bin_, l * bin_)
            units = f.let("units", built_in("max", total, total * number(network.slope)))
            for part in range(4):
                f.set(y[group * integer(4) + integer(part)], units.part(part))
        x, y = y, x
    channels = len(network.light)
    for group_index in range(-(-channels // 4)):
        total = _bias(f, k, f"out{group_index}")
        _add_inputs(f, k, total, x, network.width)
        for part in range(min(4, channels - 4 * group_index)):
            f.set(values[integer(4 * group_index + part)], total.part(part))


def _bias(f: Function, k: Expression, name: str = "total") -> Name:
    total = f.let(name, Weights("vec4", k))
    f.set(k, k + integer(1))
    return total


def _add_inputs(
    f: Function, k: Expression, total: Expression, inputs: Expression, count: int, first: int = 0
) -> None:
    with f.loop("t", first + count, first) as t:
        f.set(total, total + Weights("vec4", k) * inputs[t])
        f.set(k, k + integer(1))


def _fade(f: Function, network: _Network, radius: Expression, values: Expression) -> None:
    """Correction of a mean, since the network is not linear. See docs/filtering.md."""
    count = len(network.light)
    edge = f.let("edge", number(2.0) * radius)
    finer = f.let("finer", integer(0))
    between = f.let("between", built_in("min", edge, number(1.0)))
    size = f.let("size", number(1.0))
    with f.loop("level", COARSEST) as level:
        with f.when(edge >= size):
            f.set(finer, level + integer(1))
            f.set(between, edge / size - number(1.0))
        f.set(size, size + size)
    first = f.let("step_word", finer * integer(2 * count))
    for channel, is_light in enumerate(network.light):
        gain, offset = (
            _between_steps(first, 2 * count, row * count + channel, between) for row in range(2)
        )
        at = values[integer(channel)]
        if is_light:
            root = f.let(f"root{channel}", built_in("max", at, number(0.0)))
            mean = built_in("max", gain * (root * root) + offset, number(0.0))
            f.set(at, built_in("sqrt", mean))
        else:
            f.set(at, gain * at + offset)


def _between_steps(first: Expression, size: int, number_: int, between: Expression) -> Expression:
    finer, coarser = (
        TableEntry("float", FADE, first + integer(step * size + number_)) for step in range(2)
    )
    return mix(finer, coarser, between)


def _color_at(name: str, network: _Network, channels: Function) -> Function:
    f = Function(name, {"origin": "ivec3", "texel": "vec3", "footprint": "float"}, "vec3")
    values = f.array("values", "float", len(network.light))
    f.run(channels(*f.arguments(), values))
    f.give(built_in("vec3", *(values[integer(channel)] for channel in network.color)))
    return f


def _color(name: str, at: Function) -> Function:
    f = Function(name, {"texel": "vec3", "footprint": "float"}, "vec3")
    texel, footprint = f.arguments()
    f.give(at(built_in("ivec3", *[integer(0)] * 3), texel, footprint))
    return f
