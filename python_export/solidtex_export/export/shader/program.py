"""A small program: functions of expressions and loops, which emitters write in each language.

`uint` wraps modulo 2^32. A conversion of `uint` to `float` is used for values below 2^31 only.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

Type = Literal["float", "int", "uint", "bool", "vec3", "ivec3", "vec4"]


@dataclass(frozen=True)
class Array:
    """An array of scalars. As a parameter it is passed by reference."""

    of: Type
    size: int


AnyType = Type | Array


@dataclass(frozen=True, eq=False)
class Expression:
    type: AnyType

    def __add__(self, other: Expression) -> Expression:
        return Binary(_wider(self, other), "+", self, other)

    def __sub__(self, other: Expression) -> Expression:
        return Binary(_wider(self, other), "-", self, other)

    def __mul__(self, other: Expression) -> Expression:
        return Binary(_wider(self, other), "*", self, other)

    def __truediv__(self, other: Expression) -> Expression:
        return Binary(_wider(self, other), "/", self, other)

    def __xor__(self, other: Expression) -> Expression:
        return Binary(self.type, "^", self, other)

    def __and__(self, other: Expression) -> Expression:
        return Binary(self.type, "&", self, other)

    def __or__(self, other: Expression) -> Expression:
        return Binary(self.type, "|", self, other)

    def __lshift__(self, bits: int) -> Expression:
        return Binary(self.type, "<<", self, uint(bits))

    def __rshift__(self, bits: int) -> Expression:
        return Binary(self.type, ">>", self, uint(bits))

    def __lt__(self, other: Expression) -> Expression:
        return Binary("bool", "<", self, other)

    def __ge__(self, other: Expression) -> Expression:
        return Binary("bool", ">=", self, other)

    def __getitem__(self, index: Expression) -> Expression:
        assert isinstance(self.type, Array)
        return Index(self.type.of, self, index)

    def part(self, axis: int) -> Expression:
        """Component of a vector."""
        return Component("int" if self.type == "ivec3" else "float", self, axis)


@dataclass(frozen=True, eq=False)
class Number(Expression):
    value: float


@dataclass(frozen=True, eq=False)
class Name(Expression):
    name: str


@dataclass(frozen=True, eq=False)
class Binary(Expression):
    operator: str
    left: Expression
    right: Expression


@dataclass(frozen=True, eq=False)
class Index(Expression):
    array: Expression
    index: Expression


@dataclass(frozen=True, eq=False)
class Component(Expression):
    vector: Expression
    axis: int


@dataclass(frozen=True, eq=False)
class Convert(Expression):
    value: Expression


@dataclass(frozen=True, eq=False)
class BuiltIn(Expression):
    """A function that all languages have, or a vector of its parts."""

    name: str
    arguments: tuple[Expression, ...]


@dataclass(frozen=True, eq=False)
class TableEntry(Expression):
    table: str
    index: Expression


@dataclass(frozen=True, eq=False)
class Weights(Expression):
    """Four weights at an index."""

    index: Expression


@dataclass(frozen=True, eq=False)
class Call(Expression):
    function: Function
    arguments: tuple[Expression, ...]


def number(value: float) -> Expression:
    return Number("float", value)


def integer(value: int) -> Expression:
    return Number("int", value)


def uint(value: int) -> Expression:
    return Number("uint", value & 0xFFFFFFFF)


def convert(to: Type, value: Expression) -> Expression:
    return Convert(to, value)


def built_in(name: str, *arguments: Expression) -> Expression:
    made: dict[str, Type] = {"vec3": "vec3", "vec4": "vec4", "ivec3": "ivec3"}
    return BuiltIn(made.get(name, arguments[0].type), name, arguments)


def mix(a: Expression, b: Expression, t: Expression) -> Expression:
    return a + t * (b - a)


def _wider(a: Expression, b: Expression) -> AnyType:
    return b.type if b.type in ("vec3", "vec4") else a.type


@dataclass(frozen=True)
class Declare:
    variable: Name
    value: Expression | None


@dataclass(frozen=True)
class Assign:
    target: Expression
    value: Expression


@dataclass(frozen=True)
class Loop:
    """The body for variable = first, first + 1 ... end - 1."""

    variable: Name
    first: int
    end: int
    body: list[Statement]


@dataclass(frozen=True)
class When:
    condition: Expression
    body: list[Statement]


@dataclass(frozen=True)
class Return:
    value: Expression


@dataclass(frozen=True)
class Run:
    call: Call


Statement = Declare | Assign | Loop | When | Return | Run


@dataclass(eq=False)
class Function:
    """A function, and the means to write its body."""

    name: str
    parameters: Mapping[str, AnyType]
    result: Type | None
    comment: str = ""
    body: list[Statement] = field(default_factory=list)

    def __post_init__(self) -> None:
        self._open = [self.body]

    def arguments(self) -> tuple[Expression, ...]:
        return tuple(Name(type_, name) for name, type_ in self.parameters.items())

    def __call__(self, *arguments: Expression) -> Call:
        assert len(arguments) == len(self.parameters), self.name
        return Call(self.result or "bool", self, arguments)

    def let(self, name: str, value: Expression) -> Name:
        variable = Name(value.type, name)
        self._open[-1].append(Declare(variable, value))
        return variable

    def array(self, name: str, of: Type, size: int) -> Name:
        variable = Name(Array(of, size), name)
        self._open[-1].append(Declare(variable, None))
        return variable

    def set(self, target: Expression, value: Expression) -> None:
        self._open[-1].append(Assign(target, value))

    def run(self, call: Call) -> None:
        self._open[-1].append(Run(call))

    def give(self, value: Expression) -> None:
        self._open[-1].append(Return(value))

    @contextmanager
    def loop(self, name: str, end: int, first: int = 0) -> Iterator[Name]:
        variable, body = Name("int", name), list[Statement]()
        self._open[-1].append(Loop(variable, first, end, body))
        self._open.append(body)
        yield variable
        self._open.pop()

    @contextmanager
    def when(self, condition: Expression) -> Iterator[None]:
        body = list[Statement]()
        self._open[-1].append(When(condition, body))
        self._open.append(body)
        yield
        self._open.pop()


@dataclass(frozen=True, eq=False)
class Table:
    """Constants beside the weights: uint32 or float32."""

    name: str
    of: Type
    values: np.ndarray


@dataclass(frozen=True)
class Program:
    name: str
    """First part of all names."""
    functions: Sequence[Function]
    tables: Sequence[Table]
    weights: np.ndarray
    """float32 [index, 4]"""
    comment: Sequence[str]

    def table(self, name: str) -> Table:
        return next(t for t in self.tables if t.name == name)

    def words(self) -> np.ndarray:
        """All tables, one after another, as the bits of their values."""
        return np.concatenate([t.values.view(np.uint32) for t in self.tables])

    def first_word(self, name: str) -> int:
        before = self.tables[: self.tables.index(self.table(name))]
        return sum(len(t.values) for t in before)

    def first_weight(self, per_element: int) -> int:
        """Index of the first weights behind the words, of which an element has several."""
        return -(-len(self.words()) // per_element)
