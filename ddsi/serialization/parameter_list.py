"""ParameterList: the extensible records of RTPS, used as inline QoS and as discovery data.

RTPS 2.5 §8.3.5.9, §9.4.2.11 (ParameterList).  A list is octets with names: what a value means is decided by
who asks for it (``discovery`` for announcements, ``behavior`` for inline QoS).

    0                16               32
    +----------------+----------------+
    | parameterId    | length         |    in the byte order of the list's container
    +----------------+----------------+
    | value, ``length`` octets, padded to a multiple of 4 ...
    +----------------+----------------+
    | SENTINEL       | ignored        |
    +----------------+----------------+
"""

from __future__ import annotations

import struct
from collections.abc import Container, Iterable, Iterator
from typing import NamedTuple

from ..structure.errors import MalformedMessage
from .cursor import Octets
from .parameter_id import MUST_UNDERSTAND, ParameterId, parameter_name

__all__ = ["MAX_PARAMETERS", "UNDERSTOOD_PARAMETERS", "MustUnderstandUnknown", "Parameter", "ParameterList"]

MAX_PARAMETERS = 1024
"""More parameters than that in one list are malformed: announcements hold tens, and each costs an object."""

UNDERSTOOD_PARAMETERS: frozenset[int] = frozenset(int(pid) for pid in ParameterId)
"""The ids that this stack knows: a list with another that must be understood is not used."""

_HEADERS = {True: struct.Struct("<HH"), False: struct.Struct(">HH")}
_PAD, _SENTINEL = int(ParameterId.PAD), int(ParameterId.SENTINEL)
_MAX_VALUE = 0xFFFC  # the largest multiple of 4 that the length field holds


class MustUnderstandUnknown(MalformedMessage):
    """A list holds a parameter that must be understood, and is not: nothing in the list may be used.

    Not a breach of the grammar: the peer is from the future.  Only what the list describes is dropped,
    not the rest of the message.
    """

    def __init__(self, pid: int) -> None:
        super().__init__(f"parameter {pid:04x} must be understood and is unknown", element="ParameterList")
        self.pid = pid


class Parameter(NamedTuple):
    """An id and the value's octets, in the byte order of the list, as long as the length field said."""

    pid: int
    value: Octets

    def __repr__(self) -> str:
        return f"{parameter_name(self.pid)}={bytes(self.value).hex()}"


class ParameterList:
    """Parameters in order; the same id may occur more than once.  Other name: plist.

    All values are in one byte order, ``little_endian``: that of the submessage, or of the payload's encapsulation.
    """

    __slots__ = ("_parameters", "little_endian")

    def __init__(self, parameters: Iterable[tuple[int, Octets]] = (), *, little_endian: bool = True) -> None:
        self.little_endian = little_endian
        self._parameters = [Parameter(pid, value) for pid, value in parameters]

    def add(self, pid: int, value: Octets) -> None:
        """Append a parameter; ``value`` is at most 65532 octets, already in the list's byte order."""
        self._parameters.append(Parameter(pid, value))

    def get(self, pid: int) -> Octets | None:
        """The value of the first parameter with this id.

        The first, since the specification gives a repetition no meaning (Cyclone DDS refuses such lists).
        """
        for parameter in self._parameters:
            if parameter.pid == pid:
                return parameter.value
        return None

    def get_all(self, pid: int) -> list[Octets]:
        """The values of all parameters with this id, in order: for locators and the like, which accumulate."""
        return [parameter.value for parameter in self._parameters if parameter.pid == pid]

    def __iter__(self) -> Iterator[Parameter]:
        return iter(self._parameters)

    def __len__(self) -> int:
        return len(self._parameters)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, ParameterList):
            return NotImplemented
        return self.little_endian == other.little_endian and self._parameters == other._parameters

    __hash__ = None  # type: ignore[assignment]  # it can be added to

    def __repr__(self) -> str:
        order = "little" if self.little_endian else "big"
        return f"<ParameterList {order}-endian {', '.join(repr(parameter) for parameter in self._parameters)}>"

    def require_understood(self, understood: Container[int] = UNDERSTOOD_PARAMETERS) -> None:
        """Raise :class:`MustUnderstandUnknown` if a parameter that must be understood is not in ``understood``.

        A vendor's own parameter is no exception: where the sender set that bit it meant it.
        """
        for parameter in self._parameters:
            if parameter.pid & MUST_UNDERSTAND and parameter.pid not in understood:
                raise MustUnderstandUnknown(parameter.pid)

    def encode(self) -> bytes:
        """The octets of the list, sentinel included; values are padded to a multiple of 4."""
        header = _HEADERS[self.little_endian]
        buffer = bytearray()
        for pid, value in self._parameters:
            padding = -len(value) % 4
            if len(value) > _MAX_VALUE:
                raise ValueError(f"{parameter_name(pid)} has {len(value)} octets; a parameter holds {_MAX_VALUE}")
            buffer += header.pack(pid, len(value) + padding)
            buffer += value
            buffer += bytes(padding)
        buffer += header.pack(_SENTINEL, 0)
        return bytes(buffer)

    @classmethod
    def decode(
        cls, octets: Octets, *, little_endian: bool, start: int = 0, understood: Container[int] | None = None
    ) -> tuple[ParameterList, int]:
        """Read a list from ``octets[start:]``: the list, and how many octets it took with its sentinel.

        Values are views of ``octets``, not copies.  PAD is skipped.  A length that is no multiple of 4 is rounded
        up to find the next parameter (Cyclone DDS refuses it, Fast DDS does so), the value keeps its length.
        Raises MalformedMessage when a value or the sentinel is missing, or beyond MAX_PARAMETERS; given
        ``understood``, also :class:`MustUnderstandUnknown`.
        """
        view = memoryview(octets)
        unpack = _HEADERS[little_endian].unpack_from
        decoded = cls(little_endian=little_endian)
        parameters = decoded._parameters
        position, end = start, len(view)
        while True:
            if end - position < 4:
                raise MalformedMessage("no sentinel", element="ParameterList", offset=position)
            pid, length = unpack(view, position)
            position += 4
            if pid == _SENTINEL:
                break
            if end - position < length:
                reason = f"{parameter_name(pid)} has {length} octets, {end - position} are left"
                raise MalformedMessage(reason, element="ParameterList", offset=position)
            if pid != _PAD:
                if len(parameters) == MAX_PARAMETERS:
                    raise MalformedMessage(
                        f"over {MAX_PARAMETERS} parameters", element="ParameterList", offset=position
                    )
                parameters.append(Parameter(pid, view[position : position + length]))
            position += length + -length % 4
        if understood is not None:
            decoded.require_understood(understood)
        return decoded, position - start
