"""Elements of one layout, one behind the other: a sequence of such structs is a loop without alignment.

DDS-XTypes 1.3 §7.4.1.1.  After the first element has been aligned, each begins as many octets behind the one before,
whatever lies in front of the sequence.  The code generators ask here whether that is so.
"""

from __future__ import annotations

from ..structure.dataclass import dataclass
from .layout import ALIGNED, Encoding, Residue, has_dheader, static_size
from .model import ArrayType, BitmaskType, BitsetType, EnumType, Extensibility, IdlType, Primitive, StructType

__all__ = ["Stride", "stride"]

_LARGEST = 256
"""The most octets of an element that is one run."""


@dataclass(frozen=True, slots=True)
class Stride:
    """How elements lie: ``size`` octets each, and ``gap`` octets of padding between two of them.

    ``alignment`` is that of the first item, ``residue`` what is known of the first element's position.
    """

    alignment: int
    residue: Residue
    size: int
    gap: int

    @property
    def octets(self) -> int:
        """From the start of an element to the start of the next."""
        return self.size + self.gap

    def behind(self, start: Residue, count: str) -> Residue:
        """What is known of the position behind ``count`` elements (a number, or a name) of a sequence at ``start``."""
        behind = self.residue.advance(self.size)
        return behind if count.isdecimal() else start.meet(behind)


def stride(element: IdlType, start: Residue, encoding: Encoding) -> Stride | None:
    """The stride of elements behind ``start``; None unless each is one run of items, laid out as the others."""
    if not isinstance(element, StructType):
        return None
    size = static_size(element, ALIGNED, encoding)
    if size is None or size > _LARGEST or not _is_run(element):
        return None
    alignment = _first_alignment(element, encoding)
    known = start.align(alignment)
    for modulus in (8, 4, 2, 1):  # elements of 12 octets are alike modulo 4, and not modulo 8
        if alignment <= modulus <= known.modulus:
            first = Residue(modulus, known.rest % modulus)
            size = static_size(element, first, encoding)
            if size is None:
                return None
            gap = -(first.rest + size) % alignment
            if first.advance(size + gap) == first:
                return Stride(alignment, first, size, gap)
    return None


def _is_run(struct: StructType) -> bool:
    """Whether its members, and theirs, are items of fixed size, or arrays of them."""
    return bool(struct.members) and all(
        isinstance(member.type, (Primitive, EnumType, BitmaskType, BitsetType))
        or (isinstance(member.type, ArrayType) and _is_small(member.type))
        or (isinstance(member.type, StructType) and _is_run(member.type))
        for member in struct.members
    )


def _is_small(array: ArrayType) -> bool:
    element = array.element
    return isinstance(element, Primitive) and array.count * element.size <= _LARGEST and not array.numpy


def _first_alignment(struct: StructType, encoding: Encoding) -> int:
    if has_dheader(struct, encoding) or struct.extensibility is Extensibility.MUTABLE:
        return 4
    first = struct.members[0].type
    if isinstance(first, ArrayType):
        first = first.element
    if isinstance(first, StructType):
        return _first_alignment(first, encoding)
    assert isinstance(first, (Primitive, EnumType, BitmaskType, BitsetType))
    return encoding.alignment(first.size)
