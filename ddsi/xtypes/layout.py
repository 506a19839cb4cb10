"""Where values lie: encodings, alignment as far as it is known beforehand, sizes.

DDS-XTypes 1.3 §7.4.1-7.4.3.  The code generators ask here what they can decide once per type: after a run of
fixed-size members the position is known, after a string only its residue may be.  That knowledge is a
:class:`Residue`; where it fails, the generated code aligns when it runs.
"""

from __future__ import annotations

import math

from ..structure.dataclass import dataclass
from ..structure.qos_policies import DataRepresentationId
from .model import (
    ArrayType,
    BitmaskType,
    BitsetType,
    EnumType,
    Extensibility,
    IdlType,
    MapType,
    Member,
    Primitive,
    SequenceType,
    String,
    StructType,
    UnionType,
)

__all__ = [
    "ALIGNED",
    "UNKNOWN",
    "Encoding",
    "Residue",
    "after",
    "encapsulations",
    "first_alignment",
    "has_dheader",
    "largest_size",
    "static_size",
]


@dataclass(frozen=True, slots=True)
class Encoding:
    """XCDR version and byte order.  The extensibility of the top-level type completes it to an encapsulation."""

    representation: DataRepresentationId
    little_endian: bool

    @property
    def is_xcdr2(self) -> bool:
        return self.representation is DataRepresentationId.XCDR2

    @property
    def order(self) -> str:
        """The byte order's mark in :mod:`struct`; explicit, so that struct adds no padding of its own."""
        return "<" if self.little_endian else ">"

    @property
    def name(self) -> str:
        return f"{self.representation.name} {'little' if self.little_endian else 'big'} endian"

    def alignment(self, size: int) -> int:
        """DDS-XTypes 1.3 §7.4.1.1.1: a primitive aligns to its size, in XCDR2 to 4 at most."""
        return min(size, 4) if self.is_xcdr2 else size

    def encapsulation_id(self, extensibility: Extensibility) -> bytes:
        """The two octets that open the payload (xtypes §7.6.3.1.2; RTPS 2.5 §10.2)."""
        if self.is_xcdr2:
            number = {Extensibility.FINAL: 6, Extensibility.APPENDABLE: 8, Extensibility.MUTABLE: 10}[extensibility]
        else:
            number = 2 if extensibility is Extensibility.MUTABLE else 0
        return bytes((0, number + self.little_endian))


def encapsulations(extensibility: Extensibility) -> dict[bytes, Encoding]:
    """Every encapsulation in which a type of this extensibility may arrive."""
    encodings = [
        Encoding(representation, little_endian)
        for representation in (DataRepresentationId.XCDR1, DataRepresentationId.XCDR2)
        for little_endian in (True, False)
    ]
    return {encoding.encapsulation_id(extensibility): encoding for encoding in encodings}


@dataclass(frozen=True, slots=True)
class Residue:
    """What is known of a position: it is ``rest`` modulo ``modulus`` (1, 2, 4 or 8)."""

    modulus: int
    rest: int

    def padding(self, alignment: int) -> int | None:
        """Octets to the next multiple of ``alignment``; None where that cannot be known."""
        return -self.rest % alignment if self.modulus % alignment == 0 else None

    def advance(self, octets: int) -> Residue:
        return Residue(self.modulus, (self.rest + octets) % self.modulus)

    def align(self, alignment: int) -> Residue:
        padding = self.padding(alignment)
        return Residue(alignment, 0) if padding is None else self.advance(padding)

    def advance_multiple(self, size: int) -> Residue:
        """After an unknown number of items of ``size`` octets."""
        return self.meet(self.advance(size))

    def meet(self, other: Residue) -> Residue:
        """What holds of a position that is either this or ``other``."""
        modulus = math.gcd(self.modulus, other.modulus, self.rest - other.rest)
        return Residue(modulus, self.rest % modulus)


ALIGNED = Residue(8, 0)
"""The start of a payload's body, or of a parameter of XCDR1."""

UNKNOWN = Residue(1, 0)

Scalar = Primitive | EnumType | BitmaskType
"""What is one item of :mod:`struct`."""


def has_dheader(type_: IdlType, encoding: Encoding) -> bool:
    """Whether a delimiter (uint32: octets that follow) precedes the value (DDS-XTypes 1.3 §7.4.3.5).

    Enums and bitmasks are no primitive types here, as measured with Cyclone DDS.
    """
    if not encoding.is_xcdr2:
        return False
    match type_:
        case SequenceType() | ArrayType():
            return not isinstance(type_.element, Primitive)
        case MapType():
            return not (isinstance(type_.key, Primitive) and isinstance(type_.value, Primitive))
        case StructType() | UnionType():
            return type_.extensibility is not Extensibility.FINAL
        case _:
            return False


def first_alignment(type_: IdlType) -> int:
    """What the first item of a value aligns to, before the encoding's maximum."""
    match type_:
        case Primitive() | EnumType() | BitmaskType() | BitsetType():
            return type_.size
        case ArrayType():
            return first_alignment(type_.element)
        case StructType(extensibility=Extensibility.FINAL):
            return first_alignment(type_.members[0].type) if type_.members else 1
        case UnionType(extensibility=Extensibility.FINAL):
            return first_alignment(type_.discriminator.type)
        case _:
            return 4


def static_size(type_: IdlType, start: Residue, encoding: Encoding) -> int | None:
    """Octets of any value that begins at ``start`` (leading padding included); None if that depends on the value."""
    match type_:
        case Primitive() | EnumType() | BitmaskType() | BitsetType():
            padding = start.padding(encoding.alignment(type_.size))
            return None if padding is None else padding + type_.size
        case ArrayType():
            return _static_array_size(type_, start, encoding)
        case StructType():
            known = type_.static_sizes
            if (start, encoding) not in known:  # else types that multiply by nesting would take exponential time
                known[start, encoding] = _static_struct_size(type_, start, encoding)
            return known[start, encoding]
        case _:
            return None


def _static_array_size(array: ArrayType, start: Residue, encoding: Encoding) -> int | None:
    if has_dheader(array, encoding):
        padding = start.padding(4)
        if padding is None:
            return None
        size = padding + 4
    else:
        size = 0
    if array.count > 4096 and not isinstance(array.element, Primitive):
        return None  # not worth a closed form
    if isinstance(array.element, Primitive):
        first = static_size(array.element, start.advance(size), encoding)
        return None if first is None else size + first + (array.count - 1) * array.element.size
    for _ in range(array.count):
        element = static_size(array.element, start.advance(size), encoding)
        if element is None:
            return None
        size += element
    return size


def _static_struct_size(struct: StructType, start: Residue, encoding: Encoding) -> int | None:
    if any(member.is_optional for member in struct.members):
        return None
    mutable = struct.extensibility is Extensibility.MUTABLE
    size = 0
    if has_dheader(struct, encoding):
        padding = start.padding(4)
        if padding is None:
            return None
        size = padding + 4
    for member in struct.members:
        if mutable:
            octets = _static_parameter_size(member, start.advance(size), encoding)
        else:
            octets = static_size(member.type, start.advance(size), encoding)
        if octets is None:
            return None
        size += octets
    if mutable and not encoding.is_xcdr2:
        padding = start.advance(size).padding(4)
        return None if padding is None else size + padding + 4
    return size


def _static_parameter_size(member: Member, start: Residue, encoding: Encoding) -> int | None:
    padding = start.padding(4)
    if padding is None:
        return None
    if not encoding.is_xcdr2:
        value = static_size(member.type, ALIGNED, encoding)
        return None if value is None else padding + 12 + value + -value % 4
    header = 8 if emheader_length_code(member.type) == 4 else 4
    value = static_size(member.type, start.advance(padding + header), encoding)
    return None if value is None else padding + header + value


def emheader_length_code(type_: IdlType) -> int:
    """LC of a member in a mutable type, chosen as Cyclone DDS does (DDS-XTypes 1.3 §7.4.3.4.2).

    0..3: 1, 2, 4, 8 octets; 4: a length follows; 5, 6, 7: the value's own first uint32 is the length, counting
    units of 1, 4 or 8 octets.
    """
    match type_:
        case Primitive() | EnumType() | BitmaskType() | BitsetType():
            return {1: 0, 2: 1, 4: 2, 8: 3}[type_.size]
        case String():
            return 5
        case SequenceType(element=Primitive(size=size)):
            return {1: 5, 2: 4, 4: 6, 8: 7}[size]
        case SequenceType():
            return 5
        case ArrayType():
            return 4 if isinstance(type_.element, Primitive) else 5
        case StructType() | UnionType():
            return 4
        case MapType():
            # A delimiter serves as the length.  Without one the value begins with a count of entries, which does not.
            primitive = isinstance(type_.key, Primitive) and isinstance(type_.value, Primitive)
            return 4 if primitive else 5


def after(type_: IdlType, start: Residue, encoding: Encoding) -> Residue:
    """What is known of the position behind a value that begins at ``start``."""
    size = static_size(type_, start, encoding)
    if size is not None:
        return start.advance(size)
    match type_:
        case Primitive() | EnumType() | BitmaskType() | BitsetType():
            return start.align(encoding.alignment(type_.size)).advance(type_.size)
        case SequenceType(element=Primitive(size=size)) if size >= 4:
            # The count is aligned; elements of 8 octets are aligned by padding that is there only with elements.
            return start.align(4).advance_multiple(4)
        case StructType(extensibility=Extensibility.MUTABLE) if not encoding.is_xcdr2:
            return Residue(4, 0)  # the end of a parameter list is a parameter
        case StructType(members=(*_, last)) if (
            not last.is_optional and type_.extensibility is not Extensibility.MUTABLE
        ):
            return after(last.type, UNKNOWN, encoding)  # the rest of it may be worth nothing
        case _:
            return UNKNOWN


def largest_size(type_: IdlType, start: int, encoding: Encoding, *, limit: int) -> float:
    """The position behind the largest possible value that begins at ``start``, as final types without headers.

    ``math.inf`` as soon as it exceeds ``limit``.  Sizes grow monotonously with what comes before them, so
    filling each string and sequence to its bound gives the largest.
    """
    match type_:
        case Primitive() | EnumType() | BitmaskType() | BitsetType():
            alignment = encoding.alignment(type_.size)
            end: float = start + -start % alignment + type_.size
        case String(bound=bound, wide=wide):
            end = math.inf if bound is None else start + -start % 4 + 4 + (2 * bound if wide else bound + 1)
        case SequenceType(bound=bound):
            start += -start % 4 + 4
            end = math.inf if bound is None else _largest_elements(type_, bound, start, encoding, limit=limit)
        case ArrayType():
            end = _largest_elements(type_, type_.count, start, encoding, limit=limit)
        case StructType():
            end = start
            for member in type_.members:
                if end <= limit:
                    end = largest_size(member.type, int(end), encoding, limit=limit)
        case UnionType():
            end = largest_size(type_.discriminator.type, start, encoding, limit=limit)
            if end <= limit:
                start = int(end)
                sizes = [largest_size(case.type, start, encoding, limit=limit) for case in type_.cases]
                end = max([end, *sizes])
        case MapType():
            end = math.inf  # no key hash has one
    return end if end <= limit else math.inf


def _largest_elements(
    type_: SequenceType | ArrayType, count: int, start: int, encoding: Encoding, *, limit: int
) -> float:
    end: float = start + (-start % 4 + 4 if has_dheader(type_, encoding) else 0)
    for _ in range(count):  # each element has an octet at least, so this ends with the limit
        if end > limit:
            break
        end = largest_size(type_.element, int(end), encoding, limit=limit)
    return end
