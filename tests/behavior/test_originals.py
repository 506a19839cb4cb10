"""What a persistence service hands on, and a reader has already: nothing comes twice, and nothing is missed."""

from __future__ import annotations

from ddsi.behavior.originals import Originals
from ddsi.structure.cache_change import CacheChange, ChangeKind
from ddsi.structure.guid import EntityId, Guid

WRITER, SERVICE, OTHER_SERVICE = (Guid.of(bytes((number,)) * 12, EntityId(b"\0\0\1\2")) for number in (1, 2, 3))


def handed_on(by: Guid, number: int, original: int, writer: Guid = WRITER) -> CacheChange:
    change = CacheChange(ChangeKind.ALIVE, by, number, b"")
    change.original = writer, original
    return change


def test_what_no_service_hands_on_is_never_a_repeat() -> None:
    assert not Originals().is_repeated(CacheChange(ChangeKind.ALIVE, WRITER, 1, b""), {WRITER})


def test_while_the_writer_is_matched_it_speaks_for_itself() -> None:
    assert Originals().is_repeated(handed_on(SERVICE, 1, 7), {WRITER, SERVICE})


def test_what_the_writer_has_said_before_its_end_is_known_and_the_rest_is_news() -> None:
    originals = Originals()
    originals.writer_ended(WRITER, 5)
    assert originals.is_repeated(handed_on(SERVICE, 1, 5), {SERVICE})
    assert not originals.is_repeated(handed_on(SERVICE, 2, 6), {SERVICE})


def test_the_order_in_which_a_service_tells_it_does_not_matter() -> None:
    originals = Originals()
    numbers = [3, 1, 2, 3]  # lost and repaired; the last one is a retransmission
    assert [originals.is_repeated(handed_on(SERVICE, n, n), {SERVICE}) for n in numbers] == [False] * 4


def test_of_two_services_one_is_believed_and_the_other_takes_over_where_it_ended() -> None:
    originals = Originals()
    both = {SERVICE, OTHER_SERVICE}
    assert not originals.is_repeated(handed_on(SERVICE, 1, 4), both)
    assert originals.is_repeated(handed_on(OTHER_SERVICE, 1, 5), both)
    assert originals.is_repeated(handed_on(OTHER_SERVICE, 1, 4), {OTHER_SERVICE})
    assert not originals.is_repeated(handed_on(OTHER_SERVICE, 2, 5), {OTHER_SERVICE})


def test_memory_is_bounded() -> None:
    originals = Originals()
    for number in range(5000):
        originals.writer_ended(Guid.of(number.to_bytes(12, "big"), EntityId(b"\0\0\1\2")), 1)
    assert len(originals._told) == 4096
