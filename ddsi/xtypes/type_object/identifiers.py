"""TypeIdentifiers: what names a type between programs (DDS-XTypes 1.3 §7.3.4.2 and Annex B).

A primitive, a string, or a collection of such is its own identifier.  All others go by the first 14 octets of the MD5
of their TypeObject, minimal or complete; types that need each other go by the hash of all of them, and an index.
"""

from __future__ import annotations

from ...structure.dataclass import dataclass
from .cursors import ObjectReader, ObjectWriter
from .kinds import COMPLETE, COMPONENT, EITHER, MINIMAL, Collection, MemberFlag, TypeKind, member_flags

__all__ = [
    "HASH_LENGTH",
    "ArrayIdentifier",
    "ComponentIdentifier",
    "HashIdentifier",
    "HashedIdentifier",
    "MapIdentifier",
    "PrimitiveIdentifier",
    "SequenceIdentifier",
    "StringIdentifier",
    "TypeIdentifier",
    "UnknownIdentifier",
    "decode_identifier",
    "encode_identifier",
    "read_identifier",
    "write_identifier",
]

HASH_LENGTH = 14
"""Octets of an EquivalenceHash."""

MAX_DEPTH = 32
"""How deep collections may nest inside one identifier."""

_DISCARD = MemberFlag.TRY_CONSTRUCT_1


class _Identifier:
    """What all kinds have in common."""

    __slots__ = ()

    def hex(self) -> str:
        """The identifier's octets; of one with a hash, the 14 octets of that."""
        return encode_identifier(self).hex()  # type: ignore[arg-type]


@dataclass(frozen=True, slots=True)
class PrimitiveIdentifier(_Identifier):
    """A primitive type, or TK_NONE where there is no type."""

    kind: TypeKind


@dataclass(frozen=True, slots=True)
class StringIdentifier(_Identifier):
    """``bound`` 0: none."""

    bound: int = 0
    wide: bool = False


@dataclass(frozen=True, slots=True)
class SequenceIdentifier(_Identifier):
    """``bound`` 0: none.  ``flags`` are those of the element."""

    element: TypeIdentifier
    bound: int = 0
    flags: MemberFlag = _DISCARD


@dataclass(frozen=True, slots=True)
class ArrayIdentifier(_Identifier):
    """``bounds``: the dimensions, outermost first."""

    element: TypeIdentifier
    bounds: tuple[int, ...]
    flags: MemberFlag = _DISCARD


@dataclass(frozen=True, slots=True)
class MapIdentifier(_Identifier):
    key: TypeIdentifier
    element: TypeIdentifier
    bound: int = 0
    flags: MemberFlag = _DISCARD
    key_flags: MemberFlag = _DISCARD


@dataclass(frozen=True, slots=True)
class HashIdentifier(_Identifier):
    """EquivalenceHash of a TypeObject; ``kind`` is MINIMAL or COMPLETE."""

    kind: int
    hash: bytes

    def hex(self) -> str:
        """The 14 octets of the hash."""
        return self.hash.hex()

    def __repr__(self) -> str:
        return f"<{'minimal' if self.kind == MINIMAL else 'complete'} {self.hex()}>"


@dataclass(frozen=True, slots=True)
class ComponentIdentifier(_Identifier):
    """StronglyConnectedComponentId: the type at ``index`` (from 1) of ``length`` types that need each other."""

    kind: int
    hash: bytes
    length: int
    index: int

    def hex(self) -> str:
        """The 14 octets of the hash, which is that of all types of the component."""
        return self.hash.hex()

    def __repr__(self) -> str:
        kind = "minimal" if self.kind == MINIMAL else "complete"
        return f"<{kind} {self.hex()} {self.index} of {self.length}>"


@dataclass(frozen=True, slots=True)
class UnknownIdentifier(_Identifier):
    """One that a later version of the specification defines; equal to none but itself."""

    discriminator: int


HashedIdentifier = HashIdentifier | ComponentIdentifier
"""What stands for a TypeObject."""

TypeIdentifier = (
    PrimitiveIdentifier
    | StringIdentifier
    | SequenceIdentifier
    | ArrayIdentifier
    | MapIdentifier
    | HashIdentifier
    | ComponentIdentifier
    | UnknownIdentifier
)


def encode_identifier(identifier: TypeIdentifier) -> bytes:
    """The octets of an identifier alone."""
    writer = ObjectWriter()
    write_identifier(writer, identifier)
    return writer.getvalue()


def decode_identifier(octets: bytes, *, little_endian: bool = True) -> TypeIdentifier:
    """The identifier at the beginning of ``octets``.  MalformedMessage where there is none."""
    return read_identifier(ObjectReader(octets, little_endian=little_endian))


# --- out -----------------------------------------------------------------------------------------------------


def write_identifier(writer: ObjectWriter, identifier: TypeIdentifier) -> None:
    match identifier:
        case PrimitiveIdentifier(kind=kind):
            writer.u8(kind)
        case StringIdentifier(bound=bound, wide=wide):
            small = Collection.STRING16_SMALL if wide else Collection.STRING8_SMALL
            _write_discriminator(writer, small, bound)
            _write_bound(writer, bound)
        case SequenceIdentifier(element=element, bound=bound):
            _write_discriminator(writer, Collection.SEQUENCE_SMALL, bound)
            _write_header(writer, identifier.flags, element)
            _write_bound(writer, bound)
            write_identifier(writer, element)
        case ArrayIdentifier(element=element, bounds=bounds):
            is_large = max(bounds, default=0) > 255
            writer.u8(Collection.ARRAY_LARGE if is_large else Collection.ARRAY_SMALL)
            _write_header(writer, identifier.flags, element)
            writer.u32(len(bounds))
            for bound in bounds:
                (writer.u32 if is_large else writer.u8)(bound)
            write_identifier(writer, element)
        case MapIdentifier(key=key, element=element, bound=bound):
            _write_discriminator(writer, Collection.MAP_SMALL, bound)
            _write_header(writer, identifier.flags, key, element)
            _write_bound(writer, bound)
            write_identifier(writer, element)
            writer.u16(identifier.key_flags)
            write_identifier(writer, key)
        case HashIdentifier(kind=kind, hash=hash_):
            writer.u8(kind)
            writer.octets(hash_)
        case ComponentIdentifier():
            writer.u8(COMPONENT)
            with writer.delimited():
                writer.u8(identifier.kind)
                writer.octets(identifier.hash)
                writer.i32(identifier.length)
                writer.i32(identifier.index)
        case UnknownIdentifier(discriminator=discriminator):
            writer.u8(discriminator)
            with writer.delimited():
                pass


def _write_discriminator(writer: ObjectWriter, small: int, bound: int) -> None:
    writer.u8(small + 1 if bound > 255 else small)


def _write_bound(writer: ObjectWriter, bound: int) -> None:
    (writer.u32 if bound > 255 else writer.u8)(bound)


def _write_header(writer: ObjectWriter, flags: MemberFlag, *parts: TypeIdentifier) -> None:
    """PlainCollectionHeader: whether the parts have hashes inside, and of which kind."""
    kinds = [kind for kind in map(_hash_kind, parts) if kind != EITHER]
    writer.u8(kinds[0] if kinds else EITHER)
    writer.u16(flags)


def _hash_kind(identifier: TypeIdentifier) -> int:
    match identifier:
        case HashIdentifier(kind=kind) | ComponentIdentifier(kind=kind):
            return kind
        case SequenceIdentifier(element=element) | ArrayIdentifier(element=element):
            return _hash_kind(element)
        case MapIdentifier(key=key, element=element):
            return min(_hash_kind(key), _hash_kind(element))
        case _:
            return EITHER


# --- in ------------------------------------------------------------------------------------------------------


def read_identifier(reader: ObjectReader, depth: int = 0) -> TypeIdentifier:
    """MalformedMessage for what is none, or nests too deep."""
    if depth > MAX_DEPTH:
        raise reader.malformed(f"collections nest deeper than {MAX_DEPTH}")
    discriminator = reader.u8()
    if discriminator in _PRIMITIVES:
        return PrimitiveIdentifier(TypeKind(discriminator))
    match discriminator:
        case Collection.STRING8_SMALL | Collection.STRING16_SMALL:
            return StringIdentifier(reader.u8(), discriminator == Collection.STRING16_SMALL)
        case Collection.STRING8_LARGE | Collection.STRING16_LARGE:
            return StringIdentifier(reader.u32(), discriminator == Collection.STRING16_LARGE)
        case Collection.SEQUENCE_SMALL | Collection.SEQUENCE_LARGE:
            flags = _read_header(reader)
            bound = reader.u32() if discriminator == Collection.SEQUENCE_LARGE else reader.u8()
            return SequenceIdentifier(read_identifier(reader, depth + 1), bound, flags)
        case Collection.ARRAY_SMALL | Collection.ARRAY_LARGE:
            flags = _read_header(reader)
            is_large = discriminator == Collection.ARRAY_LARGE
            count = reader.count(least_octets=4 if is_large else 1)
            bounds = tuple(reader.u32() if is_large else reader.u8() for _ in range(count))
            return ArrayIdentifier(read_identifier(reader, depth + 1), bounds, flags)
        case Collection.MAP_SMALL | Collection.MAP_LARGE:
            flags = _read_header(reader)
            bound = reader.u32() if discriminator == Collection.MAP_LARGE else reader.u8()
            element = read_identifier(reader, depth + 1)
            key_flags = member_flags(reader.u16())
            return MapIdentifier(read_identifier(reader, depth + 1), element, bound, flags, key_flags)
        case 0xF1 | 0xF2:  # MINIMAL, COMPLETE
            return HashIdentifier(discriminator, bytes(reader.octets(HASH_LENGTH)))
        case 0xB0:  # COMPONENT
            return _read_component(reader)
        case _:
            reader.skip_delimited()
            return UnknownIdentifier(discriminator)


_PRIMITIVES = frozenset(kind.value for kind in TypeKind if kind <= TypeKind.CHAR16)


def _read_header(reader: ObjectReader) -> MemberFlag:
    reader.skip(1)  # the kind of the hashes inside, which these say themselves
    return member_flags(reader.u16())


def _read_component(reader: ObjectReader) -> ComponentIdentifier:
    with reader.delimited():
        kind = reader.u8()
        if kind not in (MINIMAL, COMPLETE):
            raise reader.malformed(f"a component of the kind {kind:#x}")
        hash_ = bytes(reader.octets(HASH_LENGTH))
        length, index = reader.i32(), reader.i32()
        if not 1 <= index <= length:
            raise reader.malformed(f"type {index} of a component of {length}")
    return ComponentIdentifier(kind, hash_, length, index)
