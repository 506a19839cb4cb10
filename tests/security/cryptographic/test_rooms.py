"""Buffers that are used again when nobody holds them any more."""

from __future__ import annotations

from ddsi_security.cryptographic.rooms import Rooms


def address(room: memoryview) -> int:
    return id(room.obj)


def test_a_room_is_as_large_as_asked_for() -> None:
    rooms = Rooms()
    for length in (100, 100, 7, 0, 1 << 16, 100, 1 << 17, 1 << 17, 100):
        assert len(rooms.room(length)) == length


def test_a_room_is_given_out_again_when_all_views_of_it_are_gone() -> None:
    rooms = Rooms()
    first = rooms.room(1000)
    assert address(rooms.room(1000)) != address(first)
    part, was = first[10:20], address(first)
    part[:] = b"0123456789"
    del first
    others = [rooms.room(1 << 16) for _ in range(10)]
    for other in others:
        other[:] = bytes(len(other))
    assert bytes(part) == b"0123456789", "a part that is held is nobody else's"
    del part
    assert address(rooms.room(1000)) == was


def test_few_are_kept() -> None:
    rooms = Rooms()
    held = [rooms.room(1000) for _ in range(50)]
    assert len({address(room) for room in held}) == 50
    assert len(rooms._rooms) == 4


def test_what_was_decrypted_last_can_be_wiped() -> None:
    rooms = Rooms()
    room = rooms.room(100)
    room[:] = b"x" * 100
    rooms.wipe()
    assert not any(room)
