"""Who has a seat and who waits: bounds, fairness, and what silent and talkative crowds can do to a newcomer."""

from __future__ import annotations

import math

import pytest

from ddsi.structure.guid import EntityId, Guid, GuidPrefix
from ddsi_security.waiting_room import MAX_HANDSHAKES, TURN_S, WaitingRoom


def guid(number: int) -> Guid:
    return Guid.of(GuidPrefix(number.to_bytes(12, "big")), EntityId.PARTICIPANT)


NEWCOMER = guid(1_000_000)


def room_of(count: int, *, seats: int = 3, now: float = 0.0) -> WaitingRoom:
    room = WaitingRoom(seats)
    for number in range(count):
        room.enter(guid(number))
    while room.seat_next(now) is not None:
        pass
    return room


def pass_time(room: WaitingRoom, now: float) -> list[Guid]:
    """Everything that happens at that time; who was seated."""
    seated = []
    for _ in range(room.waiting_count):
        room.end_turn(now)
        called = room.seat_next(now)
        if called is None:
            break
        seated.append(called)
    return seated


def seated_count(room: WaitingRoom, count: int) -> int:
    return sum(room.is_seated(guid(number)) for number in range(count))


def test_while_there_are_seats_nobody_waits() -> None:
    room = room_of(3)
    assert [room.is_seated(guid(number)) for number in range(3)] == [True] * 3
    assert room.waiting_count == 0
    assert room.next_deadline() == math.inf
    assert room.end_turn(1e9) is None, "a turn has no end while nobody waits"


def test_never_more_than_there_are_seats() -> None:
    room = room_of(50)
    for tick in range(100):
        pass_time(room, tick * TURN_S / 2)
        assert seated_count(room, 50) == 3
        assert room.waiting_count == 47


def test_who_leaves_makes_room_for_the_first_that_waits() -> None:
    room = room_of(5)
    room.leave(guid(1))
    assert room.seat_next(0.1) == guid(3)
    room.leave(guid(4))
    assert room.waiting_count == 0


def test_nobody_is_there_twice() -> None:
    room = room_of(3)
    room.enter(guid(0))
    assert room.waiting_count == 0
    room.enter(NEWCOMER)
    room.enter(NEWCOMER)
    assert room.waiting_count == 1


def test_a_turn_ends_only_for_somebody_else() -> None:
    room = room_of(3)
    room.enter(NEWCOMER)
    assert room.next_deadline() == TURN_S
    assert room.end_turn(TURN_S - 0.01) is None
    assert room.end_turn(TURN_S) == guid(0)
    assert room.seat_next(TURN_S) == NEWCOMER
    assert room.waiting_count == 1
    assert pass_time(room, TURN_S) == [guid(0)], "the next that has had its turn gives way to the first"


def test_all_have_their_turn_before_anybody_has_another() -> None:
    room = room_of(30)
    order = [guid(number) for number in range(3)]
    for tick in range(1, 10):
        order += pass_time(room, tick * TURN_S)
    assert len(set(order)) == 30 == len(order)


@pytest.mark.parametrize("strangers_speak", [False, True])
@pytest.mark.parametrize("newcomer_speaks", [False, True])
def test_how_long_a_newcomer_waits(strangers_speak: bool, newcomer_speaks: bool) -> None:
    """Before it are a thousand who all stay as long as they may."""
    room = room_of(1000, seats=MAX_HANDSHAKES)
    if strangers_speak:
        for number in range(1000):
            room.spoke(guid(number))
    room.enter(NEWCOMER)
    if newcomer_speaks:
        assert room.spoke(NEWCOMER)
    now = 0.0
    while not room.is_seated(NEWCOMER):
        now = room.next_deadline()
        pass_time(room, now)
        for number in range(1000) if strangers_speak else ():
            room.spoke(guid(number))
    assert now <= (TURN_S if newcomer_speaks and not strangers_speak else 1000 / MAX_HANDSHAKES * TURN_S)


def test_to_speak_costs_no_place_in_the_line() -> None:
    """Whoever is next, and then says something, is still next."""
    room = room_of(20)
    for number in range(10, 20):
        room.spoke(guid(number))
    room.spoke(guid(3))
    room.leave(guid(0))
    room.leave(guid(1))
    assert {room.seat_next(0.0), room.seat_next(0.0)} == {guid(3), guid(10)}


def test_only_who_waits_is_told_to_have_spoken_while_it_waited() -> None:
    room = room_of(4)
    assert not room.spoke(guid(0))
    assert room.spoke(guid(3))
    assert not room.spoke(NEWCOMER)
