"""NodeWriter and NodeReader: endpoints of simulated participants that remember what they wrote and were given.

Their payloads stand in for samples of a type: an encapsulation header, a key of one octet where the topic is keyed,
and octets that follow from writer and number, so that what arrives can be told to be what was sent.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from hashlib import md5
from typing import TYPE_CHECKING

from ..behavior.reader_history_cache import ReaderHistoryCache
from ..behavior.stateful_reader import ChangeSink
from ..behavior.writer_proxy import WriterProxy
from ..engine import KeyCodec, LocalReader, LocalWriter, Participant
from ..engine.recorder import Recorder
from ..structure.cache_change import CacheChange, ChangeKind
from ..structure.errors import MalformedSample
from ..structure.guid import GUID_UNKNOWN, Guid
from ..structure.qos import Qos, reader_qos, writer_qos
from ..structure.sample_info import SampleInfo
from ..trace.sink import TraceSink

if TYPE_CHECKING:
    from .node import Node

__all__ = ["SIMULATED_KEYS", "BookKeeper", "NodeReader", "NodeWriter", "ReadingBook", "ReadingSession", "payload_of"]

_HEADER = b"\x00\x01\x00\x00"  # CDR_LE


def payload_of(writer: Guid, sequence_number: int, size: int, key: int = 0) -> bytes:
    """The octets of one sample, ``size`` of them behind the header and the key."""
    pattern = writer[12:] + sequence_number.to_bytes(4, "little")
    return _HEADER + bytes((key,)) + (pattern * (size // len(pattern) + 1))[:size]


def _key_of_payload(payload: bytes | bytearray | memoryview) -> bytes:
    if len(payload) < 5 or bytes(payload[:4]) != _HEADER:
        raise MalformedSample("no header and key")
    return bytes(payload[4:5])


SIMULATED_KEYS = KeyCodec(
    from_payload=_key_of_payload,
    from_key_payload=_key_of_payload,
    from_key_hash=lambda key_hash: key_hash[:1],
    to_key_hash=lambda key: key.ljust(16, b"\0"),
    to_secret_key_hash=lambda key: md5(key, usedforsecurity=False).digest(),
)
"""The key is the first octet behind the encapsulation header; its hash is itself, padded."""


class NodeWriter:
    """A writer and the book of what it wrote.  ``written``: every change, by number."""

    def __init__(self, node: Node, local: LocalWriter) -> None:
        self.node = node
        self.local = local
        self.guid = local.guid
        self.topic = local.data.topic_name
        self.is_keyed = local.data.is_keyed
        self.written: dict[int, CacheChange] = {}
        self.refused = 0  # writes that would have had to wait
        self.is_deleted = False

    def __repr__(self) -> str:
        return f"<NodeWriter {self.topic} of {self.node.name}, {len(self.written)} written>"

    @property
    def matched_count(self) -> int:
        return self.local.matched.current_count

    def write(self, size: int = 8, key: int = 0, *, destination: Guid = GUID_UNKNOWN) -> CacheChange | None:
        """Write a sample of ``size`` octets; None where an application would have had to wait for room."""
        payload = payload_of(self.guid, self.local.behavior.cache.last_sn + 1, size, key if self.is_keyed else 0)
        return self._change(ChangeKind.ALIVE, payload, key, destination)

    def end(self, kind: ChangeKind, key: int = 0) -> CacheChange | None:
        """Dispose or unregister an instance."""
        return self._change(kind, payload_of(self.guid, 0, 0, key), key, GUID_UNKNOWN)

    def _change(self, kind: ChangeKind, payload: bytes, key: int, destination: Guid) -> CacheChange | None:
        canonical = bytes((key,)) if self.is_keyed else b""
        if self.local.behavior.lacks_room(len(payload), canonical) is not None:
            self.refused += 1
            return None
        node = self.node
        key_hash = SIMULATED_KEYS.to_key_hash(canonical) if kind is not ChangeKind.ALIVE else b""
        change = node.engine.write(
            self.local, kind, payload, canonical, node.now, key_hash=key_hash, destination=destination
        )
        self.written[change.sequence_number] = change
        node.pump()
        return change

    def change(self, qos: Qos) -> None:
        """Change policies: what ``qos`` does not set becomes the default.  Raises as applications are refused."""
        keys = dict.fromkeys(change.key for change in self.written.values())
        self.node.engine.qos_changes.change_writer(self.local, writer_qos(qos), self.node.now, keys)
        self.node.pump()

    def delete(self) -> None:
        """Delete the writer, politely: it lingers for what is not acknowledged."""
        self.is_deleted = True
        self.node.engine.delete_writer(self.local, self.node.now)
        self.node.pump()


@dataclass(slots=True)
class ReadingSession:
    """What one reader was given by one writer, from one match to its end; a writer that was lost and found again
    begins another."""

    proxy: WriterProxy | None
    changes: list[CacheChange] = field(default_factory=list)

    @property
    def numbers(self) -> list[int]:
        return [change.sequence_number for change in self.changes]


class NodeReader:
    """A reader and the book of what it was given.

    ``sessions``: by writer, what came in order out of the protocol.  ``taken``: what the application took
    from the history cache, where KEEP_LAST may have replaced samples.  With ``takes`` it takes whatever is there at
    once.
    """

    def __init__(self, node: Node, local: LocalReader, book: ReadingBook, *, takes: bool) -> None:
        assert local.history is not None
        self.node = node
        self.local = local
        self.guid = local.guid
        self.topic = local.data.topic_name
        self.takes = takes
        self.history: ReaderHistoryCache = local.history
        self.sessions = book.sessions
        self.taken: list[tuple[SampleInfo, CacheChange]] = []
        self.is_deleted = False

    def __repr__(self) -> str:
        return f"<NodeReader {self.topic} of {self.node.name}, {sum(map(len, self.sessions.values()))} sessions>"

    @property
    def matched_count(self) -> int:
        return self.local.matched.current_count

    def session(self, writer: Guid) -> ReadingSession:
        """The present session with a writer, or the last one; an empty one if there was none."""
        return self.sessions.get(writer, [ReadingSession(None)])[-1]

    def take(self) -> list[tuple[SampleInfo, CacheChange]]:
        """Take all that is there, as an application would."""
        self.history.seen()
        taken = self.history.take()
        self.taken.extend(taken)
        if taken:
            self.node.engine.samples_taken(self.local, self.node.now)
            self.node.pump()
        return taken

    def hurry(self) -> None:
        """From here on take whatever is there at once."""
        self.takes = True
        while self.take():
            pass

    def change(self, qos: Qos) -> None:
        """Change policies: what ``qos`` does not set becomes the default.  Raises as applications are refused."""
        self.node.engine.qos_changes.change_reader(self.local, reader_qos(qos), self.node.now)
        self.node.pump()

    def delete(self) -> None:
        self.is_deleted = True
        self.node.engine.delete_reader(self.local, self.node.now)
        self.node.pump()


class ReadingBook:
    """A ChangeSink in front of a reader's history: notes what that accepted, from the first sample on."""

    def __init__(self, engine: Participant, reader: Guid, history: ChangeSink) -> None:
        self.sessions: dict[Guid, list[ReadingSession]] = {}
        self._engine = engine
        self._reader = reader
        self._history = history

    def add(self, change: CacheChange, now: float) -> bool:
        accepted = self._history.add(change, now)
        if accepted:
            self._note(change)
        return accepted

    def _note(self, change: CacheChange) -> None:
        proxy = self._engine.local_readers[self._reader].behavior.writers.get(change.writer_guid)
        sessions = self.sessions.setdefault(change.writer_guid, [])
        # Without a proxy the match has just ended, and what waited behind a gap is handed over.
        if not sessions or (proxy is not None and sessions[-1].proxy is not proxy):
            sessions.append(ReadingSession(proxy))
        sessions[-1].changes.append(change)


class BookKeeper(Recorder):
    """The engine's recorder, which also keeps a book for each reader, trace or no trace."""

    def __init__(self, engine: Participant, trace: TraceSink | None) -> None:
        super().__init__(engine, trace)
        self._participant = engine
        self.books: dict[Guid, ReadingBook] = {}

    def delivering(self, reader: Guid, history: ChangeSink) -> ChangeSink:
        book = self.books[reader] = ReadingBook(self._participant, reader, super().delivering(reader, history))
        return book
