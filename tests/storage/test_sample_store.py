"""The store of a persistence service: what it keeps, what it lets go, and that it outlives its process."""

from __future__ import annotations

import os
import signal
import sqlite3
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from ddsi.storage import SampleStore, StoredTopic
from ddsi.structure.cache_change import ChangeKind
from ddsi.structure.errors import BadParameter
from ddsi.structure.guid import EntityId, Guid
from ddsi.structure.qos_policies import DurabilityService, KeepAll, KeepLast

TOPIC = StoredTopic("Square", "ShapeType", ("a", "b"), 0, True, 3, b"announced")
WRITER = Guid.of(b"w" * 12, EntityId(b"\0\0\1\2"))
ALL = DurabilityService(history=KeepAll())
ALIVE, DISPOSED = ChangeKind.ALIVE, ChangeKind.NOT_ALIVE_DISPOSED


@pytest.fixture
def store() -> Iterator[SampleStore]:
    found = SampleStore(":memory:")
    found.add_topic(TOPIC)
    yield found
    found.close()


def add(
    store: SampleStore, number: int, key: str = "k", limits: DurabilityService = ALL, kind: ChangeKind = ALIVE,
    timestamp: int = 0, now: float = 0.0,
) -> bool:  # fmt: skip
    octets = key.encode()
    return store.add(TOPIC, WRITER, number, kind, octets, b"p%d" % number, timestamp or number, limits=limits, now=now)


def numbers(store: SampleStore) -> list[int]:
    return [sample.number for sample in store.samples(TOPIC)]


def test_samples_come_back_as_they_were(store: SampleStore) -> None:
    assert add(store, 1)
    [sample] = store.samples(TOPIC)
    assert (sample.writer, sample.number, sample.kind, sample.key, sample.payload, sample.timestamp) == (
        WRITER, 1, ALIVE, b"k", b"p1", 1,
    )  # fmt: skip


def test_they_come_in_the_order_in_which_they_were_added_and_in_portions(store: SampleStore) -> None:
    for number in (3, 1, 2):
        add(store, number)
    first, second = store.samples(TOPIC, limit=2)
    assert (first.number, second.number) == (3, 1)
    assert [sample.number for sample in store.samples(TOPIC, after=second.place)] == [2]
    assert store.last_place() == second.place + 1


def test_of_each_instance_the_last_ones_are_kept(store: SampleStore) -> None:
    limits = DurabilityService(history=KeepLast(2))
    for number in range(1, 7):
        add(store, number, "odd" if number % 2 else "even", limits)
    assert numbers(store) == [3, 4, 5, 6]


def test_the_topic_has_a_bound_too(store: SampleStore) -> None:
    limits = DurabilityService(history=KeepAll(), max_samples=3, max_samples_per_instance=3)
    for number in range(1, 7):
        add(store, number, str(number), limits)
    assert numbers(store) == [4, 5, 6]


def test_an_instance_too_many_is_not_taken(store: SampleStore) -> None:
    limits = DurabilityService(history=KeepAll(), max_instances=1)
    assert add(store, 1, "first", limits)
    assert not add(store, 2, "second", limits)
    assert add(store, 3, "first", limits)
    assert numbers(store) == [1, 3]


def test_the_end_of_an_instance_is_kept_for_a_while_and_its_samples_are_not(store: SampleStore) -> None:
    limits = DurabilityService(service_cleanup_delay=10, history=KeepAll())
    add(store, 1, "ends", limits)
    add(store, 2, "stays", limits)
    add(store, 3, "ends", limits, DISPOSED, now=100.0)
    assert numbers(store) == [2, 3]
    assert store.expire(109.9) == 110.0
    assert numbers(store) == [2, 3]
    assert store.expire(110.0) is None
    assert numbers(store) == [2]


def test_without_a_delay_nothing_is_left_of_it(store: SampleStore) -> None:
    add(store, 1)
    add(store, 2, kind=DISPOSED, now=5.0)
    store.expire(5.0)
    assert numbers(store) == []


def test_that_a_writer_gives_an_instance_up_changes_nothing(store: SampleStore) -> None:
    add(store, 1)
    assert not add(store, 2, kind=ChangeKind.NOT_ALIVE_UNREGISTERED)
    assert numbers(store) == [1]


def test_what_comes_twice_is_kept_once_and_a_restarted_writers_number_is_news(store: SampleStore) -> None:
    assert add(store, 1, timestamp=5)
    assert not add(store, 1, timestamp=5)
    assert add(store, 1, timestamp=6)
    assert [sample.timestamp for sample in store.samples(TOPIC)] == [6]


def test_a_store_is_found_again_with_all_that_was_committed(tmp_path: Path) -> None:
    path = tmp_path / "samples.sqlite"
    store = SampleStore(path)
    store.add_topic(TOPIC)
    add(store, 1)
    store.close()
    found = SampleStore(path)
    assert found.topics() == [TOPIC]
    assert found.topics()[0].announcement == b"announced"
    assert numbers(found) == [1]
    found.close()


def test_what_was_committed_survives_sigkill(tmp_path: Path) -> None:
    path = tmp_path / "samples.sqlite"
    program = (
        "import os, signal, sys; from tests.storage.test_sample_store import *\n"
        "store = SampleStore(sys.argv[1]); store.add_topic(TOPIC); add(store, 1); store.commit(); add(store, 2)\n"
        "os.kill(os.getpid(), signal.SIGKILL)"
    )
    command = [sys.executable, "-c", program, str(path)]
    ended = subprocess.run(command, check=False, cwd=Path(__file__).parents[2], env=os.environ)
    assert ended.returncode == -signal.SIGKILL
    store = SampleStore(path)
    assert numbers(store) == [1]
    store.close()


def test_what_must_not_outlive_the_service_is_forgotten(store: SampleStore) -> None:
    transient = StoredTopic("Circle", "ShapeType", (), 0, True, 2)
    store.add_topic(transient)
    store.add(transient, WRITER, 1, ALIVE, b"", b"", 1, limits=ALL)
    add(store, 1)
    store.forget(2)
    assert store.topics() == [TOPIC]
    store.add_topic(transient)
    assert store.samples(transient) == []


def test_a_file_that_is_no_store_is_refused_by_its_name(tmp_path: Path) -> None:
    path = tmp_path / "letter.txt"
    path.write_text("Dear reader, this is no database. " * 50)
    with pytest.raises(BadParameter, match=r"letter\.txt"):
        SampleStore(path)


def test_a_database_of_something_else_is_refused_and_left_alone(tmp_path: Path) -> None:
    path = tmp_path / "letters.sqlite"
    database = sqlite3.connect(path)
    database.execute("CREATE TABLE letter (text TEXT)")
    database.close()
    with pytest.raises(BadParameter, match="something else"):
        SampleStore(path)


def test_a_store_of_a_later_version_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "samples.sqlite"
    SampleStore(path).close()
    database = sqlite3.connect(path)
    database.execute("PRAGMA user_version = 99")
    database.close()
    with pytest.raises(BadParameter, match="layout is 99"):
        SampleStore(path)


def test_a_store_serves_one_process_at_a_time(tmp_path: Path) -> None:
    path = tmp_path / "samples.sqlite"
    store = SampleStore(path)
    with pytest.raises(BadParameter, match="locked"):
        SampleStore(path)
    store.close()
