"""Numbers as annotations of TypeObjects have them: AnnotationParameterValue (DDS-XTypes 1.3 Annex B).

Written are the kinds that constants have in IDL where no more is said, as Cyclone DDS does; read is any number.
"""

from __future__ import annotations

import struct

from .cursors import ObjectReader, ObjectWriter
from .kinds import TypeKind

__all__ = ["read_number", "write_number"]

_CODES = {
    TypeKind.BYTE: "B",
    TypeKind.INT8: "b",
    TypeKind.UINT8: "B",
    TypeKind.INT16: "h",
    TypeKind.UINT16: "H",
    TypeKind.INT32: "i",
    TypeKind.UINT32: "I",
    TypeKind.INT64: "q",
    TypeKind.UINT64: "Q",
    TypeKind.FLOAT32: "f",
    TypeKind.FLOAT64: "d",
}


def write_number(writer: ObjectWriter, number: float) -> None:
    kind = _kind(number)
    writer.u8(kind)
    writer.align(4)
    writer.octets(struct.pack(f"<{_CODES[kind]}", number))


def read_number(reader: ObjectReader) -> float | None:
    """None for what is no number, of which the end is not known either."""
    kind = reader.u8()
    code = _CODES.get(TypeKind(kind)) if kind in _KINDS else None
    if code is None:
        return None
    size = struct.calcsize(f"<{code}")
    reader.align(min(size, 4))
    number: float = struct.unpack(f"{'<' if reader.little_endian else '>'}{code}", reader.octets(size))[0]
    return number


_KINDS = frozenset(TypeKind)


def _kind(number: float) -> TypeKind:
    if isinstance(number, float):
        return TypeKind.FLOAT64
    if -(1 << 31) <= number < 1 << 31:
        return TypeKind.INT32
    return TypeKind.INT64 if number < 1 << 63 else TypeKind.UINT64
