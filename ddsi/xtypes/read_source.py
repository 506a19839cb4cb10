"""Generate the deserialiser of a type: Python source, specialised for one encoding.

DDS-XTypes 1.3 §7.4.  The generated function predicts: it reads what a writer of the very same type writes, members
in order, delimiters as computed, and raises (whatever comes: IndexError, struct.error, KeyError, ValueError) as soon
as the octets differ.  Its caller then reads again with ``careful_reader.py``, which knows every other valid form
and says where octets are malformed.  The prediction is safe by itself: no count is trusted before the octets
it speaks of are there, recursion is bounded, and time is linear in the payload.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from typing import Any

from . import buffers
from .buffers import needs_swap
from .defaults import default_value, numpy_array, numpy_dtype
from .enumerations import bitmask_from
from .layout import (
    ALIGNED,
    UNKNOWN,
    Encoding,
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
from .read_emitter import ReadEmitter
from .recursion import FunctionPlan
from .source import Source
from .write_source import PID_EXTENDED_MUST_UNDERSTAND, PID_LIST_END_MUST_UNDERSTAND

__all__ = ["generate_reader"]

_IN_RUN = 256
"""Arrays of primitives up to so many octets are part of a run; larger ones are copied only once."""


def generate_reader(
    struct_type: StructType, encoding: Encoding, *, view: bool = False
) -> tuple[Callable[[Any], Any], str]:
    """(function of a payload that returns the sample, the function's source).

    The payload begins with its encapsulation header, which the caller has looked at.  It is ``bytes``; with
    ``view``, a ``memoryview`` (slower for small samples, spares large ones a copy).
    """
    source = Source(f"read {struct_type.type_name}, {encoding.name}{', memoryview' if view else ''}")
    source.names |= {
        "new": object.__new__,
        "number_array": buffers.number_array,
        "booleans_from": buffers.booleans_from,
        "wchars_from": buffers.wchars_from,
        "nest": buffers.nest,
        "numpy_numbers": numpy_numbers,
        "enumerations": enumerations,
        "bitmask_from": bitmask_from,
    }
    reader = _TypeReader(source, encoding, FunctionPlan(struct_type), view=view)
    with source.block("def read(d):"):
        reader.top(struct_type)
    return source.compile("read"), source.text


def numpy_numbers(type_: SequenceType | ArrayType, order: str, octets: Any) -> Any:
    """A numpy array, in this machine's byte order and memory of its own."""
    import numpy

    assert isinstance(type_.element, Primitive)
    found = numpy.frombuffer(octets, dtype=numpy_dtype(type_.element, order))
    return numpy_array(type_, found)


def enumerations(d: Any, start: int, count: int, item_format: str, size: int, make: Callable[[int], Any]) -> list[Any]:
    """``count`` enum literals or bitmasks; raises for what is none, or not there."""
    if start + count * size > len(d):
        raise IndexError("elements beyond the end")
    return [make(number) for number in struct.unpack_from(f"{item_format[0]}{count}{item_format[1]}", d, start)]


class _TypeReader:
    """Drives a :class:`ReadEmitter` over a type.  Methods return the expression of the value read."""

    def __init__(self, source: Source, encoding: Encoding, plan: FunctionPlan, *, view: bool) -> None:
        self._source = source
        self._encoding = encoding
        self._plan = plan
        self._view = view
        self._emitter = ReadEmitter(source, encoding, base="", offset=4, residue=ALIGNED)
        self._depth = "0"

    def top(self, type_: StructType) -> None:
        emitter = self._emitter
        delimited = has_dheader(type_, self._encoding)
        length = emitter.item("I", 4, "h") if delimited else ""
        end = "h_end" if delimited else ""
        if delimited:
            emitter.then(f"{end} = 8 + {length}")
        value = self._struct_members(type_, end)
        emitter.flush()
        position = emitter.position
        appendable = type_.extensibility is Extensibility.APPENDABLE
        if delimited:
            comparison = ">" if appendable else "!="
            emitter.refuse(f"{position} {comparison} {end} or not 0 <= len(d) - {end} <= 3")
        elif appendable:
            # A writer of a longer type appends members; one of a shorter type may append padding, counted in
            # the options, which must not be taken for the last members.
            emitter.refuse(f"{position} > len(d) - (d[3] & 3)")
        else:
            emitter.refuse(f"not 0 <= len(d) - ({position}) <= 3")
        self._source.line(f"return {value}")

    # --- one method for each kind of type -------------------------------------------------------------

    def value(self, type_: IdlType) -> str:
        match type_:
            case Primitive() | EnumType() | BitmaskType():
                self._emitter.align(self._encoding.alignment(type_.size))
                return self._item(type_, self._emitter.item(type_.code, type_.size))
            case String():
                return self._string(type_)
            case SequenceType(element=Primitive() as element):
                return self._primitive_sequence(type_, element)
            case SequenceType():
                return self._sequence(type_)
            case ArrayType(element=Primitive() as element):
                return self._primitive_array(type_, element)
            case ArrayType():
                return self._array(type_)
            case StructType():
                return self._struct(type_)

    def _item(self, type_: Primitive | EnumType | BitmaskType, raw: str) -> str:
        match type_:
            case EnumType():
                return f"{self._enum_table(type_)}[{raw}]"
            case BitmaskType():
                return f"bitmask_from({self._source.constant('Flags', type_.python_class)}, {raw})"
        if type_ == BOOLEAN:
            return f"(False, True)[{raw}]"
        return f"chr({raw})" if type_ in (CHAR, WCHAR) else raw

    def _enum_table(self, type_: EnumType) -> str:
        """A dict from number to literal (a number without literal: KeyError)."""
        name = f"literals_{self._source.constant('Enum', type_.python_class)}"
        self._source.names[name] = {literal.value: literal for literal in type_.python_class}
        return name

    def _string(self, type_: String) -> str:
        emitter = self._emitter
        emitter.align(4)
        count = emitter.item("I", 4, "n")
        emitter.flush()
        start = emitter.position
        end, text = self._source.fresh("e"), self._source.fresh("s")
        emitter.then(f"{end} = {start} + {count}")
        emitter.then(
            f"{text} = " + (f"str(d[{start}:{end} - 1], 'utf-8')" if self._view else f"d[{start}:{end} - 1].decode()")
        )
        # The octet before the end must be the NUL.  With a length of 0, which old writers use for the empty
        # string, it is the length's own last octet, or its first in big endian: 0 as well.
        condition = f"d[{end} - 1]"
        emitter.refuse(condition if type_.bound is None else f"{condition} or {count} > {type_.bound + 1}")
        emitter.move(end, UNKNOWN)
        return text

    # --- collections -------------------------------------------------------------------------------------

    def _primitive_sequence(self, type_: SequenceType, element: Primitive) -> str:
        emitter = self._emitter
        emitter.align(4)
        count = emitter.item("I", 4, "n")
        if type_.bound is not None:
            emitter.refuse(f"{count} > {type_.bound}")
        emitter.flush()
        behind_count = emitter.residue
        if self._encoding.alignment(element.size) == 8 and emitter.residue.padding(8) != 0:
            name = self._source.fresh("p")
            padding = emitter.residue.padding(8)
            expression = f"(-({emitter.position} - {emitter.origin}) & 7)" if padding is None else str(padding)
            emitter.then(f"{name} = {emitter.position} + ({expression} if {count} else 0)")
            emitter.move(name, behind_count.meet(ALIGNED))
        start = emitter.position
        residue = emitter.residue.advance_multiple(element.size)
        end = self._source.fresh("e")
        emitter.then(f"{end} = {start} + {count}" + (f" * {element.size}" if element.size > 1 else ""))
        value = self._primitives(type_, element, start, end)
        emitter.move(end, residue)
        return value

    def _primitives(self, type_: SequenceType | ArrayType, element: Primitive, start: str, end: str) -> str:
        """The elements between two indices.  Where a slice comes out short, the position tells in the end."""
        piece = f"d[{start}:{end}]"
        name = self._source.fresh("a")
        if type_.numpy:
            described = self._source.constant("type_", type_)
            expression = f"numpy_numbers({described}, '{self._encoding.order}', {piece})"
        elif element.is_octet:
            expression = f"bytes({piece})" if self._view else piece
        elif element.is_number:
            swap = needs_swap(little_endian=self._encoding.little_endian)
            expression = f"number_array('{element.code}', d, {start}, {end}, swap={swap})"
        else:
            expression = self._characters(element, piece)
        self._emitter.then(f"{name} = {expression}")
        return name

    def _characters(self, element: Primitive, piece: str) -> str:
        if element == BOOLEAN:
            return f"booleans_from({piece})"
        if element == WCHAR:
            return f"wchars_from({piece}, little_endian={self._encoding.little_endian})"
        return f"str({piece}, 'latin-1')"

    def _primitive_array(self, type_: ArrayType, element: Primitive) -> str:
        emitter = self._emitter
        octets = type_.count * element.size
        emitter.align(self._encoding.alignment(element.size))
        if octets > _IN_RUN or type_.numpy:
            emitter.flush()
            flat = self._primitives(type_, element, emitter.position, emitter.position_after(octets))
            emitter.refuse(f"{emitter.position_after(octets)} > len(d)")
            emitter.skip(octets)
        else:
            piece = emitter.item(f"{octets}s", octets)
            flat = self._source.fresh("a")
            emitter.then(f"{flat} = {self._array_piece(element, piece, octets)}")
        if len(type_.dimensions) == 1 or type_.numpy:
            return flat
        return f"nest({flat}, {type_.dimensions})"

    def _array_piece(self, element: Primitive, piece: str, octets: int) -> str:
        if element.is_octet:
            return piece
        if element.is_number:
            swap = needs_swap(little_endian=self._encoding.little_endian)
            return f"number_array('{element.code}', {piece}, 0, {octets}, swap={swap})"
        return self._characters(element, piece)

    def _sequence(self, type_: SequenceType) -> str:
        emitter = self._emitter
        delimiter = self._open_dheader(type_)
        emitter.align(4)
        count = emitter.item("I", 4, "n")
        if type_.bound is not None:
            emitter.refuse(f"{count} > {type_.bound}")
        value = self._elements(type_.element, count)
        self._close_dheader(delimiter)
        return value

    def _array(self, type_: ArrayType) -> str:
        delimiter = self._open_dheader(type_)
        value = self._elements(type_.element, str(type_.count))
        self._close_dheader(delimiter)
        return value if len(type_.dimensions) == 1 else f"nest({value}, {type_.dimensions})"

    def _elements(self, element: IdlType, count: str) -> str:
        emitter, encoding = self._emitter, self._encoding
        emitter.flush()
        value = self._source.fresh("l")
        if isinstance(element, (EnumType, BitmaskType)):
            self._enumeration_elements(element, count, value)
            return value
        emitter.then(f"{value} = []")
        size = static_size(element, emitter.residue, encoding)
        if size is not None and emitter.residue.advance(size) == emitter.residue and self._is_run(element):
            self._elements_by_iter_unpack(element, count, value, size)
            return value
        residue = emitter.residue
        while (behind := residue.meet(after(element, residue, encoding))) != residue:
            residue = behind
        with emitter.loop(f"for _ in range({count}):", residue):
            expression = self.value(element)
            emitter.flush()
            emitter.then(f"{value}.append({expression})")
        return value

    def _enumeration_elements(self, element: EnumType | BitmaskType, count: str, value: str) -> None:
        emitter = self._emitter
        emitter.align(self._encoding.alignment(element.size))
        if isinstance(element, EnumType):
            make = f"{self._enum_table(element)}.__getitem__"
        else:
            make = f"lambda number: bitmask_from({self._source.constant('Flags', element.python_class)}, number)"
        item_format = self._encoding.order + element.code
        residue = emitter.residue.advance_multiple(element.size)
        emitter.then(f"{value} = enumerations(d, {emitter.position}, {count}, '{item_format}', {element.size}, {make})")
        end = self._source.fresh("e")
        emitter.then(f"{end} = {emitter.position} + {count} * {element.size}")
        emitter.move(end, residue)

    def _is_run(self, element: IdlType) -> bool:
        """Whether the element is a struct that is read as one run."""
        if not isinstance(element, StructType) or has_dheader(element, self._encoding):
            return False
        return element.extensibility is not Extensibility.MUTABLE and all(
            isinstance(member.type, (Primitive, EnumType, BitmaskType))
            or (isinstance(member.type, ArrayType) and self._is_small(member.type))
            or self._is_run(member.type)
            for member in element.members
        )

    def _is_small(self, type_: ArrayType) -> bool:
        element = type_.element
        return isinstance(element, Primitive) and type_.count * element.size <= _IN_RUN and not type_.numpy

    def _elements_by_iter_unpack(self, element: IdlType, count: str, value: str, size: int) -> None:
        """All elements by one iterator in C: their layout is the same for each."""
        emitter, source = self._emitter, self._source
        start, residue = emitter.position, emitter.residue
        end = source.fresh("e")
        emitter.then(f"{end} = {start} + {count} * {size}")
        expression = self.value(element)
        codes, names = emitter.take_run()
        leading = size - struct.calcsize(self._encoding.order + codes)  # where elements begin with padding
        codes = f"{leading}x{codes}" if leading else codes
        iterator = source.define("iter_unpack_", f'Struct("{self._encoding.order}{codes}").iter_unpack')
        with source.block(f"for {', '.join(names)}, in {iterator}(d[{start}:{end}]):"):
            emitter.emit_held()
            source.line(f"{value}.append({expression})")
        emitter.move(end, residue)

    # --- structs -----------------------------------------------------------------------------------------

    def _struct(self, type_: StructType) -> str:
        function = self._plan.function(type_)
        if function is None:
            return self._struct_body(type_)
        name, is_new = function
        if is_new:
            with self._source.apart():
                self._write_function(f"read_{name}", type_)
        emitter = self._emitter
        emitter.flush()
        value, position = self._source.fresh("o"), self._source.fresh("p")
        emitter.then(f"{value}, {position} = read_{name}(d, {emitter.position}, {emitter.origin}, {self._depth} + 1)")
        emitter.move(position, UNKNOWN)
        return value

    def _write_function(self, name: str, type_: StructType) -> None:
        outer, outer_depth = self._emitter, self._depth
        emitter = ReadEmitter(self._source, self._encoding, base="p", offset=0, residue=UNKNOWN)
        emitter.origin = "o"
        self._emitter, self._depth = emitter, "depth"
        with self._source.block(f"def {name}(d, p, o, depth):"):
            emitter.refuse(f"depth > {StructType.MAX_DEPTH}")
            value = self._struct_body(type_)
            emitter.flush()
            self._source.line(f"return {value}, {emitter.position}")
        self._emitter, self._depth = outer, outer_depth

    def _struct_body(self, type_: StructType) -> str:
        if not has_dheader(type_, self._encoding):
            return self._struct_members(type_, "")
        emitter = self._emitter
        emitter.align(4)
        size = static_size(type_, emitter.residue, self._encoding)
        length = emitter.item("I", 4, "h")
        start, end = emitter.position, ""
        if size is not None:
            emitter.refuse(f"{length} != {size - 4}")
        else:
            end = f"{length}_end"
            emitter.then(f"{end} = {start} + {length}")
        value = self._struct_members(type_, end)
        if size is None:
            emitter.flush()
            emitter.refuse(f"{emitter.position} != {end}")
        return value

    def _struct_members(self, type_: StructType, end: str) -> str:
        """``end`` is the variable with the index where the delimiter says the struct ends, if it has one."""
        mutable = type_.extensibility is Extensibility.MUTABLE
        values = [(member.name, self._member(member, end, mutable=mutable)) for member in type_.members]
        emitter = self._emitter
        if mutable and not self._encoding.is_xcdr2:
            emitter.align(4)
            sentinel = emitter.item("I", 4, "h")
            number = PID_LIST_END_MUST_UNDERSTAND
            emitter.refuse(f"{sentinel} != {number if self._encoding.little_endian else number << 16}")
        return self._construct(type_, values)

    def _construct(self, type_: StructType, values: list[tuple[str, str]]) -> str:
        """Set the slots one by one: twice as fast as ``__init__``, which only would do the same."""
        emitter, source = self._emitter, self._source
        value = source.fresh("o")
        emitter.then(f"{value} = new({source.constant(type_.python_class.__name__ + '_', type_.python_class)})")
        for name, expression in values:
            emitter.then(f"{value}.{name} = {expression}")
        for member in type_.omitted:
            emitter.then(f"{value}.{member.name} = default_value({source.constant('member', member)})")
            source.names["default_value"] = default_value
        if hasattr(type_.python_class, "__post_init__"):
            emitter.then(f"{value}.__post_init__()")
        return value

    def _member(self, member: Member, end: str, *, mutable: bool) -> str:
        if not member.is_optional:
            return self._parameter(member) if mutable else self.value(member.type)
        if mutable:
            return self._optional_parameter(member, end)
        return self._optional_xcdr2(member) if self._encoding.is_xcdr2 else self._optional_xcdr1(member)

    # --- optional members and parameters -----------------------------------------------------------------

    def _optional_xcdr2(self, member: Member) -> str:
        emitter = self._emitter
        flag = emitter.item("B", 1, "f")
        value = self._source.fresh("x")
        with emitter.branches() as alternatives:
            with alternatives.branch(f"if {flag} == 1:"):
                self._assign(value, self.value(member.type))
            with alternatives.branch("else:"):
                emitter.refuse(flag)
                emitter.then(f"{value} = None")
        return value

    def _optional_xcdr1(self, member: Member) -> str:
        emitter = self._emitter
        length = self._parameter_header(member)
        value = self._source.fresh("x")
        with emitter.branches() as alternatives:
            with alternatives.branch(f"if {length}:"):
                self._assign(value, self._xcdr1_value(member, length, padded=False))
            with alternatives.branch("else:"):
                emitter.then(f"{value} = None")
        return value

    def _optional_parameter(self, member: Member, end: str) -> str:
        """Present if the next header is this member's.  If not, not even the padding before it is there."""
        emitter = self._emitter
        value, aligned = self._source.fresh("x"), self._source.fresh("q")
        emitter.flush()
        emitter.then(f"{aligned} = {emitter.position_after(3)} & -4")
        header = self._header_octets(member)
        condition = f"d[{aligned}:{aligned} + {len(header)}] == {header!r}"
        with emitter.branches() as alternatives:
            with alternatives.branch(f"if {aligned} < {end} and {condition}:" if end else f"if {condition}:"):
                self._assign(value, self._parameter(member))
            with alternatives.branch("else:"):
                emitter.then(f"{value} = None")
        return value

    def _assign(self, name: str, expression: str) -> None:
        self._emitter.then(f"{name} = {expression}")

    def _header_octets(self, member: Member) -> bytes:
        """The header of a parameter without its length."""
        order = self._encoding.order
        if self._encoding.is_xcdr2:
            return struct.pack(f"{order}I", self._emheader(member))
        flagged = member.id | (0x40000000 if member.must_understand else 0)
        return struct.pack(f"{order}HHI", PID_EXTENDED_MUST_UNDERSTAND, 8, flagged)

    def _emheader(self, member: Member) -> int:
        return member.id | emheader_length_code(member.type) << 28 | (0x80000000 if member.must_understand else 0)

    def _parameter(self, member: Member) -> str:
        if not self._encoding.is_xcdr2:
            return self._xcdr1_value(member, self._parameter_header(member), padded=True)
        emitter = self._emitter
        emitter.align(4)
        header = emitter.item("I", 4, "h")
        emitter.refuse(f"{header} != {self._emheader(member):#x}")
        if emheader_length_code(member.type) != 4:
            return self.value(member.type)
        size = static_size(member.type, emitter.residue.advance(4), self._encoding)
        length = emitter.item("I", 4, "h")
        if size is not None:
            emitter.refuse(f"{length} != {size}")
            return self.value(member.type)
        start = emitter.position
        value = self.value(member.type)
        emitter.flush()
        emitter.refuse(f"{emitter.position} != {start} + {length}")
        return value

    def _parameter_header(self, member: Member) -> str:
        """Check the header of XCDR1; return the name of the length."""
        emitter = self._emitter
        emitter.align(4)
        header = emitter.item("8s", 8, "h")
        length = emitter.item("I", 4, "h")
        emitter.refuse(f"{header} != {self._header_octets(member)!r}")
        return length

    def _xcdr1_value(self, member: Member, length: str, *, padded: bool) -> str:
        emitter = self._emitter
        size = static_size(member.type, ALIGNED, self._encoding)
        residue, origin = emitter.residue, emitter.origin
        start = emitter.origin = emitter.position
        emitter.residue = ALIGNED
        value = self.value(member.type)
        if padded:
            emitter.align(4)
        emitter.origin = origin
        if size is not None:
            size += -size % 4 if padded else 0
            emitter.refuse(f"{length} != {size}")
            emitter.residue = residue.advance(size)
            return value
        emitter.flush()
        emitter.refuse(f"{emitter.position} != {start} + {length}")
        emitter.residue = residue.advance_multiple(4) if padded else UNKNOWN
        return value

    def _open_dheader(self, type_: IdlType) -> tuple[str, str] | None:
        if not has_dheader(type_, self._encoding):
            return None
        emitter = self._emitter
        emitter.align(4)
        return emitter.item("I", 4, "h"), emitter.position

    def _close_dheader(self, delimiter: tuple[str, str] | None) -> None:
        if delimiter is not None:
            length, start = delimiter
            self._emitter.flush()
            self._emitter.refuse(f"{self._emitter.position} != {start} + {length}")
