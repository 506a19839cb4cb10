"""All submessages in one place: the closed union of them, and the table from kind to decoder.

RTPS 2.5 §8.3.8, §9.4.5.  Each class knows its own octets: ``encode(little_endian=True)`` gives them with the submessage
header and padded to a multiple of 4, ``decode(flags, body)`` reads what stands behind that header.
"""

from __future__ import annotations

from collections.abc import Callable

from ..structure.errors import MalformedMessage
from .acknack import AckNack, AckNackFlag, NackFrag
from .data import Data, DataFlag
from .data_frag import DataFrag, DataFragFlag
from .gap import Gap, GapFlag, GapGroupInfo
from .heartbeat import Heartbeat, HeartbeatFlag, HeartbeatFrag, HeartbeatGroupInfo
from .interpreter import (
    InfoDestination,
    InfoReply,
    InfoReplyFlag,
    InfoReplyIp4,
    InfoSource,
    InfoTimestamp,
    InfoTimestampFlag,
    Pad,
)
from .opaque import HeaderExtension, Opaque, Unknown
from .raw_submessage import (
    SUBMESSAGE_HEADER_LENGTH,
    RawSubmessage,
    SubmessageKind,
    iterate_submessages,
    submessage_name,
)

__all__ = [
    "AckNack",
    "AckNackFlag",
    "Data",
    "DataFlag",
    "DataFrag",
    "DataFragFlag",
    "Gap",
    "GapFlag",
    "GapGroupInfo",
    "HeaderExtension",
    "Heartbeat",
    "HeartbeatFlag",
    "HeartbeatFrag",
    "HeartbeatGroupInfo",
    "InfoDestination",
    "InfoReply",
    "InfoReplyFlag",
    "InfoReplyIp4",
    "InfoSource",
    "InfoTimestamp",
    "InfoTimestampFlag",
    "NackFrag",
    "Opaque",
    "Pad",
    "RawSubmessage",
    "Submessage",
    "SubmessageKind",
    "Unknown",
    "decode_submessage",
    "iterate_submessages",
]

Submessage = (
    AckNack
    | Data
    | DataFrag
    | Gap
    | HeaderExtension
    | Heartbeat
    | HeartbeatFrag
    | InfoDestination
    | InfoReply
    | InfoReplyIp4
    | InfoSource
    | InfoTimestamp
    | NackFrag
    | Opaque
    | Pad
    | Unknown
)

_DECODERS: dict[int, Callable[[int, memoryview], Submessage]] = {
    SubmessageKind.HEADER_EXTENSION: HeaderExtension.decode,
    SubmessageKind.PAD: Pad.decode,
    SubmessageKind.ACKNACK: AckNack.decode,
    SubmessageKind.HEARTBEAT: Heartbeat.decode,
    SubmessageKind.GAP: Gap.decode,
    SubmessageKind.INFO_TS: InfoTimestamp.decode,
    SubmessageKind.INFO_SRC: InfoSource.decode,
    SubmessageKind.INFO_REPLY_IP4: InfoReplyIp4.decode,
    SubmessageKind.INFO_DST: InfoDestination.decode,
    SubmessageKind.INFO_REPLY: InfoReply.decode,
    SubmessageKind.NACK_FRAG: NackFrag.decode,
    SubmessageKind.HEARTBEAT_FRAG: HeartbeatFrag.decode,
    SubmessageKind.DATA: Data.decode,
    SubmessageKind.DATA_FRAG: DataFrag.decode,
}
_ENVELOPES = frozenset(
    {
        SubmessageKind.SEC_BODY,
        SubmessageKind.SEC_PREFIX,
        SubmessageKind.SEC_POSTFIX,
        SubmessageKind.SRTPS_PREFIX,
        SubmessageKind.SRTPS_POSTFIX,
    }
)


def decode_submessage(raw: RawSubmessage) -> Submessage:
    """The submessage that these octets are; payloads are views of them.

    A kind that is not known is :class:`Unknown`, not an error.  MalformedMessage names the kind as its element, and
    its offset counts from where ``raw.offset`` counts from.
    """
    decoder = _DECODERS.get(raw.kind)
    if decoder is None:
        opaque = Opaque if raw.kind in _ENVELOPES else Unknown
        return opaque(raw.kind, raw.flags, raw.body)
    try:
        return decoder(raw.flags, raw.body)
    except MalformedMessage as error:
        offset = raw.offset + SUBMESSAGE_HEADER_LENGTH + max(error.offset, 0)
        raise MalformedMessage(error.reason, element=submessage_name(raw.kind), offset=offset) from error
