"""Read a sample by walking over its type: every valid form, and a precise word on every malformed one.

DDS-XTypes 1.3 §7.4.  Generated deserialisers (``read_source.py``) predict the octets of a writer with the very same
type; whatever they do not expect comes here.  That is malformed octets, and the forms that differ with reason:
samples of a shorter or longer appendable type, parameters in another order or unknown, other header forms and
length codes.  Slower by an order of magnitude, and the reference for what is right; a test holds both to agree.

Every count is checked against the octets that remain before anything is allocated, nesting is bounded, and the
only exception is MalformedSample, with the member's path and the offset in the payload.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, NoReturn

from ..structure.errors import MalformedSample
from .bitsets import bitset_from
from .bounds import trimmed, unbounded
from .buffers import wchars_from
from .defaults import default_cost, default_value, elements_value, zero_cost
from .enumerations import bitmask_from
from .layout import Encoding, encapsulations, first_alignment, has_dheader
from .model import (
    BOOLEAN,
    CHAR,
    WCHAR,
    ArrayType,
    BitmaskType,
    BitsetType,
    Composite,
    EnumType,
    Extensibility,
    IdlType,
    MapType,
    Member,
    Primitive,
    SequenceType,
    String,
    StructType,
    TryConstruct,
    UnionType,
)

__all__ = ["read_carefully"]

PID_EXTENDED = 0x3F01
PID_LIST_END = 0x3F02
PID_IGNORE = 0x3F03

_MOST_DEPTH = 2 * StructType.MAX_DEPTH
"""Counts every struct, where generated code counts the recursive ones only."""

_MOST_DEFAULTED = 1 << 20
"""Default values made for one sample, beyond those of one sample without any members.  Four octets (a delimiter of 0)
may stand for a struct whose defaults fill megabytes, and a payload may hold many of them."""


def read_carefully(type_: StructType, payload: bytes | bytearray | memoryview) -> Any:
    """The sample in a payload that begins with its encapsulation header.  Raises MalformedSample, nothing else."""
    reader = _CarefulReader(type_, payload)
    try:
        return reader.top()
    except RecursionError:
        reader.fail("structs are nested too deep")


class _CarefulReader:
    def __init__(self, type_: StructType, payload: bytes | bytearray | memoryview) -> None:
        self._type = type_
        self._data = payload
        self._path: list[str] = []
        self._position = 4
        self._origin = 4
        self._end = len(payload)
        self._depth = 0
        self._forgiving = 0
        self._is_unfit = False
        self._defaulted = 0
        self._most_defaulted = _MOST_DEFAULTED + min(zero_cost(type_), 64 * _MOST_DEFAULTED)
        if self._end < 4:
            self.fail("no encapsulation header")
        self._encoding = self._encapsulation()
        self._order = self._encoding.order

    def _encapsulation(self) -> Encoding:
        identifier = bytes(self._data[:2])
        encoding = encapsulations(self._type.extensibility).get(identifier)
        if encoding is None:
            fitting = any(identifier in encapsulations(extensibility) for extensibility in Extensibility)
            kind = f"is not that of a type which is {self._type.extensibility.value}" if fitting else "is unknown"
            self.fail(f"the encapsulation {identifier.hex()} {kind}")
        return encoding

    def top(self) -> Any:
        padding = self._data[3] & 3  # the writer says how much it added (XCDR2; others leave 0)
        if padding > self._end - 4:
            self.fail(f"{padding} octets of padding in a payload of {self._end - 4}")
        self._end -= padding
        value = self._struct(self._type, growable=True)
        growable = self._type.extensibility is Extensibility.APPENDABLE and not self._encoding.is_xcdr2
        if self._end - self._position > 3 and not growable:
            self.fail(f"{self._end - self._position} octets too many")
        return value

    def fail(self, reason: str) -> NoReturn:
        path = "".join(self._path).lstrip(".")
        where = f"{path}: " if path else ""
        offset = min(self._position, len(self._data))  # aligning may have gone beyond the end
        message = f"{self._type.type_name}: {where}{reason} (octet {offset})"
        raise MalformedSample(message, path=path, offset=offset)

    def _unfit(self, reason: str) -> None:
        """What was read is no value of its type, but its octets are in order: a member around may have its default."""
        if not self._forgiving:
            self.fail(reason)
        self._is_unfit = True

    # --- octets ------------------------------------------------------------------------------------------

    def _align(self, size: int) -> None:
        alignment = self._encoding.alignment(size)
        self._position += -(self._position - self._origin) % alignment

    def _take(self, octets: int) -> bytes:
        start = self._position
        if octets > self._end - start:
            self.fail(f"{octets} octets are needed, {max(0, self._end - start)} are left")
        self._position = start + octets
        return bytes(self._data[start : start + octets])

    def _number(self, code: str, size: int) -> Any:
        self._align(size)
        return struct.unpack(self._order + code, self._take(size))[0]

    def _uint32(self) -> int:
        number: int = self._number("I", 4)
        return number

    @contextmanager
    def _at(self, step: str) -> Iterator[None]:
        """Errors inside name this member or element; left in place by an error, which ends the reading."""
        self._path.append(step)
        yield
        self._path.pop()

    @contextmanager
    def _delimited(self, octets: int, *, new_origin: bool = False) -> Iterator[None]:
        """What is inside ends after ``octets``; reading goes on there even if less was understood."""
        if octets > self._end - self._position:
            self.fail(f"a length of {octets} octets where {max(0, self._end - self._position)} are left")
        outer_end, outer_origin = self._end, self._origin
        self._end = self._position + octets
        if new_origin:
            self._origin = self._position
        yield
        self._position, self._end, self._origin = self._end, outer_end, outer_origin

    # --- types -------------------------------------------------------------------------------------------

    def _value(self, type_: IdlType, *, growable: bool = False) -> Any:
        match type_:
            case Primitive():
                return self._primitive(type_, self._number(type_.code, type_.size))
            case EnumType():
                return self._literal(type_, self._number(type_.code, type_.size))
            case BitsetType():
                return bitset_from(type_, self._number(type_.code, type_.size))
            case BitmaskType():
                return self._flags(type_, self._number(type_.code, type_.size))
            case String(wide=True):
                return self._wide_string(type_)
            case String():
                return self._string(type_)
            case SequenceType() | ArrayType():
                return self._collection(type_)
            case MapType():
                return self._map(type_)
            case StructType():
                return self._struct(type_, growable=growable)
            case UnionType():
                return self._union(type_)

    def _primitive(self, type_: Primitive, raw: Any) -> Any:
        if type_ == BOOLEAN:
            if raw > 1:
                self.fail(f"a boolean of {raw}")
            return raw == 1
        return chr(raw) if type_ in (CHAR, WCHAR) else raw

    def _literal(self, type_: EnumType, raw: int) -> Any:
        literal = type_.python_class._value2member_map_.get(raw)
        if literal is None:
            self._unfit(f"{raw} is no literal of {type_.type_name}")
            return type_.default
        return literal

    def _flags(self, type_: BitmaskType, raw: int) -> Any:
        """Unknown flags are kept, unless the class refuses them (``enum.STRICT``)."""
        try:
            return bitmask_from(type_.python_class, raw)
        except ValueError:
            self._unfit(f"{raw:#x} has flags that {type_.type_name} does not know")
            return type_.python_class(0)

    def _string(self, type_: String) -> str:
        length = self._uint32()
        if length == 0:
            return ""  # not per specification, but sent by old writers
        octets = self._take(length)
        if octets[-1]:
            self.fail("a string without its terminating NUL")
        if type_.bound is not None and length - 1 > type_.bound:
            self._unfit(f"a string of {length - 1} octets exceeds its bound of {type_.bound}")
        try:
            return octets[:-1].decode()
        except UnicodeDecodeError as error:
            self.fail(f"a string is not UTF-8 ({error.reason})")

    def _wide_string(self, type_: String) -> str:
        """The length counts octets.  (Fast CDR counts units of two octets, which cannot be told apart.)"""
        length = self._uint32()
        if length & 1:
            self.fail(f"a wide string of {length} octets, which is no number of units of two")
        if type_.bound is not None and length > 2 * type_.bound:
            self._unfit(f"a wide string of {length // 2} characters exceeds its bound of {type_.bound}")
        return wchars_from(self._take(length), little_endian=self._encoding.little_endian)

    def _map(self, type_: MapType) -> dict[Any, Any]:
        if not has_dheader(type_, self._encoding):
            return self._entries(type_)
        with self._delimited(self._uint32()):
            value = self._entries(type_)
            if self._end - self._position > 3:
                self.fail(f"{self._end - self._position} octets too many after the entries")
        return value

    def _entries(self, type_: MapType) -> dict[Any, Any]:
        count = self._uint32()
        if type_.bound is not None and count > type_.bound:
            self._unfit(f"{count} entries exceed the bound of {type_.bound}")
        if 2 * count > self._end - self._position:  # a key and a value have an octet each at least
            self.fail(f"{count} entries of {type_} where {max(0, self._end - self._position)} octets are left")
        entries: dict[Any, Any] = {}
        for index in range(count):
            with self._at(f"[{index}]"):
                key = self._value(type_.key)
                if key in entries and not self._is_unfit:
                    self.fail(f"the key {key!r} is there twice")
                entries[key] = self._value(type_.value)
        return entries

    def _collection(self, type_: SequenceType | ArrayType) -> Any:
        if not has_dheader(type_, self._encoding):
            return self._elements(type_)
        with self._delimited(self._uint32()):
            value = self._elements(type_)
            if self._end - self._position > 3:
                self.fail(f"{self._end - self._position} octets too many after the elements")
        return value

    def _elements(self, type_: SequenceType | ArrayType) -> Any:
        if isinstance(type_, ArrayType):
            count = type_.count
        else:
            count = self._uint32()
            if type_.bound is not None and count > type_.bound:
                self._unfit(f"{count} elements exceed the bound of {type_.bound}")
        element = type_.element
        smallest = element.size if isinstance(element, Primitive) else 1
        if count * smallest > self._end - self._position:
            self.fail(f"{count} elements of {element} where {max(0, self._end - self._position)} octets are left")
        if isinstance(element, Primitive):
            return elements_value(type_, self._primitives(element, count))
        elements = []
        for index in range(count):
            with self._at(type_.place(index)):
                elements.append(self._value(element))
        return elements_value(type_, elements)

    def _primitives(self, element: Primitive, count: int) -> list[Any]:
        if count == 0:
            return []
        self._align(element.size)
        octets = self._take(count * element.size)
        numbers = struct.unpack(f"{self._order}{count}{element.code}", octets)
        return list(numbers) if element.is_number else [self._primitive(element, number) for number in numbers]

    # --- structs -----------------------------------------------------------------------------------------

    def _struct(self, type_: StructType, *, growable: bool) -> Any:
        """``growable``: in XCDR1, whether the octets that hold the struct end with it."""
        self._depth += 1
        if self._depth > _MOST_DEPTH:
            self.fail("structs are nested too deep")
        if has_dheader(type_, self._encoding):
            with self._delimited(self._uint32()):
                values = self._struct_values(type_, growable=True)
        else:
            values = self._struct_values(type_, growable=growable)
        self._depth -= 1
        return self._construct(type_, values)

    def _struct_values(self, type_: StructType, *, growable: bool) -> dict[str, Any]:
        if type_.extensibility is Extensibility.MUTABLE:
            values = self._emheader_members(type_) if self._encoding.is_xcdr2 else self._parameter_list(type_)
            for member in type_.members:
                if member.is_key and member.name not in values:
                    self.fail(f"the key member {member.name} is missing")
            return values
        growable = growable and type_.extensibility is Extensibility.APPENDABLE
        values = {}
        for member in type_.members:
            if growable and self._is_at_end(member):
                break
            with self._at(f".{member.name}"):
                values[member.name] = self._plain_member(member)
        return values

    def _union(self, type_: UnionType) -> Any:
        self._depth += 1
        if self._depth > _MOST_DEPTH:
            self.fail("structs are nested too deep")
        if has_dheader(type_, self._encoding):
            with self._delimited(self._uint32()):
                value = self._union_value(type_)
        else:
            value = self._union_value(type_)
        self._depth -= 1
        return value

    def _union_value(self, type_: UnionType) -> Any:
        """A discriminator without its member is refused: nothing says what the member would be."""
        name = type_.discriminator.name
        values: dict[str, Any] = {}
        if type_.extensibility is Extensibility.MUTABLE:
            values = self._emheader_members(type_) if self._encoding.is_xcdr2 else self._parameter_list(type_)
            if name not in values:
                self.fail("a union without its discriminator")
        else:
            with self._at(f".{name}"):
                values[name] = self._value(type_.discriminator.type)
        case = type_.case_of(values[name])
        if case is not None and case.name not in values:
            if type_.extensibility is Extensibility.MUTABLE:
                self.fail(f"a union without the member {case.name}, which its discriminator selects")
            with self._at(f".{case.name}"):
                values[case.name] = self._member(case)
        union = object.__new__(type_.python_class)
        union._idl_discriminator = values[name]
        union._idl_value = None if case is None else values[case.name]
        return union

    def _is_at_end(self, member: Member) -> bool:
        """Nothing is left where the member would begin.

        Alignment counts: in XCDR1 up to 3 octets may be padding of which no header told.  An optional member begins
        with a flag of one octet, or in XCDR1 with a header.
        """
        if member.is_optional:
            alignment = 1 if self._encoding.is_xcdr2 else 4
        else:
            alignment = self._encoding.alignment(first_alignment(member.type))
        return self._position + -(self._position - self._origin) % alignment >= self._end

    def _construct(self, type_: StructType, values: dict[str, Any]) -> Any:
        value = object.__new__(type_.python_class)
        for member in type_.declared:
            setattr(value, member.name, values[member.name] if member.name in values else self._default(member))
        if hasattr(value, "__post_init__"):
            try:
                value.__post_init__()
            except Exception as error:
                self.fail(f"{type_.python_class.__name__}.__post_init__ refused the sample: {error}")
        return value

    def _default(self, member: Member) -> Any:
        """The default of a member that the sample leaves out, if the sum of all these is within bounds."""
        self._defaulted += default_cost(member)
        if self._defaulted > self._most_defaulted:
            self.fail(f"too much is left out: {member.name} and others would need {self._defaulted} default values")
        return default_value(member)

    def _member(self, member: Member, *, growable: bool = False) -> Any:
        """The member's value; what it cannot hold is trimmed or becomes its default, if it says so."""
        match member.try_construct:
            case TryConstruct.DISCARD:
                return self._value(member.type, growable=growable)
            case TryConstruct.TRIM:
                return trimmed(member.type, self._value(unbounded(member.type), growable=growable))
            case TryConstruct.USE_DEFAULT:
                was_unfit, self._is_unfit = self._is_unfit, False
                self._forgiving += 1
                value = self._value(member.type, growable=growable)
                self._forgiving -= 1
                is_unfit, self._is_unfit = self._is_unfit, was_unfit
                return self._default(member) if is_unfit else value

    def _plain_member(self, member: Member) -> Any:
        if not member.is_optional:
            return self._member(member)
        if self._encoding.is_xcdr2:
            return self._member(member) if self._primitive(BOOLEAN, self._number("B", 1)) else None
        identifier, _, length = self._parameter_header()
        if identifier != member.id:
            self.fail(f"the header of member id {identifier} where {member.id} is due")
        if length == 0:
            return None
        with self._delimited(length, new_origin=True):
            return self._member(member, growable=True)

    # --- mutable types -----------------------------------------------------------------------------------

    def _parameter_list(self, type_: Composite) -> dict[str, Any]:
        """XCDR1: parameters up to PID_LIST_END (§7.4.1.2)."""
        members = {member.id: member for member in type_.members}
        values: dict[str, Any] = {}
        while True:
            identifier, must_understand, length = self._parameter_header()
            if identifier == -PID_LIST_END:
                return values
            with self._delimited(length, new_origin=True):
                self._identified_member(members, values, identifier, must_understand=must_understand)
            self._position = min(self._position + -length % 4, self._end)

    def _parameter_header(self) -> tuple[int, bool, int]:
        """(member id, must understand, length); the id is negative for what is no member."""
        self._align(4)
        first, length = struct.unpack(f"{self._order}HH", self._take(4))
        identifier, must_understand = first & 0x3FFF, bool(first & 0x4000)
        if identifier == PID_EXTENDED:
            if length != 8:
                self.fail(f"an extended parameter header of {length} octets instead of 8")
            flagged, length = struct.unpack(f"{self._order}II", self._take(8))
            return flagged & 0x0FFFFFFF, bool(flagged & 0x40000000), length
        if identifier in (PID_LIST_END, PID_IGNORE):
            return -identifier, False, length if identifier == PID_IGNORE else 0
        return identifier, must_understand, length

    def _emheader_members(self, type_: Composite) -> dict[str, Any]:
        """XCDR2: members with EMHEADER up to the end that the delimiter gave (§7.4.3.4.2)."""
        members = {member.id: member for member in type_.members}
        values: dict[str, Any] = {}
        while self._position + -(self._position - self._origin) % 4 < self._end:
            header = self._uint32()
            length = self._member_length(header >> 28 & 7)
            with self._delimited(length):
                must_understand = bool(header & 0x80000000)
                self._identified_member(members, values, header & 0x0FFFFFFF, must_understand=must_understand)
        return values

    def _member_length(self, length_code: int) -> int:
        if length_code < 4:
            return 1 << length_code
        number = self._uint32()
        if length_code == 4:
            return number
        self._position -= 4  # the number is part of the value
        return 4 + number * {5: 1, 6: 4, 7: 8}[length_code]

    def _identified_member(
        self, members: dict[int, Member], values: dict[str, Any], identifier: int, *, must_understand: bool
    ) -> None:
        member = members.get(identifier)
        if member is None:
            if must_understand:
                self.fail(f"member id {identifier:#x} is unknown here, and must be understood")
            return
        if member.name in values:
            self.fail(f"member {member.name} is there twice")
        with self._at(f".{member.name}"):
            values[member.name] = self._member(member, growable=True)
            growable = isinstance(member.type, StructType) and not self._encoding.is_xcdr2
            if self._end - self._position > 3 and not growable:
                self.fail(f"{self._end - self._position} octets too many")
