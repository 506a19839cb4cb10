"""SampleStore: the samples of durable topics in one file, which survives its process, however that ends.

DDS 1.4 §2.2.3.4 (DURABILITY), §2.2.3.5 (DURABILITY_SERVICE).  Octets and numbers only: whose samples they are and who
is to have them its user knows.

The file is written ahead (SQLite's WAL), so what was committed is there after a SIGKILL.  What was committed right
before the machine lost its power may be missing, and nothing else is.
"""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from dataclasses import field
from os import PathLike, fspath

from ..structure.cache_change import ChangeKind
from ..structure.dataclass import dataclass
from ..structure.errors import BadParameter, DdsError
from ..structure.guid import Guid
from ..structure.qos_policies import LENGTH_UNLIMITED, DurabilityService, KeepLast

__all__ = ["SampleStore", "StoredSample", "StoredTopic"]

_LAYOUT = 1
"""Of the tables below; a file with a later one is refused."""

_TABLES = """
CREATE TABLE topic (
    id INTEGER PRIMARY KEY,
    name TEXT NOT NULL, type_name TEXT NOT NULL, partitions TEXT NOT NULL, representation INTEGER NOT NULL,
    is_keyed INTEGER NOT NULL, durability INTEGER NOT NULL, announcement BLOB NOT NULL,
    UNIQUE (name, type_name, partitions, representation, is_keyed, durability)
);
CREATE TABLE sample (
    id INTEGER PRIMARY KEY AUTOINCREMENT,
    topic INTEGER NOT NULL REFERENCES topic (id) ON DELETE CASCADE,
    writer BLOB NOT NULL, number INTEGER NOT NULL, kind INTEGER NOT NULL,
    key BLOB NOT NULL, payload BLOB NOT NULL, timestamp INTEGER NOT NULL, expiry REAL,
    UNIQUE (topic, writer, number)
);
CREATE INDEX sample_of_instance ON sample (topic, key, id);
CREATE INDEX sample_expiry ON sample (expiry) WHERE expiry IS NOT NULL;
"""


@dataclass(frozen=True, slots=True)
class StoredTopic:
    """Writers of one topic that the same readers may have.  ``durability``: the policy's KIND, 2 or 3.

    ``representation``: that of the samples (DataRepresentationId).  ``announcement``: of one of the writers, as it came
    by discovery; it takes no part in comparisons.
    """

    name: str
    type_name: str
    partitions: tuple[str, ...]
    representation: int
    is_keyed: bool
    durability: int
    announcement: bytes = field(default=b"", compare=False)


@dataclass(frozen=True, slots=True)
class StoredSample:
    """``place``: where it stands among all samples of the store, ascending in the order in which they came.

    ``number``: the writer's sequence number.  ``key``: the instance; empty for what has no key.  ``payload`` with its
    encapsulation header; of an end, the key's.  ``timestamp``: ticks of 2^-32 s.
    """

    place: int
    writer: Guid
    number: int
    kind: ChangeKind
    key: bytes
    payload: bytes
    timestamp: int


class SampleStore:
    """One file, for one process at a time; ``":memory:"`` keeps nothing.  Not for several threads.

    What is added is safe after :meth:`commit`.
    """

    def __init__(self, path: str | PathLike[str]) -> None:
        """Raises BadParameter, naming the file, where it is no store, or one of a later version, or in use."""
        self._path = fspath(path)
        self._ids: dict[StoredTopic, int] = {}
        try:
            self._database = sqlite3.connect(self._path, isolation_level=None, timeout=0)
            try:
                self._open()
            except BaseException:
                self._database.close()
                raise
        except sqlite3.Error as error:
            raise BadParameter(
                f"{self._path} cannot be opened as a store of samples: {error}; name a file that a PersistenceService "
                "made and no other process uses, or one that does not exist"
            ) from error

    def __repr__(self) -> str:
        return f"<SampleStore {self._path}>"

    def _open(self) -> None:
        database = self._database
        database.execute("PRAGMA locking_mode = EXCLUSIVE")
        database.execute("PRAGMA journal_mode = WAL")
        database.execute("PRAGMA synchronous = NORMAL")
        database.execute("PRAGMA foreign_keys = ON")
        [(layout,)] = database.execute("PRAGMA user_version")
        database.execute("BEGIN IMMEDIATE")
        [(table_count,)] = database.execute("SELECT COUNT(*) FROM sqlite_schema")
        if layout == 0 and table_count:
            raise sqlite3.DatabaseError("it is a database of something else")
        if layout == 0:
            for statement in filter(str.strip, _TABLES.split(";")):
                database.execute(statement)
            database.execute(f"PRAGMA user_version = {_LAYOUT}")
        elif layout != _LAYOUT:
            raise sqlite3.DatabaseError(f"its layout is {layout}, and this version of ddsi reads {_LAYOUT}")
        for topic_id, topic in self._read_topics():
            self._ids[topic] = topic_id

    def _read_topics(self) -> Iterator[tuple[int, StoredTopic]]:
        rows = self._database.execute(
            "SELECT id, name, type_name, partitions, representation, is_keyed, durability, announcement FROM topic"
        )
        for topic_id, name, type_name, partitions, *rest in rows.fetchall():
            representation, is_keyed, durability, announcement = rest
            names = tuple(partitions.split("\0")) if partitions else ()
            topic = StoredTopic(name, type_name, names, representation, bool(is_keyed), durability, bytes(announcement))
            yield topic_id, topic

    def commit(self) -> None:
        """What was added is in the file."""
        self._guarded("COMMIT")
        self._guarded("BEGIN IMMEDIATE")

    def close(self) -> None:
        self._guarded("COMMIT")
        self._database.close()

    def _guarded(self, statement: str, values: tuple[object, ...] = ()) -> sqlite3.Cursor:
        try:
            return self._database.execute(statement, values)
        except sqlite3.Error as error:
            raise DdsError(f"the store {self._path} fails: {error}; is the disk full, or the file gone?") from error

    # --- topics --------------------------------------------------------------------------------------------

    def topics(self) -> list[StoredTopic]:
        return list(self._ids)

    def add_topic(self, topic: StoredTopic) -> None:
        """Known from now on; nothing happens if it is."""
        if topic in self._ids:
            return
        cursor = self._guarded(
            "INSERT INTO topic"
            " (name, type_name, partitions, representation, is_keyed, durability, announcement)"
            " VALUES (?, ?, ?, ?, ?, ?, ?)",
            (
                topic.name, topic.type_name, "\0".join(topic.partitions), topic.representation, topic.is_keyed,
                topic.durability, topic.announcement,
            ),
        )  # fmt: skip
        assert cursor.lastrowid is not None
        self._ids[topic] = cursor.lastrowid

    def forget(self, durability: int) -> None:
        """Drop all topics of this kind of durability: what must not outlive its service."""
        for topic in [topic for topic in self._ids if topic.durability == durability]:
            self._guarded("DELETE FROM topic WHERE id = ?", (self._ids.pop(topic),))

    # --- samples -------------------------------------------------------------------------------------------

    def add(
        self,
        topic: StoredTopic,
        writer: Guid,
        number: int,
        kind: ChangeKind,
        key: bytes,
        payload: bytes,
        timestamp: int,
        *,
        limits: DurabilityService,
        now: float = 0.0,
    ) -> bool:
        """Keep one more change, and no more of its instance and topic than ``limits`` allow: the oldest go.

        The end of an instance takes its samples with it, and stays for ``service_cleanup_delay`` seconds from ``now``
        (any clock that goes on from one process to the next).  An instance beyond ``max_instances`` is not taken.
        Returns whether it was kept; what is here already is not.
        """
        topic_id = self._ids[topic]
        if kind is ChangeKind.NOT_ALIVE_UNREGISTERED:
            return False
        if kind is not ChangeKind.ALIVE:
            return self._end(
                topic_id, writer, number, kind, key, payload, timestamp, now + limits.service_cleanup_delay
            )
        if not self._has_room_for_instance(topic_id, key, limits.max_instances):
            return False
        row = (topic_id, bytes(writer), number, int(kind), key, payload, timestamp, None)
        if not self._insert(row):
            return False
        depth = limits.history.depth if isinstance(limits.history, KeepLast) else limits.max_samples_per_instance
        if depth != LENGTH_UNLIMITED:
            self._guarded(
                "DELETE FROM sample WHERE id IN (SELECT id FROM sample WHERE topic = ? AND key = ?"
                " ORDER BY id DESC LIMIT -1 OFFSET ?)",
                (topic_id, key, depth),
            )
        if limits.max_samples != LENGTH_UNLIMITED:
            self._guarded(
                "DELETE FROM sample WHERE id IN (SELECT id FROM sample WHERE topic = ?"
                " ORDER BY id DESC LIMIT -1 OFFSET ?)",
                (topic_id, limits.max_samples),
            )
        return True

    def _end(
        self,
        topic_id: int,
        writer: Guid,
        number: int,
        kind: ChangeKind,
        key: bytes,
        payload: bytes,
        timestamp: int,
        expiry: float,
    ) -> bool:
        self._guarded("DELETE FROM sample WHERE topic = ? AND key = ?", (topic_id, key))
        return self._insert((topic_id, bytes(writer), number, int(kind), key, payload, timestamp, expiry))

    def _insert(self, row: tuple[object, ...]) -> bool:
        """A number that comes again with a later timestamp is another sample: its writer has restarted."""
        topic_id, writer, number, _, _, _, timestamp, _ = row
        self._guarded(
            "DELETE FROM sample WHERE topic = ? AND writer = ? AND number = ? AND timestamp < ?",
            (topic_id, writer, number, timestamp),
        )
        cursor = self._guarded(
            "INSERT OR IGNORE INTO sample (topic, writer, number, kind, key, payload, timestamp, expiry)"
            " VALUES (?, ?, ?, ?, ?, ?, ?, ?)",
            row,
        )
        return cursor.rowcount > 0

    def _has_room_for_instance(self, topic_id: int, key: bytes, most: int) -> bool:
        if most == LENGTH_UNLIMITED:
            return True
        known = self._guarded("SELECT 1 FROM sample WHERE topic = ? AND key = ? LIMIT 1", (topic_id, key)).fetchone()
        if known:
            return True
        [(count,)] = self._guarded("SELECT COUNT(DISTINCT key) FROM sample WHERE topic = ?", (topic_id,))
        return bool(count < most)

    def samples(self, topic: StoredTopic, *, after: int = 0, limit: int = 256) -> list[StoredSample]:
        """Those of one topic behind the place ``after``, in their order, ``limit`` at most."""
        rows = self._guarded(
            "SELECT id, writer, number, kind, key, payload, timestamp FROM sample WHERE topic = ? AND id > ?"
            " ORDER BY id LIMIT ?",
            (self._ids[topic], after, limit),
        )
        return [
            StoredSample(place, Guid(writer), number, ChangeKind(kind), bytes(key), bytes(payload), timestamp)
            for place, writer, number, kind, key, payload, timestamp in rows
        ]

    def last_place(self) -> int:
        """Of the sample that was added last, whether it is still there or not."""
        row = self._guarded("SELECT seq FROM sqlite_sequence WHERE name = 'sample'").fetchone()
        return int(row[0]) if row else 0

    def count(self, topic: StoredTopic) -> int:
        [(count,)] = self._guarded("SELECT COUNT(*) FROM sample WHERE topic = ?", (self._ids[topic],))
        return int(count)

    def expire(self, now: float) -> float | None:
        """Drop the ends of instances that have been kept long enough; when the next one is due, if there is any."""
        self._guarded("DELETE FROM sample WHERE expiry <= ?", (now,))
        [(due,)] = self._guarded("SELECT MIN(expiry) FROM sample")
        return None if due is None else float(due)
