"""Endpoints that part and match again while both live: their keys are still there, and protect nothing in between.

DDS-Security 1.1 §8.8.9, §8.5.1.7-8.  Each side judges by what it knows, so one may part and the other not; and a vendor
may throw away at once what it was sent (Fast DDS does), or look at the first keys only (Cyclone DDS does).
"""

from __future__ import annotations

import math

import pytest

from ddsi.spi import ADMITTED, PENDING, Admission, NotForUs, Outcome
from ddsi.structure.discovered import DiscoveredReaderData, DiscoveredWriterData
from ddsi.structure.guid import EntityId, EntityKind
from ddsi.structure.qos import EndpointQos
from ddsi_security.generic_message import read_generic_message

from .seam import Side, deliver, introduce, match_builtin_topics

WRITER = EntityId.user(1, EntityKind.WRITER_WITH_KEY)
READER = EntityId.user(2, EntityKind.READER_WITH_KEY)
SECOND_READER = EntityId.user(3, EntityKind.READER_WITH_KEY)
HEARTBEAT = bytes.fromhex("07011c00") + EntityId.UNKNOWN + WRITER + bytes(20)
ACKNACK = bytes.fromhex("06011800") + READER + WRITER + bytes(16)
PAYLOAD = b"\0\1\0\0" + b"BLUE" * 10
LATER = 100.0
ENCRYPT, ORIGIN = "governance", "governance_all_oa"
BOTH = ("writer", "reader")


class Square:
    """Alice's writer and Bob's reader of it, matched."""

    def __init__(self, governance: str = ENCRYPT) -> None:
        self.alice, self.bob = alice, bob = Side("alice", governance), Side("bob", governance)
        introduce(alice, bob)
        match_builtin_topics(alice, bob)
        deliver(alice, bob)
        self.writer, self.reader = alice.endpoint(WRITER), bob.endpoint(READER)
        topic, type_name, qos = "Square", "ShapeType", EndpointQos()
        alice.hooks.local_writer(DiscoveredWriterData(guid=self.writer, topic_name=topic, type_name=type_name, qos=qos))
        for reader in (self.reader, bob.endpoint(SECOND_READER)):
            bob.hooks.local_reader(DiscoveredReaderData(guid=reader, topic_name=topic, type_name=type_name, qos=qos))
        self.match("writer")
        self.match("reader")
        deliver(alice, bob)

    def match(self, who: str) -> Admission:
        if who == "writer":
            return self.alice.match(WRITER, self.bob, READER, "Square")
        return self.bob.match(READER, self.alice, WRITER, "Square")

    def part(self, who: str, *, forgets: bool = False) -> None:
        """``forgets``: it throws the other's keys away, too."""
        hooks, local, remote = (
            (self.alice.hooks, self.writer, self.reader)
            if who == "writer"
            else (self.bob.hooks, self.reader, self.writer)
        )
        hooks.unmatch(local, remote)
        if forgets:
            hooks.remote_endpoint_lost(remote)

    def is_admitted(self, who: str) -> bool:
        local, remote = (self.writer, self.reader) if who == "writer" else (self.reader, self.writer)
        return (self.alice if who == "writer" else self.bob).decided[local, remote] is ADMITTED

    def keys_under_way(self) -> int:
        """Act, deliver nothing, and count."""
        for side in (self.alice, self.bob):
            side.act(LATER)
        return len(self.alice.under_way) + len(self.bob.under_way)

    def talk(self) -> bool:
        """Does a heartbeat get to the reader, its answer to the writer, and a sample to the reader?"""
        heard = self.bob.open(self.alice.protect(WRITER, self.reader, HEARTBEAT), self.alice)
        answer = self.alice.open(self.bob.protect(READER, self.writer, ACKNACK), self.bob)
        payload = self.bob.hooks.decode_payload(self.writer, self.alice.hooks.encode_payload(self.writer, PAYLOAD))
        if isinstance(heard, Outcome) or isinstance(answer, Outcome) or isinstance(payload, Outcome):
            return False
        return (bytes(heard), bytes(answer), bytes(payload)) == (HEARTBEAT, ACKNACK, PAYLOAD)


@pytest.mark.parametrize("governance", [ENCRYPT, ORIGIN])
@pytest.mark.parametrize("who", BOTH)
def test_who_parted_alone_and_returns_needs_nothing_of_the_other(who: str, governance: str) -> None:
    square = Square(governance)
    assert square.talk()
    square.part(who)
    assert square.match(who) is ADMITTED
    assert square.talk()
    deliver(square.alice, square.bob, now=LATER)
    assert square.talk()


@pytest.mark.parametrize("governance", [ENCRYPT, ORIGIN])
@pytest.mark.parametrize("who", BOTH)
def test_who_parted_and_threw_the_keys_away_is_sent_them_again(who: str, governance: str) -> None:
    """The other has never parted."""
    square = Square(governance)
    square.part(who, forgets=True)
    assert square.match(who) is PENDING
    deliver(square.alice, square.bob, now=LATER)
    assert square.is_admitted(who)
    assert square.talk()


@pytest.mark.parametrize("governance", [ENCRYPT, ORIGIN])
@pytest.mark.parametrize("forgets", [False, True])
def test_both_may_part_and_return(forgets: bool, governance: str) -> None:
    square = Square(governance)
    for who in BOTH:
        square.part(who, forgets=forgets)
    for who in BOTH:
        square.match(who)
    deliver(square.alice, square.bob, now=LATER)
    assert all(square.is_admitted(who) for who in BOTH)
    assert square.talk()


@pytest.mark.parametrize("who", BOTH)
def test_keys_sent_again_are_answered_once(who: str) -> None:
    square = Square()
    square.part(who)
    square.match(who)
    assert square.keys_under_way() == 1
    sender, receiver = (square.alice, square.bob) if who == "writer" else (square.bob, square.alice)
    (message,) = sender.under_way
    sender.under_way.clear()
    sender.hooks.handle_timeout(LATER)
    for answers in (1, 0):  # the second time is no news
        receiver.hooks.receive_message(message.change, LATER)
        assert square.keys_under_way() == answers
        receiver.under_way.clear()


def test_two_that_match_anew_come_to_an_end() -> None:
    """Answers are not answered, though nothing in them says that they are answers."""
    square = Square()
    for side in (square.alice, square.bob):
        side.hooks.handle_timeout(LATER)
    for who in BOTH:
        square.part(who)
        square.match(who)
    assert square.keys_under_way() == 2
    deliver(square.alice, square.bob, now=LATER + 1.0)
    assert square.keys_under_way() == 0


def test_keys_sent_again_are_the_same() -> None:
    """Receiver-specific ones, too: Cyclone DDS does not look at them while it is matched."""
    square = Square(ORIGIN)
    tokens = []
    for _ in range(2):
        square.part("writer")
        square.match("writer")
        square.alice.act()
        tokens.append(read_generic_message(square.alice.under_way.pop().change.payload).message_data)
    assert tokens[0] == tokens[1]


@pytest.mark.parametrize("governance", [ENCRYPT, ORIGIN])
def test_nothing_is_protected_for_who_has_parted(governance: str) -> None:
    square = Square(governance)
    for who in BOTH:
        square.part(who)
    assert square.alice.protect(WRITER, square.reader, HEARTBEAT) == b""
    assert square.bob.protect(READER, square.writer, ACKNACK) == b""


@pytest.mark.parametrize("governance", [ENCRYPT, ORIGIN])
def test_nothing_is_opened_of_who_has_parted(governance: str) -> None:
    square = Square(governance)
    heartbeat = square.alice.protect(WRITER, square.reader, HEARTBEAT)
    acknack = square.bob.protect(READER, square.writer, ACKNACK)
    payload = square.alice.hooks.encode_payload(square.writer, PAYLOAD)
    assert square.talk()  # by the shorter way from here on
    for who in BOTH:
        square.part(who)
    assert isinstance(square.bob.open(heartbeat, square.alice), NotForUs)
    assert isinstance(square.alice.open(acknack, square.bob), NotForUs)
    assert isinstance(square.bob.hooks.decode_payload(square.writer, payload), NotForUs)


def test_keys_that_come_while_parted_open_nothing_until_the_two_match() -> None:
    square = Square()
    square.part("writer", forgets=True)
    square.part("reader")
    square.bob.decided.clear()
    square.match("writer")
    deliver(square.alice, square.bob, now=LATER)
    assert (square.reader, square.writer) not in square.bob.decided
    assert not square.is_admitted("writer"), "who has parted answers nothing"
    heartbeat = square.alice.protect(WRITER, square.reader, HEARTBEAT)
    assert not heartbeat
    assert square.match("reader") is ADMITTED
    deliver(square.alice, square.bob, now=LATER)
    assert square.talk()


@pytest.mark.parametrize("governance", [ENCRYPT, ORIGIN])
def test_another_reader_of_the_same_writer_hears_it_still(governance: str) -> None:
    """Both have the writer's key; the one that has parted was there first."""
    square = Square(governance)
    alice, bob = square.alice, square.bob
    second = bob.endpoint(SECOND_READER)
    alice.match(WRITER, bob, SECOND_READER, "Square")
    bob.match(SECOND_READER, alice, WRITER, "Square")
    deliver(alice, bob)
    square.part("reader")
    to_both = b"".join(alice.hooks.encode_submessage(square.writer, (square.reader, second), (HEARTBEAT,)))
    opened = bob.open(to_both, alice)
    assert not isinstance(opened, Outcome)
    assert bytes(opened) == HEARTBEAT
    payload = bob.hooks.decode_payload(square.writer, alice.hooks.encode_payload(square.writer, PAYLOAD))
    assert not isinstance(payload, Outcome)
    assert bytes(payload) == PAYLOAD


@pytest.mark.parametrize("who", BOTH)
def test_who_waits_for_keys_in_vain_asks_for_them_ever_more_slowly(who: str) -> None:
    """By sending its own again; the other thinks that all is well."""
    square = Square()
    asker, other = (square.alice, square.bob) if who == "writer" else (square.bob, square.alice)
    square.part(who, forgets=True)
    square.match(who)
    asked_at = []
    while (now := asker.hooks._keys.next_deadline()) < math.inf:
        asker.act(now)
        asker.under_way.clear()
        asker.hooks.handle_timeout(now)
        asker.act(now)
        asked_at += [now] * len(asker.under_way)
        answered = asker.under_way[-1:]
    assert asked_at == [5.0, 15.0, 35.0, 75.0, 155.0, 315.0]
    other.hooks.receive_message(answered[0].change, 315.0)
    other.act(315.0)
    asker.hooks.receive_message(other.under_way[0].change, 315.0)
    asker.act(315.0)
    assert square.is_admitted(who)
    assert asker.hooks._keys.next_deadline() == math.inf


@pytest.mark.parametrize("ends", ["answered", "parted", "gone"])
def test_nobody_asks_who_waits_no_more(ends: str) -> None:
    square = Square()
    square.part("reader", forgets=True)
    square.match("reader")
    if ends == "answered":
        deliver(square.alice, square.bob, now=LATER)
    else:
        square.part("reader", forgets=ends == "gone")
    square.bob.act(LATER)
    square.bob.under_way.clear()
    square.bob.hooks.handle_timeout(2 * LATER)
    square.bob.act(2 * LATER)
    assert not square.bob.under_way


@pytest.mark.parametrize("who", BOTH)
def test_nothing_stays_of_an_endpoint_that_is_gone(who: str) -> None:
    square = Square()
    side, remote = (square.alice, square.reader) if who == "writer" else (square.bob, square.writer)
    keys = side.hooks._keys
    (pair,) = keys.by_remote[remote]
    square.part(who, forgets=True)
    assert remote not in keys.by_remote
    assert pair.handle not in keys.by_handle
    assert pair not in keys.pairs.values()
