"""The receiver's state: one test per row of RTPS 2.5 §8.3.4's rules."""

from __future__ import annotations

import pytest

from ddsi.messages.header import Header
from ddsi.messages.receiver import MessageReceiver, ReceiverState
from ddsi.messages.submessages import (
    Data,
    HeaderExtension,
    Heartbeat,
    InfoDestination,
    InfoReply,
    InfoReplyIp4,
    InfoSource,
    InfoTimestamp,
    Opaque,
    Pad,
    Submessage,
    SubmessageKind,
    Unknown,
)
from ddsi.structure.errors import MalformedMessage
from ddsi.structure.guid import EntityId, GuidPrefix
from ddsi.structure.locator import Locator

OWN, PEER, OTHER = (GuidPrefix(bytes((number,)) * 12) for number in (1, 2, 3))
SOURCE = Locator.udp_v4("127.0.0.1", 40000)
UNICAST = Locator.udp_v4("127.0.0.1", 7410)
MULTICAST = Locator.udp_v4("239.255.0.1", 7400)
HEARTBEAT = Heartbeat(EntityId.UNKNOWN, EntityId(b"\0\0\1\2"), 1, 0, 1)
BEGINNING = ReceiverState(PEER, b"\x01\x10", (2, 1), GuidPrefix.UNKNOWN, (SOURCE,))


def message(*submessages: Submessage) -> bytes:
    return Header((2, 1), b"\x01\x10", PEER).encode() + b"".join(submessage.encode() for submessage in submessages)


def states(*submessages: Submessage) -> list[ReceiverState]:
    """The state at each of the submessages."""
    received = list(MessageReceiver(message(*submessages), source=SOURCE))
    assert [submessage for submessage, _ in received] == list(submessages)
    return [state for _, state in received]


def test_message_begins_with_its_header_and_the_address_it_came_from() -> None:
    assert states(HEARTBEAT) == [BEGINNING]
    assert list(MessageReceiver(message())) == []


def test_without_a_source_address_there_is_none_to_reply_to() -> None:
    ((_, state),) = MessageReceiver(message(HEARTBEAT))
    assert state.unicast_reply_locators == ()


def test_timestamp_holds_until_the_next_one() -> None:
    found = states(HEARTBEAT, InfoTimestamp(5), HEARTBEAT, HEARTBEAT, InfoTimestamp(None), HEARTBEAT)
    assert [state.timestamp for state in found] == [None, 5, 5, 5, None, None]


def test_destination_is_one_participant_or_all() -> None:
    found = states(
        HEARTBEAT, InfoDestination(OWN), HEARTBEAT, InfoDestination(OTHER), InfoDestination(GuidPrefix.UNKNOWN)
    )
    assert [state.is_addressed_to(OWN) for state in found] == [True, True, True, False, True]


def test_source_replaces_the_header_and_voids_what_the_former_source_said() -> None:
    *_, state = states(
        InfoTimestamp(5),
        InfoDestination(OWN),
        InfoReply((UNICAST,), (MULTICAST,)),
        InfoSource((2, 4), b"\x01\x0f", OTHER),
    )
    assert state == ReceiverState(OTHER, b"\x01\x0f", (2, 4), dest_guid_prefix=OWN)


def test_reply_locators_replace_the_source_address() -> None:
    *_, state = states(InfoReply((UNICAST, SOURCE), (MULTICAST,)))
    assert (state.unicast_reply_locators, state.multicast_reply_locators) == ((UNICAST, SOURCE), (MULTICAST,))
    *_, state = states(InfoReply((UNICAST,), (MULTICAST,)), InfoReply(()))
    assert (state.unicast_reply_locators, state.multicast_reply_locators) == ((), ())


def test_reply_locators_in_their_short_form() -> None:
    *_, state = states(InfoReplyIp4(UNICAST, MULTICAST))
    assert (state.unicast_reply_locators, state.multicast_reply_locators) == ((UNICAST,), (MULTICAST,))
    *_, state = states(InfoReplyIp4(UNICAST, MULTICAST), InfoReplyIp4(SOURCE))
    assert (state.unicast_reply_locators, state.multicast_reply_locators) == ((SOURCE,), ())


@pytest.mark.parametrize(
    "submessage",
    [
        Pad(4),
        HEARTBEAT,
        HeaderExtension(1, b"abcd"),
        Unknown(0x80, 1, b"abcd"),
        Opaque(SubmessageKind.SEC_BODY, 1, b"abcd"),
    ],
)
def test_other_submessages_change_nothing(submessage: Submessage) -> None:
    first, second = states(submessage, HEARTBEAT)
    assert first == second == BEGINNING


def test_malformed_submessage_ends_the_message_but_not_what_came_before() -> None:
    broken = message(InfoTimestamp(5), HEARTBEAT) + bytes.fromhex("09 01 0400 00000000") + HEARTBEAT.encode()
    received = iter(MessageReceiver(broken))
    assert next(received)[0] == InfoTimestamp(5)
    assert next(received)[0] == HEARTBEAT
    with pytest.raises(MalformedMessage) as caught:
        next(received)
    assert (caught.value.element, caught.value.offset) == ("INFO_TS", 20 + 12 + 32 + 4)
    assert list(received) == []


def test_datagram_that_is_not_rtps_is_malformed_at_once() -> None:
    with pytest.raises(MalformedMessage):
        MessageReceiver(b"\x00")


def test_what_comes_out_of_an_envelope_continues_the_state() -> None:
    receiver = MessageReceiver(message(InfoDestination(OWN), Opaque(SubmessageKind.SEC_BODY, 1, b"abcd")))
    for submessage, _ in receiver:
        if isinstance(submessage, Opaque):
            inside = InfoTimestamp(7).encode() + HEARTBEAT.encode()
            *_, (decoded, state) = receiver.walk(inside)
            assert decoded == HEARTBEAT
            assert (state.dest_guid_prefix, state.timestamp) == (OWN, 7)
    assert receiver.state.timestamp == 7


def test_payload_is_a_view_of_the_datagram() -> None:
    datagram = bytearray(message(Data(EntityId.UNKNOWN, EntityId(b"\0\0\1\2"), 1, serialized_payload=b"\0\1\0\0abcd")))
    ((data, _),) = MessageReceiver(datagram)
    datagram[-1] = ord("X")
    assert isinstance(data, Data)
    assert data.serialized_payload == b"\0\1\0\0abcX"
