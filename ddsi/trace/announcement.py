"""What a DATA submessage of a builtin writer announces: just enough of it to put names to what a trace shows.

RTPS 2.5 §8.5.3 (SPDP), §8.5.4 (SEDP), §8.4.13.5 (ParticipantMessageData).  Reading announcements in full, and acting on
them, is ``discovery``'s, which lies below this room.
"""

from __future__ import annotations

from dataclasses import dataclass

from ..messages.data import Data
from ..serialization.cursor import Octets, Reader
from ..serialization.encapsulation import HEADER_LENGTH, decode_encapsulation
from ..serialization.parameter_id import ParameterId
from ..serialization.parameter_list import ParameterList
from ..structure import builtin_entity_ids as ids
from ..structure.cache_change import StatusInfo
from ..structure.errors import MalformedMessage
from ..structure.guid import Guid
from ..structure.locator import Locator

__all__ = ["Announcement", "announcement_in", "liveliness_kind", "status_info"]

_PARTICIPANTS = frozenset({ids.SPDP_WRITER, ids.SPDP_SECURE_WRITER})
_ENDPOINTS = frozenset(
    {
        ids.SEDP_PUBLICATIONS_WRITER,
        ids.SEDP_SUBSCRIPTIONS_WRITER,
        ids.SEDP_PUBLICATIONS_SECURE_WRITER,
        ids.SEDP_SUBSCRIPTIONS_SECURE_WRITER,
    }
)
_LIVELINESS = frozenset({ids.PARTICIPANT_MESSAGE_WRITER, ids.PARTICIPANT_MESSAGE_SECURE_WRITER})
_LIVELINESS_KINDS = {b"\0\0\0\1": "automatic liveliness", b"\0\0\0\2": "manual liveliness"}
_UNICAST = (
    ParameterId.METATRAFFIC_UNICAST_LOCATOR,
    ParameterId.DEFAULT_UNICAST_LOCATOR,
    ParameterId.UNICAST_LOCATOR,
)
_MAX_LOCATORS = 16


@dataclass(frozen=True, slots=True)
class Announcement:
    """A participant (then ``topic_name`` is empty) or endpoint by name; what the list does not hold is empty.

    ``unicast``: where it is to be reached.
    """

    guid: Guid
    topic_name: str
    type_name: str
    entity_name: str
    unicast: tuple[Locator, ...]


def announcement_in(data: Data) -> Announcement | None:
    """What this DATA announces; None if it is no SPDP or SEDP, or (partly) unreadable as such."""
    if data.writer_id in _PARTICIPANTS:
        guid_pid = ParameterId.PARTICIPANT_GUID
    elif data.writer_id in _ENDPOINTS:
        guid_pid = ParameterId.ENDPOINT_GUID
    else:
        return None
    try:
        header = decode_encapsulation(data.serialized_payload)
        little_endian = header.encapsulation.little_endian
        parameters, _ = ParameterList.decode(data.serialized_payload, little_endian=little_endian, start=HEADER_LENGTH)
        guid = parameters.get(guid_pid)
        if guid is None:
            return None
        return Announcement(
            Reader(guid, little_endian=little_endian).guid(),
            _text(parameters, ParameterId.TOPIC_NAME),
            _text(parameters, ParameterId.TYPE_NAME),
            _text(parameters, ParameterId.ENTITY_NAME),
            _locators(parameters),
        )
    except MalformedMessage:
        return None


def status_info(data: Data) -> StatusInfo:
    """PID_STATUS_INFO of the inline QoS, no bit set where there is none.  RTPS 2.5 §9.6.4.9."""
    value: Octets | None = data.inline_qos.get(ParameterId.STATUS_INFO) if data.inline_qos is not None else None
    return StatusInfo(value[3] & 7) if value is not None and len(value) >= 4 else StatusInfo(0)


def liveliness_kind(data: Data) -> str:
    """Which liveliness a ParticipantMessage asserts, in words; empty for every other DATA.

    The payload: encapsulation header, guidPrefix 12, kind 4 (octets, not a number), data.
    """
    if data.writer_id not in _LIVELINESS:
        return ""
    return _LIVELINESS_KINDS.get(bytes(data.serialized_payload[16:20]), "")


def _text(parameters: ParameterList, pid: int) -> str:
    value = parameters.get(pid)
    return "" if value is None else Reader(value, little_endian=parameters.little_endian).string()


def _locators(parameters: ParameterList) -> tuple[Locator, ...]:
    values = [value for pid in _UNICAST for value in parameters.get_all(pid)]
    return tuple(Reader(value, little_endian=parameters.little_endian).locator() for value in values[:_MAX_LOCATORS])
