"""Generate the serialiser of a type: Python source, specialised for one encoding.

DDS-XTypes 1.3 §7.4.  The generated function takes a sample and returns its octets; it raises whatever the first
unfit value makes Python raise (``value_check.py`` then finds the member and says it properly), and for what
:mod:`struct` does not check, such as bounds, ``ValueError``.  Nested structs are written in line; recursive ones
have a function of their own.
"""

from __future__ import annotations

import enum
import struct
from array import array
from collections.abc import Callable
from typing import Any

from . import buffers
from .buffers import needs_swap
from .layout import (
    ALIGNED,
    UNKNOWN,
    Encoding,
    Residue,
    after,
    emheader_length_code,
    has_dheader,
    static_size,
)
from .model import (
    BOOLEAN,
    CHAR,
    WCHAR,
    ArrayType,
    BitmaskType,
    EnumType,
    Extensibility,
    IdlType,
    Member,
    Primitive,
    SequenceType,
    String,
    StructType,
)
from .recursion import FunctionPlan
from .source import Source
from .write_emitter import Position, WriteEmitter

__all__ = ["generate_writer"]

_IN_RUN = 64
"""Arrays of primitives up to so many octets are copied into a run; larger ones go as buffers of their own."""

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
        "array": array,
        "enum_values": enum_values,
        "pack_numbers": pack_numbers,
    }
    writer = _TypeWriter(source, encoding, FunctionPlan(struct_type))
    with source.block("def write(v):"):
        writer.top(struct_type, header=header, padded=padded)
    return source.compile("write"), source.text


_RUNTIME = (
    *("array_numbers", "array_octets", "booleans", "chars", "flatten", "numbers", "octets", "wchars"),
    "NOT_SEQUENCES",
)


def enum_values(values: Any, python_class: type[enum.IntEnum]) -> list[int]:
    """The numbers of enum literals; ValueError for what is none."""
    return [item._value_ if item.__class__ is python_class else python_class(item)._value_ for item in values]


def pack_numbers(order: str, code: str, values: list[int]) -> bytes:
    return struct.pack(f"{order}{len(values)}{code}", *values)


class _TypeWriter:
    """Drives a :class:`WriteEmitter` over a type."""

    def __init__(self, source: Source, encoding: Encoding, plan: FunctionPlan) -> None:
        self._source = source
        self._encoding = encoding
        self._plan = plan
        self._emitter = WriteEmitter(source, encoding, Position(), listed=False)
        self._depth = "0"

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

    # --- one method for each kind of type -------------------------------------------------------------

    def value(self, type_: IdlType, expression: str) -> None:
        match type_:
            case Primitive() | EnumType() | BitmaskType():
                self._emitter.align(self._encoding.alignment(type_.size))
                self._emitter.item(type_.code, type_.size, self._item_expression(type_, expression))
            case String():
                self._string(type_, expression)
            case SequenceType(element=Primitive() as element):
                self._primitive_sequence(type_, element, expression)
            case SequenceType():
                self._sequence(type_, expression)
            case ArrayType(element=Primitive() as element):
                self._primitive_array(type_, element, expression)
            case ArrayType():
                self._array(type_, expression)
            case StructType():
                self._struct(type_, expression)

    def _item_expression(self, type_: Primitive | EnumType | BitmaskType, expression: str) -> str:
        if isinstance(type_, EnumType):
            name = self._local("x", expression)
            python_class = self._source.constant("Enum", type_.python_class)
            with self._source.block(f"if {name}.__class__ is not {python_class}:"):
                self._source.line(f"{name} = {python_class}({name})")
            return name
        if type_ == BOOLEAN:
            return f"{self._source.define('BOOLEAN_', '{False: 0, True: 1}')}[{expression}]"
        if type_ in (CHAR, WCHAR):
            return f"ord({expression})"
        return expression

    def _local(self, prefix: str, expression: str) -> str:
        """A variable that may be changed or is used more than once."""
        name = self._source.fresh(prefix)
        self._source.line(f"{name} = {expression}")
        return name

    def _string(self, type_: String, expression: str) -> None:
        emitter = self._emitter
        octets = self._local("s", f"{expression}.encode()")
        count = self._local("n", f"len({octets})")
        condition = f"0 in {octets}"  # IDL strings hold no NUL: a peer would read up to it
        if type_.bound is not None:
            condition = f"{count} > {type_.bound} or {condition}"
        self._refuse(condition)
        emitter.align(4)
        emitter.item("I", 4, f"{count} + 1")
        emitter.part(octets, count, UNKNOWN)
        emitter.pad(1)

    def _refuse(self, condition: str) -> None:
        with self._source.block(f"if {condition}:"):
            self._source.line("raise ValueError")

    # --- collections -------------------------------------------------------------------------------------

    def _primitive_sequence(self, type_: SequenceType, element: Primitive, expression: str) -> None:
        emitter = self._emitter
        buffer, count = self._sequence_buffer(type_, element, expression)
        if type_.bound is not None:
            self._refuse(f"{count} > {type_.bound}")
        emitter.align(4)
        emitter.item("I", 4, count)
        if self._encoding.alignment(element.size) == 8:
            self._align_elements(count)
        octets = count if element.size == 1 else f"{count} * {element.size}"
        residue = emitter.position.residue
        emitter.part(buffer, octets, residue.advance_multiple(element.size))

    def _align_elements(self, count: str) -> None:
        """In XCDR1 padding to 8 lies between count and elements, unless there are none (measured: s05)."""
        emitter = self._emitter
        residue = emitter.position.residue
        padding = residue.padding(8)
        if padding == 0:
            return
        if padding is None:
            name = self._local("z", f"-({emitter.position}) & 7 if {count} else 0")
            table = self._source.define("ZEROS_", repr(tuple(bytes(pad) for pad in range(8))))
            emitter.part(f"{table}[{name}]", name, residue.meet(ALIGNED) if residue.modulus >= 4 else UNKNOWN)
        else:
            emitter.part(f"{bytes(padding)!r} if {count} else b''", f"({padding} if {count} else 0)", Residue(4, 0))

    def _sequence_buffer(self, type_: SequenceType, element: Primitive, expression: str) -> tuple[str, str]:
        source = self._source
        if element.is_octet:
            buffer = self._local("b", expression)
            with source.block(f"if {buffer}.__class__ is not bytes:"):
                source.line(f"{buffer} = octets({buffer})")
        elif element.is_number:
            swap = needs_swap(little_endian=self._encoding.little_endian)
            buffer, count = source.fresh("b"), source.fresh("n")
            arguments = f"{expression}, '{element.code}', {element.size}, '{self._encoding.order}', swap={swap}"
            source.line(f"{buffer}, {count} = numbers({arguments})")
            return buffer, count
        else:
            buffer = self._local("b", self._characters(element, expression))
        count = self._local("n", f"len({buffer})" if element.size == 1 else f"len({buffer}) // {element.size}")
        return buffer, count

    def _characters(self, element: Primitive, expression: str) -> str:
        if element.name == "wchar":
            return f"wchars({expression}, little_endian={self._encoding.little_endian})"
        return f"{'booleans' if element.name == 'boolean' else 'chars'}({expression})"

    def _primitive_array(self, type_: ArrayType, element: Primitive, expression: str) -> None:
        emitter = self._emitter
        dimensions = type_.dimensions
        octets = type_.count * element.size
        if element.is_octet:
            buffer = f"array_octets({expression}, {dimensions})"
        elif element.is_number:
            swap = needs_swap(little_endian=self._encoding.little_endian)
            layout = f"'{element.code}', {element.size}, '{self._encoding.order}', swap={swap}"
            buffer = f"array_numbers({expression}, {dimensions}, {layout})"
        else:
            buffer = self._characters(element, f"flatten({expression}, {dimensions})")
        emitter.align(self._encoding.alignment(element.size))
        if octets <= _IN_RUN:
            name = self._local("b", f"bytes({buffer})")
            emitter.item(f"{octets}s", octets, name)
        else:
            name = self._local("b", buffer)
            emitter.part(name, str(octets), emitter.position.residue.advance(octets))
        if not element.is_number:
            self._refuse(f"len({name}) != {octets}")

    def _sequence(self, type_: SequenceType, expression: str) -> None:
        emitter = self._emitter
        value = self._local("v", expression)
        if isinstance(type_.element, EnumType):
            self._source.line(
                f"{value} = enum_values({value}, {self._source.constant('Enum', type_.element.python_class)})"
            )
        count = self._local("n", f"len({value})")
        condition = f"{value}.__class__ in NOT_SEQUENCES"
        self._refuse(condition if type_.bound is None else f"{count} > {type_.bound} or {condition}")
        delimiter = self._open_dheader(type_)
        emitter.align(4)
        emitter.item("I", 4, count)
        self._elements(type_, type_.element, value, count)
        self._close_dheader(delimiter)

    def _array(self, type_: ArrayType, expression: str) -> None:
        value = self._local("v", f"flatten({expression}, {type_.dimensions})")
        if isinstance(type_.element, EnumType):
            self._source.line(
                f"{value} = enum_values({value}, {self._source.constant('Enum', type_.element.python_class)})"
            )
        delimiter = self._open_dheader(type_)
        self._elements(type_, type_.element, value, str(type_.count))
        self._close_dheader(delimiter)

    def _elements(self, type_: IdlType, element: IdlType, value: str, count: str) -> None:
        emitter, encoding = self._emitter, self._encoding
        if isinstance(element, (EnumType, BitmaskType)):
            emitter.align(encoding.alignment(element.size))
            residue = emitter.position.residue.advance_multiple(element.size)
            octets = f"{count} * {element.size}"
            emitter.part(f"pack_numbers('{encoding.order}', '{element.code}', {value})", octets, residue)
            return
        residue = emitter.position.residue
        while (behind := residue.meet(after(element, residue, encoding))) != residue:
            residue = behind
        item = self._source.fresh("v")
        with emitter.loop(f"for {item} in {value}:", residue):
            self.value(element, item)

    # --- structs -----------------------------------------------------------------------------------------

    def _struct(self, type_: StructType, expression: str) -> None:
        function = self._plan.function(type_)
        if function is None:
            self.struct_body(type_, self._local("v", expression))
            return
        name, is_new = function
        if is_new:
            with self._source.apart():
                self._write_function(f"write_{name}", type_)
        self._emitter.call(f"write_{name}", expression, f"{self._depth} + 1")

    def _write_function(self, name: str, type_: StructType) -> None:
        outer, outer_depth = self._emitter, self._depth
        position = Position(("p",), 0, UNKNOWN)
        self._emitter, self._depth = WriteEmitter(self._source, self._encoding, position, listed=True), "depth"
        with self._source.block(f"def {name}(v, parts, p, depth):"):
            self._refuse(f"depth > {StructType.MAX_DEPTH}")
            self.struct_body(type_, "v")
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
                self._parameter(member, expression)
            else:
                self.value(member.type, expression)
        if mutable and not self._encoding.is_xcdr2:
            self._emitter.align(4)
            self._emitter.item("H", 2, str(PID_LIST_END_MUST_UNDERSTAND))
            self._emitter.item("H", 2, "0")
        self._close_dheader(delimiter)

    def _optional(self, member: Member, value: str, *, mutable: bool) -> None:
        emitter = self._emitter
        with emitter.branches() as alternatives:
            with alternatives.branch(f"if {value} is not None:"):
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

    def _open_dheader(self, type_: IdlType) -> tuple[str, Position] | None:
        emitter = self._emitter
        if not has_dheader(type_, self._encoding):
            return None
        emitter.align(4)
        size = static_size(type_, emitter.position.residue, self._encoding)
        length = emitter.defer("h") if size is None else str(size - 4)
        emitter.item("I", 4, length)
        return (length, emitter.position) if size is None else None

    def _close_dheader(self, delimiter: tuple[str, Position] | None) -> None:
        if delimiter is not None:
            length, start = delimiter
            self._emitter.resolve(length, self._emitter.position.minus(start))
