"""TypeInformation: the identifiers of a topic type and of all that it needs (DDS-XTypes 1.3 §7.6.3.2.1, PID 0x0075).

Writers and readers announce it, so that others can tell equal types, or ask for the TypeObjects.  It is XCDR2 without
an encapsulation header, padded to a multiple of 4.
"""

from __future__ import annotations

from ...structure.dataclass import dataclass
from .builder import BuiltTypes
from .cursors import ObjectReader, ObjectWriter
from .identifiers import PrimitiveIdentifier, TypeIdentifier, read_identifier, write_identifier
from .kinds import TypeKind

__all__ = [
    "IdentifiedTypes",
    "SizedIdentifier",
    "TypeInformation",
    "decode_type_information",
    "information_of",
    "read_sized",
    "write_sized",
]

MOST_DEPENDENCIES = 1024
"""How many a peer may list; those beyond are not looked at."""

_MINIMAL_ID, _COMPLETE_ID = 0x1001, 0x1002

_NO_TYPE = PrimitiveIdentifier(TypeKind.NONE)


@dataclass(frozen=True, slots=True)
class SizedIdentifier:
    """TypeIdentifierWithSize: ``size`` is the number of octets of the TypeObject."""

    identifier: TypeIdentifier
    size: int


@dataclass(frozen=True, slots=True)
class IdentifiedTypes:
    """TypeIdentifierWithDependencies.  ``dependency_count`` is -1 where a peer does not say how many there are; the
    list may be shorter than it."""

    type: SizedIdentifier
    dependency_count: int
    dependencies: tuple[SizedIdentifier, ...]


_NOTHING = IdentifiedTypes(SizedIdentifier(_NO_TYPE, 0), -1, ())


@dataclass(frozen=True, slots=True)
class TypeInformation:
    """Both halves; one that a peer left out is that of no type."""

    minimal_types: IdentifiedTypes
    complete_types: IdentifiedTypes

    @property
    def minimal(self) -> TypeIdentifier:
        """The type's identifier without names."""
        return self.minimal_types.type.identifier

    @property
    def complete(self) -> TypeIdentifier:
        """The type's identifier with names."""
        return self.complete_types.type.identifier

    def encode(self) -> bytes:
        """Little endian, a multiple of 4 octets."""
        writer = ObjectWriter()
        with writer.delimited():
            for member_id, types in ((_MINIMAL_ID, self.minimal_types), (_COMPLETE_ID, self.complete_types)):
                writer.u32(4 << 28 | member_id)  # EMHEADER with length code 4: the length follows
                with writer.delimited(), writer.delimited():
                    _write_types(writer, types)
        return writer.getvalue()


def information_of(minimal: BuiltTypes, complete: BuiltTypes) -> TypeInformation:
    """What to announce of a type of this program."""
    return TypeInformation(_identified(minimal), _identified(complete))


def decode_type_information(octets: bytes, *, little_endian: bool = True) -> TypeInformation:
    """What a peer announced.  MalformedMessage for what is none; what a later version adds is skipped."""
    reader = ObjectReader(octets, little_endian=little_endian)
    halves = {_MINIMAL_ID: _NOTHING, _COMPLETE_ID: _NOTHING}
    with reader.delimited():
        while reader.remaining:
            header = reader.u32()
            member_id, length_code = header & 0x0FFFFFFF, header >> 28 & 7
            if member_id in halves and length_code == 4:
                with reader.delimited():
                    halves[member_id] = _read_types(reader)
            elif member_id in halves and length_code == 5:  # the type's DHEADER says the length as well
                halves[member_id] = _read_types(reader)
            else:
                _skip(reader, length_code)
    return TypeInformation(halves[_MINIMAL_ID], halves[_COMPLETE_ID])


# --- out -----------------------------------------------------------------------------------------------------


def _identified(types: BuiltTypes) -> IdentifiedTypes:
    first, *rest = (SizedIdentifier(identifier, len(octets)) for identifier, octets in types.octets.items())
    return IdentifiedTypes(first, len(rest), tuple(rest))


def _write_types(writer: ObjectWriter, types: IdentifiedTypes) -> None:
    write_sized(writer, types.type)
    writer.i32(types.dependency_count)
    with writer.delimited():
        writer.u32(len(types.dependencies))
        for dependency in types.dependencies:
            write_sized(writer, dependency)


def write_sized(writer: ObjectWriter, sized: SizedIdentifier) -> None:
    with writer.delimited():
        write_identifier(writer, sized.identifier)
        writer.u32(sized.size)


# --- in ------------------------------------------------------------------------------------------------------


def _read_types(reader: ObjectReader) -> IdentifiedTypes:
    with reader.delimited():
        type_ = read_sized(reader)
        dependency_count = reader.i32()
        with reader.delimited():
            count = reader.count(least_octets=9)  # DHEADER, an identifier of one octet, the size
            dependencies = tuple(read_sized(reader) for _ in range(min(count, MOST_DEPENDENCIES)))
    return IdentifiedTypes(type_, dependency_count, dependencies)


def read_sized(reader: ObjectReader) -> SizedIdentifier:
    with reader.delimited():
        return SizedIdentifier(read_identifier(reader), reader.u32())


def _skip(reader: ObjectReader, length_code: int) -> None:
    """A member with this code of its length (§7.4.3.4.2)."""
    if length_code < 4:
        reader.skip(1 << length_code)
    else:
        reader.skip(reader.u32() * {4: 1, 5: 1, 6: 4, 7: 8}[length_code])
