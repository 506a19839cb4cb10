"""Typed values in and out of parameter lists: what participant and endpoint announcements share.

RTPS 2.5 §9.6.3 (data types of the builtin topics), §10.2 (PL_CDR).  Values are plain CDR in the byte order of the
list; all that is read comes from strangers, and only MalformedMessage is raised, its element naming the parameter.
Which parameters make up which announcement is not known here.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TypeVar

from ..serialization.cursor import Octets, Reader, Writer
from ..serialization.encapsulation import (
    HEADER_LENGTH,
    Encapsulation,
    decode_encapsulation,
    encode_encapsulation,
)
from ..serialization.parameter_id import SECURITY_PARAMETER_IDS, ParameterId, parameter_name
from ..serialization.parameter_list import UNDERSTOOD_PARAMETERS, ParameterList
from ..structure.errors import BadParameter, MalformedMessage
from ..structure.locator import Locator, LocatorKind
from ..structure.qos_policies import BinaryProperty, Property, propagated
from ..structure.time import DURATION_INFINITE
from ..structure.vendor import OPENDDS, VendorId
from .security_parameters import to_big_endian, to_little_endian

__all__ = [
    "MAX_LOCATORS",
    "MAX_PROPERTIES",
    "NamedProperty",
    "ParameterValues",
    "ParameterWriter",
    "open_payload",
    "seal_payload",
]

_READ_HERE = (ParameterId.DATA_TAGS, ParameterId.AVAILABLE_EXTENDED_BUILTIN_ENDPOINTS)  # a policy; endpoints

MAX_LOCATORS = 64
"""Of one kind in one announcement; those beyond are ignored, as a peer on so many networks can be reached without."""
MAX_PROPERTIES = 256
"""Of text, and again of octets, in one announcement."""

NamedProperty = tuple[str, Property | BinaryProperty]
T = TypeVar("T")


def open_payload(payload: Octets) -> ParameterList:
    """The list inside a PL_CDR payload, either byte order; whatever must be understood is."""
    encapsulation = decode_encapsulation(payload).encapsulation
    if encapsulation not in (Encapsulation.PL_CDR_BE, Encapsulation.PL_CDR_LE):
        reason = f"{encapsulation.name} where a parameter list belongs"
        raise MalformedMessage(reason, element="encapsulation", offset=0)
    parameters, _ = ParameterList.decode(
        payload,
        little_endian=encapsulation.little_endian,
        start=HEADER_LENGTH,
        understood=UNDERSTOOD_PARAMETERS,
    )
    return parameters


def seal_payload(parameters: ParameterList) -> bytes:
    """The payload, encapsulation header first, that holds the list."""
    kind = Encapsulation.PL_CDR_LE if parameters.little_endian else Encapsulation.PL_CDR_BE
    return encode_encapsulation(kind) + parameters.encode()


class ParameterValues:
    """The values of a received list, by id and type.

    Of an id that occurs twice the first is taken, but for locators, which accumulate.
    """

    __slots__ = ("_first", "_parameters", "_reader_class", "little_endian")

    def __init__(self, parameters: ParameterList, *, vendor_id: VendorId, protocol_version: tuple[int, int]) -> None:
        self._parameters = parameters
        self._first: dict[int, Octets] = {}
        for pid, value in parameters:
            self._first.setdefault(pid, value)
        self.little_endian = parameters.little_endian
        old_opendds = vendor_id == OPENDDS and protocol_version < (2, 4)
        self._reader_class = _NanosecondReader if old_opendds else Reader

    def __contains__(self, pid: int) -> bool:
        return pid in self._first

    def read(self, pid: int, read: Callable[[Reader], T], default: T) -> T:
        """The parameter as ``read`` understands it, ``default`` if it is absent."""
        value = self._first.get(pid)
        return default if value is None else self._decode(pid, value, read)

    def require(self, pid: int, read: Callable[[Reader], T]) -> T:
        """The parameter as ``read`` understands it; malformed if it is absent."""
        value = self._first.get(pid)
        if value is None:
            raise MalformedMessage("is missing", element=parameter_name(pid))
        return self._decode(pid, value, read)

    def _decode(self, pid: int, value: Octets, read: Callable[[Reader], T]) -> T:
        try:
            return read(self._reader_class(value, little_endian=self.little_endian))
        except MalformedMessage as error:
            raise MalformedMessage(error.reason, element=parameter_name(pid), offset=error.offset) from error
        except BadParameter as error:  # a policy refuses the value
            raise MalformedMessage(str(error), element=parameter_name(pid)) from error

    def locators(self, pid: int, *, multicast: bool) -> tuple[Locator, ...]:
        """The locators of all parameters with this id that datagrams can be sent to, without repetitions.

        Left out are other kinds than UDP, port 0 and beyond 65535, and addresses that do not fit the list:
        a unicast list that named a group or a broadcast address would make us multiply a stranger's traffic.
        """
        usable: dict[Locator, None] = {}
        for value in self._parameters.get_all(pid):
            locator = _usable_locator(self._decode(pid, value, Reader.locator), multicast=multicast)
            if locator is not None and len(usable) < MAX_LOCATORS:
                usable[locator] = None
        return tuple(usable)

    def properties(self) -> tuple[NamedProperty, ...]:
        """PROPERTY_LIST: what a peer propagates, in order, those of text first."""
        return self.read(ParameterId.PROPERTY_LIST, _read_properties, ())

    def security_parameters(self) -> tuple[tuple[int, bytes], ...]:
        """The first of each parameter that the security plugins alone read, as little-endian octets."""
        return tuple(
            (pid, to_little_endian(pid, value, little_endian=self.little_endian))
            for pid, value in self._first.items()
            if pid in SECURITY_PARAMETER_IDS and pid not in _READ_HERE
        )


class _NanosecondReader(Reader):
    """OpenDDS before RTPS 2.4 wrote the fraction of durations in nanoseconds."""

    __slots__ = ()

    def duration(self) -> float:
        seconds, nanoseconds = self.i32(), self.u32()
        if seconds == 0x7FFFFFFF:
            return DURATION_INFINITE
        if seconds < 0:
            raise self.malformed(f"a duration of {seconds} seconds")
        return round(seconds + nanoseconds / 1e9, 9)


def _usable_locator(locator: Locator, *, multicast: bool) -> Locator | None:
    if locator.kind == LocatorKind.UDPV4:
        # The octets before the address are to be zero; they are made so, lest one address look like two.
        locator = locator._replace(address=bytes(12) + locator.address[12:])
        if locator.address[12] >= 240:  # reserved addresses, and 255.255.255.255
            return None
    elif locator.kind != LocatorKind.UDPV6:
        return None
    if not 0 < locator.port <= 0xFFFF or locator.is_unspecified or locator.is_multicast != multicast:
        return None
    return locator


def _read_properties(reader: Reader) -> tuple[NamedProperty, ...]:
    properties: list[NamedProperty] = []
    for _ in range(reader.sequence_length(most=MAX_PROPERTIES)):
        name = reader.string()
        properties.append((name, Property(reader.string(), propagate=True)))
    # The sequence of octet properties came with DDS Security; older peers leave it out.
    if reader.remaining >= 4:
        for _ in range(reader.sequence_length(most=MAX_PROPERTIES)):
            name = reader.string()
            properties.append((name, BinaryProperty(bytes(reader.octet_sequence()), propagate=True)))
    return tuple(properties)


class ParameterWriter:
    """Builds a list value by value; one method for each type that is common."""

    __slots__ = ("parameters",)

    def __init__(self, *, little_endian: bool = True) -> None:
        self.parameters = ParameterList(little_endian=little_endian)

    def write(self, pid: int, write: Callable[[Writer, T], None], value: T) -> None:
        """Append the value as ``write`` serialises it, for example ``Writer.string``."""
        writer = Writer(little_endian=self.parameters.little_endian)
        write(writer, value)
        self.parameters.add(pid, writer.getvalue())

    def octets(self, pid: int, octets: bytes) -> None:
        """Append octets that have no byte order, or have it already."""
        self.parameters.add(pid, octets)

    def locators(self, pid: int, locators: Iterable[Locator]) -> None:
        for locator in locators:
            self.write(pid, Writer.locator, locator)

    def properties(self, properties: Iterable[tuple[str, str | Property | BinaryProperty]]) -> None:
        """PROPERTY_LIST with those that are to be propagated; nothing if there are none."""
        sent = list(propagated(properties))
        texts = [(name, value.value) for name, value in sent if isinstance(value, Property)]
        octets = [(name, value.value) for name, value in sent if isinstance(value, BinaryProperty)]
        if texts or octets:
            self.write(ParameterId.PROPERTY_LIST, _write_properties, (texts, octets))

    def security_parameters(self, parameters: Iterable[tuple[int, bytes]]) -> None:
        """Append what the security plugins announce; it is given as little-endian octets."""
        little_endian = self.parameters.little_endian
        for pid, value in parameters:
            self.parameters.add(pid, value if little_endian else to_big_endian(pid, value))


def _write_properties(writer: Writer, properties: tuple[list[tuple[str, str]], list[tuple[str, bytes]]]) -> None:
    texts, octets = properties
    writer.sequence_length(len(texts))
    for name, text in texts:
        writer.string(name)
        writer.string(text)
    writer.sequence_length(len(octets))
    for name, value in octets:
        writer.string(name)
        writer.octet_sequence(value)
