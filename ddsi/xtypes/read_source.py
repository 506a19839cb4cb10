"""Generate the deserialiser of a type: Python source, specialised for one encoding.

DDS-XTypes 1.3 §7.4.  The generated function predicts: it reads what a writer of the very same type writes, members
in order, delimiters as computed, and raises (whatever comes: IndexError, struct.error, KeyError, ValueError) as soon
as the octets differ.  Its caller then reads again with ``careful_reader.py``, which knows every other valid form
and says where octets are malformed.  The prediction is safe by itself: no count is trusted before the octets
it speaks of are there, recursion is bounded, and time is linear in the payload.

Here are structs, unions and their members; ``read_values.py`` has the rest.
"""

from __future__ import annotations

import struct
from array import array
from collections.abc import Callable
from typing import Any

from . import buffers
from .bitsets import bitset_from
from .defaults import default_value
from .enumerations import bitmask_from
from .layout import ALIGNED, UNKNOWN, Encoding, emheader_length_code, has_dheader, static_size
from .model import Composite, Extensibility, Member, StructType, UnionType
from .read_emitter import ReadEmitter
from .read_values import ValueReader, enumerations
from .recursion import FunctionPlan
from .source import Source
from .write_source import PID_EXTENDED_MUST_UNDERSTAND, PID_LIST_END_MUST_UNDERSTAND

__all__ = ["generate_reader"]


def generate_reader(
    struct_type: StructType, encoding: Encoding, *, view: bool = False
) -> tuple[Callable[[Any], Any], str]:
    """(function of a payload that returns the sample, the function's source).

    The payload begins with its encapsulation header, which the caller has looked at.  It is ``bytes``; with
    ``view``, a ``memoryview`` (slower for small samples, spares large ones a copy).
    """
    source = Source(f"read {struct_type.type_name}, {encoding.name}{', memoryview' if view else ''}")
    source.names |= {
        "array": array,
        "new": object.__new__,
        "number_array": buffers.number_array,
        "booleans_from": buffers.booleans_from,
        "wchars_from": buffers.wchars_from,
        "nest": buffers.nest,
        "enumerations": enumerations,
        "bitmask_from": bitmask_from,
        "bitset_from": bitset_from,
    }
    reader = _TypeReader(source, encoding, FunctionPlan(struct_type), view=view)
    with source.block("def read(d):"):
        reader.top(struct_type)
    return source.compile("read"), source.text


class _TypeReader(ValueReader):
    """Reads structs and unions."""

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

    # --- structs -----------------------------------------------------------------------------------------

    def _struct(self, type_: StructType) -> str:
        return self._composite(type_)

    def _union(self, type_: UnionType) -> str:
        return self._composite(type_)

    def _composite(self, type_: Composite) -> str:
        function = self._plan.function(type_)
        if function is None:
            with self._plan.inside():
                return self._composite_body(type_)
        name, is_new = function
        if is_new:
            with self._source.apart(), self._plan.inside(0):
                self._write_function(f"read_{name}", type_)
        emitter = self._emitter
        emitter.flush()
        value, position = self._source.fresh("o"), self._source.fresh("p")
        emitter.then(f"{value}, {position} = read_{name}(d, {emitter.position}, {emitter.origin}, {self._depth} + 1)")
        emitter.move(position, UNKNOWN)
        return value

    def _write_function(self, name: str, type_: Composite) -> None:
        outer, outer_depth = self._emitter, self._depth
        emitter = ReadEmitter(self._source, self._encoding, base="p", offset=0, residue=UNKNOWN)
        emitter.origin = "o"
        self._emitter, self._depth = emitter, "depth"
        with self._source.block(f"def {name}(d, p, o, depth):"):
            emitter.refuse(f"depth > {StructType.MAX_DEPTH}")
            value = self._composite_body(type_)
            emitter.flush()
            self._source.line(f"return {value}, {emitter.position}")
        self._emitter, self._depth = outer, outer_depth

    def _composite_body(self, type_: Composite) -> str:
        if not has_dheader(type_, self._encoding):
            return self._composite_members(type_, "")
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
        value = self._composite_members(type_, end)
        if size is None:
            emitter.flush()
            emitter.refuse(f"{emitter.position} != {end}")
        return value

    def _composite_members(self, type_: Composite, end: str) -> str:
        return self._struct_members(type_, end) if isinstance(type_, StructType) else self._union_members(type_)

    def _struct_members(self, type_: StructType, end: str) -> str:
        """``end`` is the variable with the index where the delimiter says the struct ends, if it has one."""
        mutable = type_.extensibility is Extensibility.MUTABLE
        values = [(member.name, self._member(member, end, mutable=mutable)) for member in type_.members]
        if mutable:
            self._end_parameters()
        return self._construct(type_, values)

    def _end_parameters(self) -> None:
        if not self._encoding.is_xcdr2:
            self._emitter.align(4)
            sentinel = self._emitter.item("I", 4, "h")
            number = PID_LIST_END_MUST_UNDERSTAND
            self._emitter.refuse(f"{sentinel} != {number if self._encoding.little_endian else number << 16}")

    def _union_members(self, type_: UnionType) -> str:
        """The discriminator, then the member that it selects, if any."""
        emitter, source = self._emitter, self._source
        mutable = type_.extensibility is Extensibility.MUTABLE
        expression = self._parameter(type_.discriminator) if mutable else self.value(type_.discriminator.type)
        emitter.flush()
        discriminator, index, value = source.fresh("d"), source.fresh("k"), source.fresh("x")
        emitter.then(f"{discriminator} = {expression}")
        selection = source.constant("selection", type_.selection)
        emitter.then(f"{index} = {selection}.get({discriminator}, {type_.default_index})")
        with emitter.branches() as alternatives:
            for number, case in enumerate(type_.cases):
                with alternatives.branch(f"{'elif' if number else 'if'} {index} == {number}:"):
                    self._assign(value, self._parameter(case) if mutable else self.value(case.type))
            with alternatives.branch("else:" if type_.cases else f"if {index} < 0:"):
                self._assign(value, "None")
        if mutable:
            self._end_parameters()
        union = source.fresh("o")
        emitter.then(f"{union} = new({source.constant(type_.python_class.__name__ + '_', type_.python_class)})")
        emitter.then(f"{union}._idl_discriminator = {discriminator}")
        emitter.then(f"{union}._idl_value = {value}")
        return union

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
