"""The shading languages: where each differs from the emitter's C."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

from solidtex_export.export.shader.emitter import WEIGHTS, Emitter, Storage, in_lines
from solidtex_export.export.shader.program import (
    AnyType,
    Array,
    Binary,
    BuiltIn,
    Component,
    Expression,
    Function,
    Index,
    Name,
    Number,
)

TYPES = ("float", "int", "uint", "bool", "vec3", "ivec3", "vec4", "uvec2", "uvec4")


def named(names: str) -> dict[str, str]:
    """Names of TYPES in a language."""
    return dict(zip(TYPES, names.split(), strict=False))


class Glsl(Emitter):
    """GLSL 3.30, ES 3.00 and later; a buffer needs 4.30 or ES 3.10, half constants 4.20."""

    language, suffix = "GLSL", ".glsl"
    storages: ClassVar[tuple[Storage, ...]] = ("texture", "buffer", "constant")
    types: ClassVar = named(" ".join(TYPES))
    float_of_bits = "uintBitsToFloat"

    def preamble(self) -> str:
        lines = ["#ifdef GL_ES", "precision highp float;", "precision highp int;"]
        lines += ["precision highp sampler2D;"] if self.storage == "texture" else []
        return "\n".join([*lines, "#endif\n"])

    def constant(self, name: str, type_: str, values: Sequence[str]) -> str:
        array = f"{type_}[{len(values)}]"
        return f"const {array} {self.global_name(name)} = {array}(\n{in_lines(values)});\n"

    def resource_declaration(self) -> str:
        name = self.global_name(WEIGHTS)
        if self.storage == "texture":  # or a macro of that name is another sampler
            return f"#ifndef {name}\nuniform sampler2D {name};\n#endif\n"
        element = self.types["uvec2" if self.precision == "half" else "uvec4"]
        return (
            "#ifndef SOLIDTEX_LAYOUT\n#define SOLIDTEX_LAYOUT std430, binding = 0\n#endif\n"
            f"layout(SOLIDTEX_LAYOUT) readonly buffer {name}_buffer {{\n"
            f"  {element} {name}[];\n}};\n"
        )

    def fetched(self, index: str) -> str:
        name = self.global_name(WEIGHTS)
        if self.storage == "buffer":
            return f"{name}[{index}]"
        return f"texelFetch({name}, ivec2({self.texel(index)}), 0)"

    def vector_of_halves(self, word: str) -> str:
        return f"vec4(unpackHalf2x16({word}.x), unpackHalf2x16({word}.y))"


class Godot(Glsl):
    """Godot's shading language, as a file for `#include`: its textures are uniforms, no macros."""

    language, suffix = "Godot", ".gdshaderinc"
    storages = ("texture",)

    def preamble(self) -> str:
        return ""

    def resource_declaration(self) -> str:
        return f"uniform sampler2D {self.global_name(WEIGHTS)} : filter_nearest;\n"


class Wgsl(Emitter):
    language, suffix = "WGSL", ".wgsl"
    storages = ("buffer", "texture", "constant")
    types: ClassVar = named("f32 i32 u32 bool vec3<f32> vec3<i32> vec4<f32> vec2<u32> vec4<u32>")
    float_of_bits = "bitcast<f32>"

    def constant(self, name: str, type_: str, values: Sequence[str]) -> str:
        array = f"array<{self.types.get(type_, type_)}, {len(values)}>"
        named = f"var<private> {self.global_name(name)}: {array}"
        return f"{named} = {array}(\n{in_lines(values)});\n"

    def resource_declaration(self) -> str:
        name = self.global_name(WEIGHTS)
        if self.storage == "texture":
            return f"@group(0) @binding(0) var {name}: texture_2d<f32>;\n"
        element = self.types["uvec2" if self.precision == "half" else "uvec4"]
        return f"@group(0) @binding(0) var<storage, read> {name}: array<{element}>;\n"

    def fetched(self, index: str) -> str:
        name = self.global_name(WEIGHTS)
        if self.storage == "buffer":
            return f"{name}[{index}]"
        return f"textureLoad({name}, vec2<i32>({self.texel(index)}), 0)"

    def helper(self, name: str, result: str, lines: Sequence[str]) -> str:
        body = "".join(f"  {line}\n" for line in lines)
        return f"fn {self.global_name(name)}(index: i32) -> {result} {{\n{body}}}\n"

    def vector_of_bits(self, element: str) -> str:
        return f"bitcast<vec4<f32>>({element})"

    def vector_of_halves(self, word: str) -> str:
        return f"vec4<f32>(unpack2x16float({word}.x), unpack2x16float({word}.y))"

    def local(self, type_: str, name: str, value: str) -> str:
        return f"let {name} = {value}"

    def _type(self, type_: AnyType) -> str:
        if isinstance(type_, Array):
            return f"array<{self.types[type_.of]}, {type_.size}>"
        return self.types[type_]

    def declaration(self, type_: AnyType, name: str) -> str:
        return f"{name}: {self._type(type_)}"

    def variable(self, variable: Name, value: Expression | None) -> str:
        return f"var {super().variable(variable, value)}"

    def loop(self, name: str, first: int, end: int) -> str:
        return f"for (var {name}: i32 = {first}; {name} < {end}; {name}++)"

    def reference(self, type_: Array, name: str) -> str:
        return f"{name}: ptr<function, {self._type(type_)}>"

    def opening(self, f: Function, parameters: str) -> str:
        result = f" -> {self.types[f.result]}" if f.result else ""
        return f"fn {f.name}({parameters}){result}"

    def expression(self, e: Expression) -> str:
        if isinstance(e, Index) and isinstance(e.array, Name) and e.array.name in self.references:
            return f"(*{e.array.name})[{self.bare(e.index)}]"
        return super().expression(e)

    def argument(self, e: Expression) -> str:
        if isinstance(e, Name) and isinstance(e.type, Array) and e.name not in self.references:
            return f"&{e.name}"
        return super().argument(e)


class Hlsl(Emitter):
    """HLSL, Shader Model 5 and later."""

    language, suffix = "HLSL", ".hlsl"
    storages = ("buffer", "texture", "constant")
    types: ClassVar = named("float int uint bool float3 int3 float4 uint2 uint4")
    float_of_bits = "asfloat"

    def constant(self, name: str, type_: str, values: Sequence[str]) -> str:
        declared = f"{self.types.get(type_, type_)} {self.global_name(name)}[{len(values)}]"
        return f"static const {declared} = {{\n{in_lines(values)}}};\n"

    def resource_declaration(self) -> str:
        return (
            "#ifndef SOLIDTEX_REGISTER\n#define SOLIDTEX_REGISTER\n#endif\n"
            f"{self._resource_type()} {self.global_name(WEIGHTS)} SOLIDTEX_REGISTER;\n"
        )

    def _resource_type(self) -> str:
        if self.storage == "texture":
            return "Texture2D<float4>"
        return f"StructuredBuffer<{self.types['uvec2' if self.precision == 'half' else 'uvec4']}>"

    def fetched(self, index: str) -> str:
        name = self.resource_argument(WEIGHTS)
        if self.storage == "buffer":
            return f"{name}[{index}]"
        return f"{name}.Load(int3({self.texel(index)}, 0))"

    def vector_of_halves(self, word: str) -> str:
        parts = ", ".join(f"f16tof32({word}.{c}{shift})" for c in "xy" for shift in ("", " >> 16"))
        return f"float4({parts})"


class Slang(Hlsl):
    language, suffix = "Slang", ".slang"


class Metal(Emitter):
    """The Metal shading language. It has no global resources: functions take the weights last."""

    language, suffix = "Metal", ".metal"
    storages = ("buffer", "texture", "constant")
    types: ClassVar = Hlsl.types
    float_of_bits = "as_type<float>"

    @property
    def threaded(self) -> Sequence[str]:
        return () if self.storage == "constant" else (WEIGHTS,)

    def preamble(self) -> str:
        return "#include <metal_stdlib>\nusing namespace metal;\n"

    def constant(self, name: str, type_: str, values: Sequence[str]) -> str:
        declared = f"{self.types.get(type_, type_)} {self.global_name(name)}[{len(values)}]"
        return f"constant {declared} = {{\n{in_lines(values)}}};\n"

    def resource_declaration(self) -> str:
        return ""

    def resource(self, name: str) -> str:
        if self.storage == "texture":
            return f"texture2d<float, access::read> {name}"
        element = self.types["uvec2" if self.precision == "half" else "uvec4"]
        return f"device const {element}* {name}"

    def float_literal(self, value: float) -> str:
        return f"{super().float_literal(value)}f"

    def resource_argument(self, name: str) -> str:
        return self.global_name(name) if self.storage == "constant" else WEIGHTS

    def fetched(self, index: str) -> str:
        if self.storage == "buffer":
            return f"{WEIGHTS}[{index}]"
        return f"{WEIGHTS}.read(uint2({self.texel(index)}))"

    def reference(self, type_: Array, name: str) -> str:
        return f"thread {self.types[type_.of]} (&{name})[{type_.size}]"

    def vector_of_bits(self, element: str) -> str:
        return f"as_type<float4>({element})"

    def vector_of_halves(self, word: str) -> str:
        return f"float4(as_type<half4>({word}))"


OSL_PREAMBLE = """#include "stdosl.h"

struct solidtex_cell { int x; int y; int z; };
struct solidtex_four { float x; float y; float z; float w; };
solidtex_four __operator__add__(solidtex_four a, solidtex_four b) {
  return solidtex_four(a.x + b.x, a.y + b.y, a.z + b.z, a.w + b.w);
}
solidtex_four __operator__mul__(solidtex_four a, float b) {
  return solidtex_four(a.x * b, a.y * b, a.z * b, a.w * b);
}
solidtex_four solidtex_larger(solidtex_four a, solidtex_four b) {
  return solidtex_four(max(a.x, b.x), max(a.y, b.y), max(a.z, b.z), max(a.w, b.w));
}
"""


class Osl(Emitter):
    """Open Shading Language: no unsigned integers, no bits of floats, no vectors of four.

    Arrays of constants are parameters of the shader, which functions receive.
    """

    language, suffix = "OSL", ".osl"
    storages = ("constant",)
    precisions = ("float",)
    types: ClassVar = named("float int int int vector solidtex_cell solidtex_four")

    @property
    def threaded(self) -> Sequence[str]:
        return (*(t.name for t in self.program.tables), WEIGHTS)

    def preamble(self) -> str:
        return OSL_PREAMBLE

    def constant(self, name: str, type_: str, values: Sequence[str]) -> str:
        """Nothing here: constants are parameters of the shader."""
        return ""

    def vectors(self) -> list[str]:
        return [self.float_literal(w) for w in self.program.weights.ravel().tolist()]

    @property
    def packed(self) -> str:
        return "float"

    def _array(self, name: str) -> str:
        if name == WEIGHTS:
            return f"float {WEIGHTS}[{self.program.weights.size}]"
        table = self.program.table(name)
        return f"{self.types[table.of]} {name}[{len(table.values)}]"

    def resource(self, name: str) -> str:
        return self._array(name)

    def resource_argument(self, name: str) -> str:
        return name

    def reference(self, type_: Array, name: str) -> str:
        return f"output {self.declaration(type_, name)}"

    def weights_at(self) -> str:
        parts = ", ".join(f"{WEIGHTS}[4 * index + {k}]" for k in range(4))
        return (
            f"solidtex_four {self.global_name('weights_at')}(int index,"
            f" {self._array(WEIGHTS)}) {{\n"
            f"  return solidtex_four({parts});\n}}\n"
        )

    def helper_call(self, name: str, index: str) -> str:
        return f"{self.global_name(name)}({index}, {WEIGHTS})"

    def uint_literal(self, value: int) -> str:
        if value == 1 << 31:
            return "(-2147483647 - 1)"
        return str(value - (1 << 32) if value >> 31 else value)

    def binary(self, e: Binary) -> str:
        if "uint" in (e.left.type, e.right.type):
            left, right = self.expression(e.left), self.expression(e.right)
            if e.operator == ">>" and isinstance(e.right, Number) and e.left.type == "uint":
                mask = (1 << (32 - int(e.right.value))) - 1
                return f"(({left} >> {right}) & {mask})"
            if e.operator == "<":
                flip = "(-2147483647 - 1)"
                return f"(({left} ^ {flip}) < ({right} ^ {flip}))"
        return super().binary(e)

    def bare(self, e: Expression) -> str:
        return self.expression(e)

    def component(self, e: Component) -> str:
        if e.vector.type == "vec3":
            return f"{self.expression(e.vector)}[{e.axis}]"
        return super().component(e)

    def conversion(self, to: str, value: str) -> str:
        return f"({self.types[to]})({value})"

    def built_in(self, e: BuiltIn) -> str:
        arguments = ", ".join(map(self.bare, e.arguments))
        if e.name == "max" and e.type == "vec4":
            return f"solidtex_larger({arguments})"
        return f"{self.types.get(e.name, e.name)}({arguments})"

    def ending(self) -> str:
        tables = [(t.name, self.numbers(t)) for t in self.program.tables]
        arrays = "".join(
            f",\n  {self._array(name)} = {{\n{in_lines(values)}}} [[int lockgeom = 1]]"
            for name, values in [*tables, (WEIGHTS, self.vectors())]
        )
        given = ", ".join(self.threaded)
        return (
            f"shader {self.program.name}_shader(\n"
            "  point texel = P,\n  float footprint = 0,\n  output color albedo = 0"
            f"{arrays}) {{\n"
            f"  albedo = (color){self.program.name}((vector)texel, footprint, {given});\n}}\n"
        )


EMITTERS: Sequence[type[Emitter]] = (Wgsl, Glsl, Godot, Hlsl, Osl, Metal, Slang)
