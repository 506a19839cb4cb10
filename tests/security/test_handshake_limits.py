"""What the hooks do about floods: seats given by a property, what waits, and messages that are too large."""

from __future__ import annotations

from dataclasses import replace

import pytest

from ddsi.spi import PENDING, Decided, Refused, SendMessage
from ddsi.structure import builtin_entity_ids as ids
from ddsi.structure.cache_change import CacheChange, ChangeKind
from ddsi.structure.errors import ConfigurationError
from ddsi.structure.guid import EntityId, Guid, GuidPrefix
from ddsi_security import service
from ddsi_security.admission import MAX_HANDSHAKE_OCTETS

from .seam import NOW_NS, Side, deliver, introduce, properties_of


def side_with_seats(count: int) -> Side:
    return Side("bob", "governance", extra={"dds.sec.auth.max_handshakes": str(count)})


def strangers(side: Side, count: int) -> list[Guid]:
    """They announce what Bob's own kind announces; their Guids are the higher ones, so that he would have to begin."""
    guids = [
        Guid.of(GuidPrefix(b"\xff" * 8 + number.to_bytes(4, "big")), EntityId.PARTICIPANT) for number in range(count)
    ]
    for guid in guids:
        assert side.hooks.remote_participant(replace(side.data, guid=guid), 0.0) is PENDING
    return guids


@pytest.mark.parametrize("value", ["0", "-1", "many", "", "1.5", "9999999", "\u0663"])
def test_a_number_of_handshakes_that_is_none_is_refused(value: str) -> None:
    properties = {**properties_of("bob"), "dds.sec.auth.max_handshakes": value}
    with pytest.raises(ConfigurationError, match=r"dds\.sec\.auth\.max_handshakes .*whole number from 1 to 999999"):
        service.load(properties, entropy=bytes, wall_clock=lambda: NOW_NS)


def test_only_who_has_a_seat_costs_a_handshake() -> None:
    bob = side_with_seats(3)
    strangers(bob, 20)
    bob.act(0.0)
    bob.hooks.handle_timeout(0.05)
    bob.act(0.05)
    assert sum(b"+Req" in bytes(sent.change.payload) for sent in bob.under_way) == 3


def test_who_is_lost_makes_room() -> None:
    bob = side_with_seats(1)
    guids = strangers(bob, 2)
    alice = Side("alice")
    introduce(alice, bob)
    assert not bob.has_admitted(alice)
    for guid in guids:
        bob.hooks.remote_participant_lost(guid)
    deliver(alice, bob)
    assert bob.has_admitted(alice)


def test_what_is_said_while_one_waits_is_read_when_its_turn_comes() -> None:
    """Alice begins; her request waits with her, and no other has to come."""
    bob = side_with_seats(1)
    (stranger,) = strangers(bob, 1)
    alice = Side("alice")
    assert alice.guid < bob.guid
    introduce(alice, bob)
    alice.hooks.handle_timeout(0.02)
    alice.act(0.02)
    while alice.under_way:
        bob.hooks.receive_message(alice.under_way.pop(0).change, 0.02)
    assert not bob.under_way
    bob.hooks.remote_participant_lost(stranger)
    bob.act(0.03)
    assert any(b"+Reply" in bytes(sent.change.payload) for sent in bob.under_way)


def test_a_message_that_is_too_large_is_reported_once_and_not_read() -> None:
    alice, bob = Side("alice"), Side("bob")
    bob.hooks.remote_participant(alice.data, 0.0)
    bob.act(0.0)
    writer = alice.endpoint(ids.PARTICIPANT_STATELESS_MESSAGE_WRITER)
    told = []
    for number in (1, 2):
        change = CacheChange(ChangeKind.ALIVE, writer, number, bytes(MAX_HANDSHAKE_OCTETS + 1), destination=bob.guid)
        bob.hooks.receive_message(change, 0.1)
        told += [effect for effect in bob.hooks.drain_effects() if not isinstance(effect, SendMessage)]
    reason = "a handshake message has 65537 octets, more than 65536: is a document so large?"
    assert told == [Decided(bob.guid, alice.guid, Refused(reason))]
