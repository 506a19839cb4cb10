"""The messages of the builtin TypeLookup service: what types are made of, asked and answered.

DDS-XTypes 1.3 §7.6.3.3.4.  A request names types by their identifiers and is answered with TypeObjects, or with the
identifiers of all types that they need; the answer repeats the request's writer and number, as all participants may
hear it.  Both are final types in XCDR2, as Cyclone DDS, Fast DDS 3 and OpenDDS send them::

    request:  GUID of the request's writer | number | name of the service instance
              DHEADER | which operation | DHEADER | EMHEADER type_ids | ...
    reply:    GUID of the request's writer | number | remote exception
              DHEADER | which operation | DHEADER | return code | DHEADER | EMHEADER types | ...

The decoders take whatever comes from the network, in time and memory linear in its octets, and raise MalformedMessage
and nothing else.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TypeVar

from ..serialization.cursor import Octets
from ..serialization.encapsulation import HEADER_LENGTH, Encapsulation, decode_encapsulation, encode_encapsulation
from ..structure.dataclass import dataclass
from ..structure.guid import Guid
from ..xtypes.type_object.cursors import ObjectReader, ObjectWriter
from ..xtypes.type_object.decoding import read_type_object
from ..xtypes.type_object.encoding import encode_type_object
from ..xtypes.type_object.identifiers import TypeIdentifier, read_identifier, write_identifier
from ..xtypes.type_object.information import SizedIdentifier, read_sized, write_sized

__all__ = [
    "LONGEST_CONTINUATION",
    "FoundDependencies",
    "FoundTypes",
    "GetDependencies",
    "GetTypes",
    "RequestId",
    "TypeLookupReply",
    "TypeLookupRequest",
    "decode_reply",
    "decode_request",
    "encode_reply",
    "encode_request",
    "instance_name",
]

LONGEST_CONTINUATION = 32
"""Octets of a continuation point: where a list of dependencies goes on, for the server alone to understand."""

# Operations and members go by hashes of their names; the specification gives those of the operations as constants.
_GET_TYPES, _GET_DEPENDENCIES = 0x018252D3, 0x05AAFB31
_TYPE_IDS, _CONTINUATION_POINT = 0x0C536065, 0x0508E3D2
_TYPES, _COMPLETE_TO_MINIMAL, _DEPENDENT_TYPEIDS = 0x02804AD1, 0x0B8E6577, 0x0BA4DFC9
_OK = 0
_LONGEST_NAME = 255

_T = TypeVar("_T")

RequestId = tuple[Guid, int]
"""SampleIdentity: the writer of a request, and its sequence number."""


@dataclass(frozen=True, slots=True)
class GetTypes:
    """getTypes: the TypeObjects of these identifiers."""

    type_ids: tuple[TypeIdentifier, ...]


@dataclass(frozen=True, slots=True)
class GetDependencies:
    """getTypeDependencies: what the types of these identifiers need; the rest of a list that came in part before."""

    type_ids: tuple[TypeIdentifier, ...]
    continuation_point: bytes = b""


@dataclass(frozen=True, slots=True)
class TypeLookupRequest:
    request_id: RequestId
    instance_name: str
    call: GetTypes | GetDependencies


@dataclass(frozen=True, slots=True)
class FoundTypes:
    """``types``: identifiers, each with the octets of a TypeObject, little endian and not looked into.

    ``complete_to_minimal``: which identifiers of the two kinds are of one type.
    """

    types: tuple[tuple[TypeIdentifier, bytes], ...]
    complete_to_minimal: tuple[tuple[TypeIdentifier, TypeIdentifier], ...] = ()


@dataclass(frozen=True, slots=True)
class FoundDependencies:
    """``continuation_point`` is empty at the end of the list."""

    dependencies: tuple[SizedIdentifier, ...]
    continuation_point: bytes = b""


@dataclass(frozen=True, slots=True)
class TypeLookupReply:
    """``result`` is None where the server says that it cannot answer."""

    request_id: RequestId
    result: FoundTypes | FoundDependencies | None


def instance_name(server: Guid) -> str:
    """The service instance of a participant; servers do not compare it, as those of Cyclone DDS 0.10 differ."""
    return f"dds.builtin.TOS.{server.participant.hex()}"


# --- requests ------------------------------------------------------------------------------------------------


def encode_request(request: TypeLookupRequest) -> bytes:
    """The payload, with its encapsulation header."""
    writer = ObjectWriter()
    _write_request_id(writer, request.request_id)
    writer.string(request.instance_name)
    call = request.call
    with writer.delimited():
        writer.u32(_GET_TYPES if isinstance(call, GetTypes) else _GET_DEPENDENCIES)
        with writer.delimited():
            with _member(writer, _TYPE_IDS):
                writer.u32(len(call.type_ids))
                for identifier in call.type_ids:
                    write_identifier(writer, identifier)
            if isinstance(call, GetDependencies):
                _write_continuation(writer, call.continuation_point)
    return _sealed(writer)


def decode_request(payload: Octets) -> TypeLookupRequest:
    """MalformedMessage where it is none, or asks for another operation."""
    reader = _opened(payload)
    request_id = _read_request_id(reader)
    name = _read_name(reader)
    with reader.delimited():
        operation = reader.u32()
        if operation not in (_GET_TYPES, _GET_DEPENDENCIES):
            raise reader.malformed(f"a request for the operation {operation:#x}")
        type_ids: tuple[TypeIdentifier, ...] = ()
        continuation_point = b""
        for member_id, length_code in _members(reader):
            if member_id == _TYPE_IDS:
                type_ids = _read_sequence(reader, length_code, read_identifier, least_octets=1)
            elif member_id == _CONTINUATION_POINT:
                continuation_point = _read_continuation(reader, length_code)
            else:
                _skip(reader, length_code)
    call = GetTypes(type_ids) if operation == _GET_TYPES else GetDependencies(type_ids, continuation_point)
    return TypeLookupRequest(request_id, name, call)


# --- replies -------------------------------------------------------------------------------------------------


def encode_reply(reply: TypeLookupReply) -> bytes:
    """The payload, with its encapsulation header.  ValueError for a reply without a result: we always have one."""
    result = reply.result
    if result is None:
        raise ValueError("a reply has a result, though it may be empty")
    writer = ObjectWriter()
    _write_request_id(writer, reply.request_id)
    writer.u32(_OK)  # no remote exception
    with writer.delimited():
        writer.u32(_GET_TYPES if isinstance(result, FoundTypes) else _GET_DEPENDENCIES)
        with writer.delimited():
            writer.u32(_OK)  # the return code
            with writer.delimited():
                if isinstance(result, FoundTypes):
                    _write_types(writer, result)
                else:
                    _write_dependencies(writer, result)
    return _sealed(writer)


def _write_types(writer: ObjectWriter, result: FoundTypes) -> None:
    with _member(writer, _TYPES):
        writer.u32(len(result.types))
        for identifier, octets in result.types:
            write_identifier(writer, identifier)
            writer.align(4)  # where a TypeObject begins with its DHEADER
            writer.octets(octets)
    with _member(writer, _COMPLETE_TO_MINIMAL):
        writer.u32(len(result.complete_to_minimal))
        for complete, minimal in result.complete_to_minimal:
            write_identifier(writer, complete)
            write_identifier(writer, minimal)


def _write_dependencies(writer: ObjectWriter, result: FoundDependencies) -> None:
    with _member(writer, _DEPENDENT_TYPEIDS):
        writer.u32(len(result.dependencies))
        for dependency in result.dependencies:
            write_sized(writer, dependency)
    _write_continuation(writer, result.continuation_point)


def decode_reply(payload: Octets) -> TypeLookupReply:
    """MalformedMessage where it is none.  An operation that we never ask for has no result."""
    reader = _opened(payload)
    request_id = _read_request_id(reader)
    if reader.u32() != _OK:
        return TypeLookupReply(request_id, None)
    with reader.delimited():
        operation = reader.u32()
        with reader.delimited():
            if reader.u32() != _OK or operation not in _RESULTS:
                return TypeLookupReply(request_id, None)
            result = _RESULTS[operation](reader)
    return TypeLookupReply(request_id, result)


def _read_types(reader: ObjectReader) -> FoundTypes:
    types: tuple[tuple[TypeIdentifier, bytes], ...] = ()
    pairs: tuple[tuple[TypeIdentifier, TypeIdentifier], ...] = ()
    for member_id, length_code in _members(reader):
        if member_id == _TYPES:
            types = _read_sequence(reader, length_code, _read_type, least_octets=5)
        elif member_id == _COMPLETE_TO_MINIMAL:
            pairs = _read_sequence(reader, length_code, _read_pair, least_octets=2)
        else:
            _skip(reader, length_code)
    return FoundTypes(types, pairs)


def _read_dependencies(reader: ObjectReader) -> FoundDependencies:
    dependencies: tuple[SizedIdentifier, ...] = ()
    continuation_point = b""
    for member_id, length_code in _members(reader):
        if member_id == _DEPENDENT_TYPEIDS:
            dependencies = _read_sequence(reader, length_code, read_sized, least_octets=9)
        elif member_id == _CONTINUATION_POINT:
            continuation_point = _read_continuation(reader, length_code)
        else:
            _skip(reader, length_code)
    return FoundDependencies(dependencies, continuation_point)


_RESULTS: dict[int, Callable[[ObjectReader], FoundTypes | FoundDependencies]] = {
    _GET_TYPES: _read_types,
    _GET_DEPENDENCIES: _read_dependencies,
}


def _read_type(reader: ObjectReader) -> tuple[TypeIdentifier, bytes]:
    """TypeIdentifierTypeObjectPair.  Whether the octets are a TypeObject is found out when somebody wants it."""
    identifier = read_identifier(reader)
    reader.align(4)
    if not reader.little_endian:  # nobody is known to send this; the hash is that of the little-endian octets
        return identifier, encode_type_object(read_type_object(reader))
    return identifier, bytes(reader.delimited_octets())


def _read_pair(reader: ObjectReader) -> tuple[TypeIdentifier, TypeIdentifier]:
    return read_identifier(reader), read_identifier(reader)


# --- what both have ------------------------------------------------------------------------------------------


def _sealed(writer: ObjectWriter) -> bytes:
    body = writer.getvalue()
    padding = -len(body) % 4
    return encode_encapsulation(Encapsulation.CDR2_LE, padding=padding) + body + bytes(padding)


def _opened(payload: Octets) -> ObjectReader:
    encapsulation = decode_encapsulation(payload).encapsulation
    reader = ObjectReader(payload, little_endian=encapsulation.little_endian, start=HEADER_LENGTH)
    if encapsulation not in (Encapsulation.CDR2_LE, Encapsulation.CDR2_BE):
        raise reader.malformed(f"a message of the TypeLookup service in {encapsulation.name}")
    return reader


def _write_request_id(writer: ObjectWriter, request_id: RequestId) -> None:
    guid, number = request_id
    writer.guid(guid)
    writer.sequence_number(number)


def _read_request_id(reader: ObjectReader) -> RequestId:
    return reader.guid(), reader.sequence_number()


def _read_name(reader: ObjectReader) -> str:
    name = reader.string()
    if len(name) > _LONGEST_NAME:
        raise reader.malformed(f"a service instance with a name of {len(name)} characters")
    return name


@contextmanager
def _member(writer: ObjectWriter, member_id: int) -> Iterator[None]:
    """A member of a mutable type whose own DHEADER is its length as well (length code 5)."""
    writer.u32(5 << 28 | member_id)
    with writer.delimited():
        yield


def _write_continuation(writer: ObjectWriter, octets: bytes) -> None:
    with _member(writer, _CONTINUATION_POINT):  # of a sequence of octets the count is that length
        writer.octets(octets)


def _members(reader: ObjectReader) -> Iterator[tuple[int, int]]:
    """The members of a mutable type: id and length code of each, whose value the caller reads or skips."""
    with reader.delimited():
        while reader.remaining:
            header = reader.u32()
            yield header & 0x0FFFFFFF, header >> 28 & 7


def _skip(reader: ObjectReader, length_code: int) -> None:
    reader.skip(1 << length_code if length_code < 4 else reader.u32() * (1, 1, 4, 8)[length_code - 4])


def _read_sequence(
    reader: ObjectReader, length_code: int, read: Callable[[ObjectReader], _T], *, least_octets: int
) -> tuple[_T, ...]:
    """A sequence with a DHEADER: length code 4 has its length before that, 5 has it in its place."""
    if length_code == 4:
        reader.u32()
    elif length_code != 5:
        raise reader.malformed(f"a sequence with length code {length_code}")
    with reader.delimited():
        return tuple(read(reader) for _ in range(reader.count(least_octets=least_octets)))


def _read_continuation(reader: ObjectReader, length_code: int) -> bytes:
    if length_code == 4:
        reader.u32()
    elif length_code != 5:
        raise reader.malformed(f"a continuation point with length code {length_code}")
    octets = reader.octet_sequence()
    if len(octets) > LONGEST_CONTINUATION:
        raise reader.malformed(f"a continuation point of {len(octets)} octets")
    return bytes(octets)
