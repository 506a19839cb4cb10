"""Generate the serialiser of a type: Python source, specialised for one encoding.

DDS-XTypes 1.3 §7.4.  The generated function takes a sample and returns its octets; it raises whatever the first
unfit value makes Python raise (``value_check.py`` then finds the member and says it properly), and for what
:mod:`struct` does not check, such as bounds, ``ValueError``.  Nested structs are written in line; recursive ones
have a function of their own.

Here are structs, unions and their members; ``write_values.py`` has the rest.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from . import buffers
from .layout import ALIGNED, UNKNOWN, Encoding, emheader_length_code, static_size
from .model import ArrayType, Composite, Extensibility, Member, SequenceType, StructType, UnionType
from .recursion import FunctionPlan
from .source import Source
from .write_emitter import Position, WriteEmitter
from .write_values import PLAIN_SEQUENCES, ValueWriter, enum_values, pack_numbers, pack_strings

__all__ = ["generate_writer"]

PID_EXTENDED_MUST_UNDERSTAND = 0x7F01
"""PID_EXTENDED with the must-understand flag, as Cyclone DDS writes it for every parameter (§7.4.1.2)."""

PID_LIST_END_MUST_UNDERSTAND = 0x7F02


def generate_writer(
    struct_type: StructType, encoding: Encoding, *, header: bool = True, padded: bool = False
) -> tuple[Callable[[Any], bytes], str]:
    """(function of a sample that returns its octets, the function's source).

    ``header``: begin with the 4 octets of encapsulation.  ``padded``: end with zeros up to a multiple of 4 and say
    in the header's options how many they are (RTPS 2.5 §10.2, DDS-XTypes 1.3 §7.6.3.1.2).
    """
    source = Source(f"write {struct_type.type_name}, {encoding.name}")
    source.names |= {name: getattr(buffers, name) for name in _RUNTIME} | {
        "PLAIN_SEQUENCES": PLAIN_SEQUENCES,
        "encode": str.encode,  # of a str only, unlike a method of that name; and CPython 3.11 may crash on str.encode()
        "enum_values": enum_values,
        "pack_numbers": pack_numbers,
        "pack_strings": pack_strings,
    }
    writer = _TypeWriter(source, encoding, FunctionPlan(struct_type))
    with source.block("def write(v):"):
        writer.top(struct_type, header=header, padded=padded)
    return source.compile("write"), source.text


_RUNTIME = (
    *("array_numbers", "array_octets", "beyond", "booleans", "chars", "flatten", "numbers", "octets", "wchars"),
    "sequence",
)


class _TypeWriter(ValueWriter):
    """Writes structs and unions."""

    def top(self, type_: StructType, *, header: bool, padded: bool) -> None:
        emitter = self._emitter
        identifier = self._encoding.encapsulation_id(type_.extensibility)
        dynamic = padded and static_size(type_, ALIGNED, self._encoding) is None
        size = static_size(type_, ALIGNED, self._encoding) or 0
        encapsulation = repr(identifier + bytes((0, -size % 4 if padded else 0)))
        if header:
            encapsulation = emitter.defer("e") if dynamic else encapsulation
            emitter.uncounted("4s", encapsulation)
        self.struct_body(type_, "v")
        if dynamic:
            self._pad_end(identifier, encapsulation)
        elif padded and size % 4:
            emitter.pad(-size % 4)
        self._source.line(f"return {emitter.joined()}")

    def _pad_end(self, identifier: bytes, encapsulation: str) -> None:
        source, emitter = self._source, self._emitter
        known = emitter.position.residue.padding(4)
        if known is not None:
            emitter.resolve(encapsulation, repr(identifier + bytes((0, known))))
            emitter.align(4)
            return
        headers = source.define("HEADERS_", repr(tuple(identifier + bytes((0, pad)) for pad in range(4))))
        padding = source.define("PADDING_", repr(tuple(bytes(pad) for pad in range(4))))
        source.line(f"k = -({emitter.position}) & 3")
        emitter.resolve(encapsulation, f"{headers}[k]")
        emitter.part(f"{padding}[k]", "k", UNKNOWN)

    # --- structs -----------------------------------------------------------------------------------------

    def _struct(self, type_: StructType, expression: str) -> None:
        self._composite(type_, expression)

    def _union(self, type_: UnionType, expression: str) -> None:
        self._composite(type_, expression)

    def _composite(self, type_: Composite, expression: str) -> None:
        function = self._plan.function(type_)
        if function is None:
            with self._plan.inside():
                self._body(type_, expression if expression.isidentifier() else self._local("v", expression))
            return
        name, is_new = function
        if is_new:
            with self._source.apart(), self._plan.inside(0):
                self._write_function(f"write_{name}", type_)
        self._emitter.call(f"write_{name}", expression, f"{self._depth} + 1")

    def _body(self, type_: Composite, value: str) -> None:
        if isinstance(type_, StructType):
            self.struct_body(type_, value)
        else:
            self.union_body(type_, value)

    def _write_function(self, name: str, type_: Composite) -> None:
        outer, outer_depth = self._emitter, self._depth
        position = Position(("p",), 0, UNKNOWN)
        self._emitter, self._depth = WriteEmitter(self._source, self._encoding, position, listed=True), "depth"
        with self._source.block(f"def {name}(v, parts, p, depth):"):
            self._refuse(f"depth > {StructType.MAX_DEPTH}")
            self._body(type_, "v")
            self._emitter.flush()
            self._source.line(f"return {self._emitter.position}")
        self._emitter, self._depth = outer, outer_depth

    def struct_body(self, type_: StructType, value: str) -> None:
        delimiter = self._open_dheader(type_)
        mutable = type_.extensibility is Extensibility.MUTABLE
        for member in type_.members:
            expression = f"{value}.{member.name}"
            if member.is_optional:
                self._optional(member, self._local("x", expression), mutable=mutable)
            elif mutable:
                self._parameter(member, self._within_limits(member, expression))
            else:
                self.value(member.type, self._within_limits(member, expression))
        if mutable:
            self._end_parameters()
        self._close_dheader(delimiter)

    def _within_limits(self, member: Member, expression: str) -> str:
        """The expression, or where the member has an ``idl.range`` a variable that was seen to lie within."""
        if member.limits is None:
            return expression
        value = self._local("x", expression)
        allow = self._source.constant("allow", member.limits.allow)
        if isinstance(member.type, (SequenceType, ArrayType)):
            dimensions = member.type.dimensions if isinstance(member.type, ArrayType) else ()
            self._refuse(f"beyond({allow}, {value}, {dimensions})")
        else:
            self._refuse(f"not {allow}({value})")
        return value

    def _end_parameters(self) -> None:
        if not self._encoding.is_xcdr2:
            self._emitter.align(4)
            self._emitter.item("H", 2, str(PID_LIST_END_MUST_UNDERSTAND))
            self._emitter.item("H", 2, "0")

    def union_body(self, type_: UnionType, value: str) -> None:
        """The discriminator, then the member that it selects, if any (DDS-XTypes 1.3 §7.4.3.5.3)."""
        source = self._source
        self._refuse(f"{value}.__class__ is not {source.constant('Union', type_.python_class)}")
        delimiter = self._open_dheader(type_)
        mutable = type_.extensibility is Extensibility.MUTABLE
        write_member = self._parameter if mutable else lambda member, expression: self.value(member.type, expression)
        discriminator = self._local("d", f"{value}._idl_discriminator")
        write_member(type_.discriminator, discriminator)
        index = self._local(
            "k", f"{source.constant('selection', type_.selection)}.get({discriminator}, {type_.default_index})"
        )
        with self._emitter.branches() as alternatives:
            for number, case in enumerate(type_.cases):
                with alternatives.branch(f"{'elif' if number else 'if'} {index} == {number}:"):
                    write_member(case, self._within_limits(case, f"{value}._idl_value"))
            with alternatives.branch("else:" if type_.cases else f"if {index} < 0:"):
                pass
        if mutable:
            self._end_parameters()
        self._close_dheader(delimiter)

    def _optional(self, member: Member, value: str, *, mutable: bool) -> None:
        emitter = self._emitter
        with emitter.branches() as alternatives:
            with alternatives.branch(f"if {value} is not None:"):
                value = self._within_limits(member, value)
                if mutable or not self._encoding.is_xcdr2:
                    self._parameter(member, value, padded=mutable)
                else:
                    emitter.item("B", 1, "1")
                    self.value(member.type, value)
            with alternatives.branch("else:"):
                if not mutable and self._encoding.is_xcdr2:
                    emitter.item("B", 1, "0")
                elif not mutable:
                    self._parameter_header(member, "0")

    # --- parameters (members that carry a header) -------------------------------------------------------

    def _parameter(self, member: Member, expression: str, *, padded: bool = True) -> None:
        if self._encoding.is_xcdr2:
            self._emheader_member(member, expression)
        else:
            self._xcdr1_parameter(member, expression, padded=padded)

    def _parameter_header(self, member: Member, length: str) -> None:
        """PID_EXTENDED, its length 8, the member id, the value's length (DDS-XTypes 1.3 §7.4.1.2.2)."""
        emitter = self._emitter
        emitter.align(4)
        emitter.item("H", 2, str(PID_EXTENDED_MUST_UNDERSTAND))
        emitter.item("H", 2, "8")
        emitter.item("I", 4, hex(member.id | (0x40000000 if member.must_understand else 0)))
        emitter.item("I", 4, length)

    def _xcdr1_parameter(self, member: Member, expression: str, *, padded: bool) -> None:
        """The value's alignment counts from its own first octet; in a mutable type it is filled up to 4."""
        emitter = self._emitter
        size = static_size(member.type, ALIGNED, self._encoding)
        if size is not None:
            size += -size % 4 if padded else 0
        length = emitter.defer("h") if size is None else str(size)
        self._parameter_header(member, length)
        start, emitter.position = emitter.position, Position()
        self.value(member.type, expression)
        if padded:
            emitter.align(4)
        if size is not None:
            emitter.position = start.advance(size)
            return
        emitter.resolve(length, str(emitter.position))
        residue = start.residue.advance_multiple(4) if padded else UNKNOWN
        emitter.position = Position((*start.terms, length), start.offset, residue)

    def _emheader_member(self, member: Member, expression: str) -> None:
        """EMHEADER1, and NEXTINT where no part of the value serves as one (DDS-XTypes 1.3 §7.4.3.4.2)."""
        emitter = self._emitter
        length_code = emheader_length_code(member.type)
        emitter.align(4)
        emitter.item("I", 4, hex(member.id | length_code << 28 | (0x80000000 if member.must_understand else 0)))
        if length_code != 4:
            self.value(member.type, expression)
            return
        size = static_size(member.type, emitter.position.residue.advance(4), self._encoding)
        length = emitter.defer("h") if size is None else str(size)
        emitter.item("I", 4, length)
        start = emitter.position
        self.value(member.type, expression)
        if size is None:
            emitter.resolve(length, emitter.position.minus(start))
