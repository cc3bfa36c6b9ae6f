"""Writes a program in a language like C. Subclasses state where their language differs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import ClassVar, Literal, get_args

import numpy as np

from solidtex_export.export.shader.program import (
    AnyType,
    Array,
    Assign,
    Binary,
    BuiltIn,
    Call,
    Component,
    Convert,
    Declare,
    Expression,
    Function,
    Index,
    Loop,
    Name,
    Number,
    Program,
    Return,
    Run,
    Statement,
    Table,
    TableEntry,
    Weights,
    When,
)

Storage = Literal["constant", "buffer", "texture"]
Precision = Literal["float", "half"]
STORAGES: tuple[Storage, ...] = get_args(Storage)
PRECISIONS: tuple[Precision, ...] = get_args(Precision)

TEXTURE_WIDTH = 128
WEIGHTS = "weights"


class Emitter:
    """One program in one language, with weights of one precision in one storage."""

    language: ClassVar[str]
    suffix: ClassVar[str]
    storages: ClassVar[tuple[Storage, ...]] = STORAGES
    precisions: ClassVar[tuple[Precision, ...]] = PRECISIONS
    types: ClassVar[dict[str, str]]

    def __init__(self, program: Program, storage: Storage, precision: Precision) -> None:
        self.program, self.storage, self.precision = program, storage, precision
        self.references: set[str] = set()
        """Parameters of the current function that are arrays."""

    def text(self) -> str:
        parts = [self.comment(), self.preamble()]
        if self.storage == "constant":
            parts += [self.constant(t.name, t.of, self.numbers(t)) for t in self.program.tables]
            parts += [self.constant(WEIGHTS, self.packed, self.vectors()), self.weights_at()]
        else:
            parts += [self.resource_declaration(), self.word_at(), self.weights_at()]
        parts += [self.function(f) for f in self.program.functions]
        return "\n".join(part for part in [*parts, self.ending()] if part)

    # What a language states about itself.

    @property
    def threaded(self) -> Sequence[str]:
        """Tables, or WEIGHTS, that functions receive as parameters."""
        return ()

    def preamble(self) -> str:
        return ""

    def ending(self) -> str:
        return ""

    def constant(self, name: str, type_: str, values: Sequence[str]) -> str:
        """A constant array."""
        raise NotImplementedError

    def resource_declaration(self) -> str:
        """The buffer or texture that holds tables and weights."""
        raise NotImplementedError

    def fetched(self, index: str) -> str:
        """Element of the buffer or texture: four floats of a texture, words of a buffer."""
        raise NotImplementedError

    def helper(self, name: str, result: str, lines: Sequence[str]) -> str:
        """A function of an index."""
        body = "".join(f"  {line}\n" for line in lines)
        given = ", ".join(["int index", *map(self.resource, self.threaded)])
        return f"{result} {self.global_name(name)}({given}) {{\n{body}}}\n"

    def declaration(self, type_: AnyType, name: str) -> str:
        if isinstance(type_, Array):
            return f"{self.types[type_.of]} {name}[{type_.size}]"
        return f"{self.types[type_]} {name}"

    def reference(self, type_: Array, name: str) -> str:
        """Parameter that is an array."""
        return f"inout {self.declaration(type_, name)}"

    def resource(self, name: str) -> str:
        """Parameter for a table, or for the weights."""
        raise NotImplementedError

    def opening(self, f: Function, parameters: str) -> str:
        return f"{self.types[f.result] if f.result else 'void'} {f.name}({parameters})"

    # Names and numbers.

    def global_name(self, name: str) -> str:
        return f"{self.program.name}_{name}"

    def float_literal(self, value: float) -> str:
        text = np.format_float_scientific(np.float32(value), unique=True, trim="0", exp_digits=1)
        mantissa, exponent = text.split("e")
        plain = np.format_float_positional(np.float32(value), unique=True, trim="0")
        return plain if -5 < int(exponent) < 8 else f"{mantissa}e{int(exponent)}"

    def uint_literal(self, value: int) -> str:
        return f"{value}u"

    def number(self, type_: str, value: float) -> str:
        if type_ == "float":
            return self.float_literal(value)
        return self.uint_literal(int(value)) if type_ == "uint" else str(int(value))

    def numbers(self, table: Table) -> list[str]:
        return [self.number(table.of, value) for value in table.values.tolist()]

    # Statements.

    def comment(self) -> str:
        """Text of the model's author; nothing in it may end a line, or it would become code."""
        lines = ("".join(c if c.isprintable() else " " for c in x) for x in self.program.comment)
        return "".join(f"// {line}\n" for line in lines)

    def function(self, f: Function) -> str:
        self.references = {n for n, type_ in f.parameters.items() if isinstance(type_, Array)}
        comment = f"// {f.comment}\n" if f.comment else ""
        parameters = [
            self.reference(type_, name) if isinstance(type_, Array) else
            self.declaration(type_, name)
            for name, type_ in f.parameters.items()
        ]  # fmt: skip
        parameters += [self.resource(name) for name in self.resources(f)]
        lines = self.block(f.body, "  ")
        return f"{comment}{self.opening(f, ', '.join(parameters))} {{\n{lines}}}\n"

    def resources(self, f: Function) -> list[str]:
        """Threaded tables and weights that a function or what it calls needs."""
        in_weights = self.storage != "constant"
        used = {WEIGHTS if in_weights else name for name in _used(f)}
        return [name for name in self.threaded if name in used]

    def block(self, body: Sequence[Statement], indent: str) -> str:
        return "".join(self.statement(s, indent) for s in body)

    def statement(self, statement: Statement, indent: str) -> str:
        match statement:
            case Declare(variable, value):
                return f"{indent}{self.variable(variable, value)};\n"
            case Assign(target, value):
                return f"{indent}{self.expression(target)} = {self.bare(value)};\n"
            case Loop(variable, first, end, body):
                inner = self.block(body, indent + "  ")
                return f"{indent}{self.loop(variable.name, first, end)} {{\n{inner}{indent}}}\n"
            case When(condition, body):
                inner = self.block(body, indent + "  ")
                return f"{indent}if ({self.bare(condition)}) {{\n{inner}{indent}}}\n"
            case Return(value):
                return f"{indent}return {self.bare(value)};\n"
            case Run(call):
                return f"{indent}{self.expression(call)};\n"

    def variable(self, variable: Name, value: Expression | None) -> str:
        start = f" = {self.bare(value)}" if value else ""
        return self.declaration(variable.type, variable.name) + start

    def loop(self, name: str, first: int, end: int) -> str:
        declared = self.declaration("int", name)
        return f"for ({declared} = {first}; {name} < {end}; {name}++)"

    # Expressions.

    def bare(self, e: Expression) -> str:
        """An expression without parentheses around it."""
        text = self.expression(e)
        return text[1:-1] if isinstance(e, Binary) and text.startswith("(") else text

    def expression(self, e: Expression) -> str:
        match e:
            case Number(type_, value):
                assert isinstance(type_, str)
                return self.number(type_, value)
            case Name():
                return e.name
            case Binary():
                return self.binary(e)
            case Index(_, array, index):
                return f"{self.expression(array)}[{self.bare(index)}]"
            case Component():
                return self.component(e)
            case Convert(type_, value):
                assert isinstance(type_, str)
                return self.convert(type_, value)
            case BuiltIn():
                return self.built_in(e)
            case TableEntry(_, table, index):
                return self.table_entry(table, index)
            case Weights(_, index):
                return self.weights(index)
            case Call(_, function, arguments):
                given = [*map(self.argument, arguments)]
                given += [self.resource_argument(name) for name in self.resources(function)]
                return f"{function.name}({', '.join(given)})"
        raise TypeError(type(e).__name__)

    def binary(self, e: Binary) -> str:
        return f"({self.expression(e.left)} {e.operator} {self.expression(e.right)})"

    def component(self, e: Component) -> str:
        return f"{self.expression(e.vector)}.{'xyzw'[e.axis]}"

    def convert(self, to: str, value: Expression) -> str:
        return self.conversion(to, self.bare(value))

    def built_in(self, e: BuiltIn) -> str:
        name = self.types.get(e.name, e.name)
        return f"{name}({', '.join(map(self.bare, e.arguments))})"

    def table_entry(self, table: str, index: Expression) -> str:
        if self.storage == "constant":
            return f"{self.resource_argument(table)}[{self.bare(index)}]"
        first = self.program.first_word(table)
        at = self.helper_call("word_at", f"{first} + {self.bare(index)}")
        of_float = self.program.table(table).of == "float"
        return f"{self.float_of_bits}({at})" if of_float else at

    def weights(self, index: Expression) -> str:
        return self.helper_call("weights_at", self.bare(index))

    def helper_call(self, name: str, index: str) -> str:
        given = [index, *(self.resource_argument(n) for n in self.threaded)]
        return f"{self.global_name(name)}({', '.join(given)})"

    def argument(self, e: Expression) -> str:
        return self.bare(e)

    def resource_argument(self, name: str) -> str:
        return self.global_name(name)

    # Tables and weights.

    def word_at(self) -> str:
        """A word of the tables. A texture has 11 bits in each of three numbers, exact in halves."""
        if self.storage == "buffer":
            count = 2 if self.precision == "half" else 4
            lines = [f"return {self.fetched(f'index / {count}')}[index % {count}];"]
        else:
            bits = [self.conversion("uint", f"part.{c}") for c in "xyz"]
            shifted = f"{bits[0]} | ({bits[1]} << 11u) | ({bits[2]} << 22u)"
            part = self.local("vec4", "part", self.fetched("index"))
            lines = [f"{part};", f"return {shifted};"]
        return self.helper("word_at", self.types["uint"], lines)

    def weights_at(self) -> str:
        """Four weights."""
        first = 0 if self.storage == "constant" else self.program.first_weight(self.per_element)
        index = f"{first} + index" if first else "index"
        if self.storage == "constant":
            element = f"{self.resource_argument(WEIGHTS)}[{index}]"
        else:
            element = self.fetched(index)
        if self.storage == "texture" or (self.storage, self.precision) == ("constant", "float"):
            lines = [f"return {element};"]
        elif self.precision == "float":
            lines = [f"return {self.vector_of_bits(element)};"]
        else:
            word = self.local("uvec2", "word", element)
            lines = [f"{word};", f"return {self.vector_of_halves('word')};"]
        return self.helper("weights_at", self.types["vec4"], lines)

    @property
    def per_element(self) -> int:
        """Words of tables in an element of the buffer or texture."""
        if self.storage == "texture":
            return 1
        return 2 if self.precision == "half" else 4

    @property
    def packed(self) -> str:
        """Type of four weights as constants."""
        return self.types["uvec2" if self.precision == "half" else "vec4"]

    def texel(self, index: str) -> str:
        """Column and row of a texture."""
        at = f"({index})" if " " in index else index
        return f"{at} % {TEXTURE_WIDTH}, {at} / {TEXTURE_WIDTH}"

    float_of_bits: ClassVar[str]
    """Function that makes a float of its bits."""

    def vector_of_bits(self, element: str) -> str:
        return f"{self.float_of_bits}({element})"

    def vector_of_halves(self, word: str) -> str:
        raise NotImplementedError

    def local(self, type_: str, name: str, value: str) -> str:
        return f"{self.types[type_]} {name} = {value}"

    def conversion(self, to: str, value: str) -> str:
        return f"{self.types[to]}({value})"

    def vectors(self) -> list[str]:
        """Weights as constants, four in each."""
        if self.precision == "half":
            rows = [[self.uint_literal(w) for w in row]
                    for row in half_words(self.program.weights).tolist()]  # fmt: skip
        else:
            rows = [[self.float_literal(w) for w in row] for row in self.program.weights.tolist()]
        return [f"{self.packed}({', '.join(row)})" for row in rows]


def half_words(weights: np.ndarray) -> np.ndarray:
    """Weights as pairs of halves, the first in the low bits: uint32 [index, 2]."""
    return np.ascontiguousarray(weights.astype("<f2")).view("<u4")


def in_lines(texts: Sequence[str], width: int = 96) -> str:
    """Texts with commas between them, in lines."""
    lines, line = [], ""
    for text in texts:
        if line and len(line) + len(text) > width:
            lines.append(line)
            line = ""
        line += f"{text}, "
    return "\n".join(f"  {l.rstrip()}" for l in [*lines, line.rstrip(", ")])


def _used(f: Function) -> Iterator[str]:
    for statement in f.body:
        yield from _used_in(statement)


def _used_in(statement: Statement) -> Iterator[str]:
    match statement:
        case Loop(_, _, _, body) | When(_, body):
            if isinstance(statement, When):
                yield from _named(statement.condition)
            for inner in body:
                yield from _used_in(inner)
        case Declare(_, value):
            if value:
                yield from _named(value)
        case Assign(target, value):
            yield from _named(target)
            yield from _named(value)
        case Return(value):
            yield from _named(value)
        case Run(call):
            yield from _named(call)


def _named(e: Expression) -> Iterator[str]:
    """Tables, and WEIGHTS, in an expression and in the functions that it calls."""
    match e:
        case TableEntry(_, table, index):
            yield table
            yield from _named(index)
        case Weights(_, index):
            yield WEIGHTS
            yield from _named(index)
        case Binary(_, _, left, right):
            yield from _named(left)
            yield from _named(right)
        case Index(_, _, index):
            yield from _named(index)
        case Convert(_, value):
            yield from _named(value)
        case BuiltIn(_, _, arguments):
            for argument in arguments:
                yield from _named(argument)
        case Call(_, function, arguments):
            yield from _used(function)
            for argument in arguments:
                yield from _named(argument)
