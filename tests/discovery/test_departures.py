"""What was announced before a goodbye, and is read after it, does not bring anybody back."""

from __future__ import annotations

from ddsi.discovery.departures import Departures
from ddsi.structure.guid import Guid

A, B = Guid(b"a" * 16), Guid(b"b" * 16)


def test_what_is_older_than_the_goodbye_was_overtaken_by_it() -> None:
    departures = Departures()
    departures.note(A, 7, 10.0)
    assert departures.overtook(A, 6, 10.1)
    assert departures.overtook(A, 7, 10.1)
    assert not departures.overtook(A, 8, 10.1), "it announces itself again"
    assert not departures.overtook(B, 6, 10.1)


def test_who_counts_anew_returns_a_second_later() -> None:
    departures = Departures()
    departures.note(A, 7, 10.0)
    assert departures.overtook(A, 1, 11.0)
    assert not departures.overtook(A, 1, 11.1)


def test_a_crowd_that_leaves_is_not_remembered_as_a_whole() -> None:
    departures = Departures()
    for number in range(3000):
        departures.note(Guid(number.to_bytes(16, "big")), 1, 10.0)
    remembered = [departures.overtook(Guid(number.to_bytes(16, "big")), 1, 10.0) for number in range(3000)]
    assert remembered == [False] * (3000 - 1024) + [True] * 1024
    departures.note(A, 1, 12.0)
    assert len(departures._goodbyes) == 1
