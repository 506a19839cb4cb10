"""Hostile messages of security, and hostile datagrams to a secured session, for ``make_corpus``."""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterator

from ddsi.messages.acknack import AckNack
from ddsi.messages.data import Data
from ddsi.messages.gap import Gap
from ddsi.messages.heartbeat import Heartbeat
from ddsi.messages.interpreter import InfoSource
from ddsi.messages.raw_submessage import SubmessageKind, iterate_submessages
from ddsi.serialization import ParameterId, ParameterList
from ddsi.structure.builtin_entity_ids import PARTICIPANT_STATELESS_MESSAGE_WRITER as STATELESS
from ddsi.structure.builtin_entity_ids import SPDP_READER, SPDP_WRITER
from ddsi.structure.guid import EntityId, Guid, GuidPrefix
from ddsi.structure.sequence_number import NumberSet
from tests.fuzz.hostile_messages import Made
from tests.fuzz.secured import said_to_bob
from tests.fuzz.session import recorded

__all__ = ["SECURED_MAKERS"]

DROPPED, IGNORED = "dropped", "ignored"
ON_STATELESS, ON_VOLATILE = b"\0", b"\xff"


def security_messages() -> Iterator[Made]:
    said = [payload for _, payload in said_to_bob()]
    first, keys = said[0], said[-1]
    handshake = sum(writer_id == STATELESS for writer_id, _ in said_to_bob())
    yield "nothing", b"", "Rejected"
    yield "first", b"\0" + ON_STATELESS + first, "accepted"
    for name, payload in (("first", first), ("keys", keys)):
        yield f"{name}-cut-off", b"\0" + ON_STATELESS + payload[: len(payload) // 2], "Rejected"
        other_source = payload[:4] + bytes(12) + payload[16:]
        yield f"{name}-of-another-source", b"\0" + ON_STATELESS + other_source, "Rejected ~ not its sender"
    yield "keys-before-the-handshake", b"\0" + ON_VOLATILE + keys, IGNORED
    yield "keys-on-the-stateless-topic", bytes([handshake]) + ON_STATELESS + keys, IGNORED
    yield "handshake-on-the-volatile-topic", bytes([handshake]) + ON_VOLATILE + first, IGNORED
    yield "last-of-the-handshake-first", b"\0" + ON_STATELESS + said[handshake - 1], IGNORED
    yield "nothing-but-zeros", b"\0" + ON_STATELESS + bytes(2000), "Rejected"
    yield "too-large", b"\0" + ON_STATELESS + first + bytes(70_000), "Refused ~ more than"
    yield "everything-4-billion", b"\0" + ON_STATELESS + first[:4] + b"\xff" * (len(first) - 4), "NotForUs"


def conversations() -> Iterator[Made]:
    """To Bob, who has authenticated Alice, by somebody who has read and written down everything."""
    said = recorded()
    alice = GuidPrefix(said[0][8:20])
    head = said[0][:20]
    writer = EntityId(b"\0\0\1\3")
    yield "nothing", b"", DROPPED
    yield "the-handshake-again", b"".join(said[2:8]), DROPPED
    yield "the-samples-again", b"".join(said[-6:]), DROPPED
    yield "a-sample-in-clear", head + Data(EntityId.UNKNOWN, writer, 4, None, b"\0\1\0\0" + bytes(8)).encode(), DROPPED
    yield "a-gap-in-clear", head + Gap(EntityId.UNKNOWN, writer, 1, NumberSet(1 << 61)).encode(), DROPPED
    yield "a-heartbeat-in-clear", head + Heartbeat(EntityId.UNKNOWN, writer, 1, 1 << 61, 99).encode(), DROPPED
    yield "an-acknack-in-clear", head + AckNack(EntityId(b"\0\0\1\4"), writer, NumberSet(9), 99, True).encode(), DROPPED
    guid = Guid.of(alice, EntityId.PARTICIPANT)
    inline = ParameterList([(ParameterId.KEY_HASH, guid), (ParameterId.STATUS_INFO, b"\0\0\0\3")])
    payload = b"\0\3\0\0" + struct.pack("<HH", ParameterId.PARTICIPANT_GUID, 16) + guid + b"\1\0\0\0"
    goodbye = Data(SPDP_READER, SPDP_WRITER, 9, inline, payload, is_key=True).encode()
    yield "a-goodbye-in-clear", head + goodbye, DROPPED
    envelopes = [octets for octets in said if any(_is_envelope(raw.kind) for raw in iterate_submessages(octets))]
    last = envelopes[-1]
    flipped = last[:-20] + bytes([last[-20] ^ 1]) + last[-19:]
    yield "a-bit-flipped-under-a-mac", flipped, DROPPED
    stranger = GuidPrefix(b"\1\xdd" + bytes(10))
    yield "an-envelope-of-another", last[:8] + stranger + last[20:], DROPPED
    source = InfoSource((2, 4), b"\1\xdd", stranger).encode()
    yield "an-envelope-behind-another-source", head + source + last[20:], DROPPED
    yield "an-envelope-without-end", last[: len(last) - 24], DROPPED
    prefix = struct.pack("<BBH", SubmessageKind.SEC_PREFIX, 1, 20) + bytes(20)
    yield "a-hundred-beginnings", head + prefix * 100, DROPPED


def _is_envelope(kind: int) -> bool:
    return kind in (SubmessageKind.SEC_PREFIX, SubmessageKind.SRTPS_PREFIX)


SECURED_MAKERS: dict[str, Callable[[], Iterator[Made]]] = {
    "security_message": security_messages,
    "secured_conversation": conversations,
}
