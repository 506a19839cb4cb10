"""Buffers that are used again when nobody holds them any more."""

from __future__ import annotations

import pytest

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


def test_what_goes_around_a_room_is_written_there() -> None:
    rooms = Rooms()
    room = rooms.room(1000)
    room[:] = b"r" * 1000
    joined = rooms.around(b"before", room, b"behind")
    assert joined == b"before" + b"r" * 1000 + b"behind"
    assert isinstance(joined, memoryview)
    assert address(joined) == address(room)


def test_the_end_of_a_room_may_be_given_up() -> None:
    rooms = Rooms()
    room = rooms.room(1016)
    room[:] = b"r" * 1000 + b"t" * 16
    part = rooms.shortened(room, 16)
    joined = rooms.around(b"before", part, b"behind")
    assert joined == b"before" + b"r" * 1000 + b"behind"
    assert isinstance(joined, memoryview)
    assert address(joined) == address(room)


@pytest.mark.parametrize(("before", "behind"), [(257, 0), (0, 65), (1 << 16, 1 << 16)])
def test_what_has_no_space_around_a_room_is_joined_with_it(before: int, behind: int) -> None:
    rooms = Rooms()
    room = rooms.room(1 << 16)
    joined = rooms.around(b"b" * before, room, b"e" * behind)
    assert joined == b"b" * before + bytes(room) + b"e" * behind
    assert isinstance(joined, bytes)


def test_nothing_is_written_around_a_room_twice_nor_around_a_part_of_it_nor_around_an_earlier_one() -> None:
    rooms = Rooms()
    room = rooms.room(100)
    first = rooms.around(b"first", room, b"")
    assert rooms.around(b"other", room, b"") == b"other" + bytes(room)
    assert first == b"first" + bytes(room), "whoever has it sees nothing else"
    room = rooms.room(100)
    assert isinstance(rooms.around(b"b", room[:50], b""), bytes)
    later = rooms.room(100)
    assert isinstance(rooms.around(b"b", room, b""), bytes)
    assert isinstance(rooms.around(b"b", later, b""), memoryview)
    large = rooms.room(1 << 17)
    assert isinstance(rooms.around(b"b", large, b""), bytes)
    assert isinstance(rooms.around(b"b", b"octets", b""), bytes)
