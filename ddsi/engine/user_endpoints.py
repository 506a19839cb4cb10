"""UserEndpoints: the application's writers and readers that take part, by topic.

DDS 1.4 §2.2.2.1.1.7 (enable): an endpoint that is not enabled is in the participant's tables, where it can be deleted,
but nobody is told of it, and it is matched with nobody.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeVar

from ..structure.guid import Guid
from .local_endpoints import LocalReader, LocalWriter

if TYPE_CHECKING:
    from .participant import Participant

__all__ = ["UserEndpoints"]

_Endpoint = TypeVar("_Endpoint", LocalWriter, LocalReader)
_ByTopic = dict[str, dict[Guid, _Endpoint]]


class UserEndpoints:
    """All that it returns is in the order in which endpoints were enabled, topic by topic."""

    def __init__(self, engine: Participant) -> None:
        self._engine = engine
        self._writers: _ByTopic[LocalWriter] = {}
        self._readers: _ByTopic[LocalReader] = {}

    def writers(self, topic_name: str | None = None) -> list[LocalWriter]:
        """Of all topics or of one."""
        return _endpoints(self._writers, topic_name)

    def readers(self, topic_name: str | None = None) -> list[LocalReader]:
        """Of all topics or of one."""
        return _endpoints(self._readers, topic_name)

    def enable_writer(self, writer: LocalWriter, now: float) -> None:
        """Announce and match it."""
        engine = self._engine
        engine.now = now
        self._writers.setdefault(writer.data.topic_name, {})[writer.guid] = writer
        engine.recorder.endpoint_created(writer.data)
        engine.discovery.announce_writer(writer, now)
        engine.liveliness.writer_added(writer, now)
        engine.matchmaker.writer_appeared(writer, now)

    def enable_reader(self, reader: LocalReader, now: float) -> None:
        """Announce and match it."""
        engine = self._engine
        engine.now = now
        self._readers.setdefault(reader.data.topic_name, {})[reader.guid] = reader
        engine.recorder.endpoint_created(reader.data)
        engine.discovery.announce_reader(reader, now)
        engine.matchmaker.reader_appeared(reader, now)

    def remove_writer(self, writer: LocalWriter) -> bool:
        """It is deleted; False: it was never enabled, and nobody knows of it."""
        return _remove(self._writers, writer)

    def remove_reader(self, reader: LocalReader) -> bool:
        return _remove(self._readers, reader)


def _endpoints(table: _ByTopic[_Endpoint], topic_name: str | None) -> list[_Endpoint]:
    if topic_name is not None:
        return list(table.get(topic_name, {}).values())
    return [endpoint for of_topic in table.values() for endpoint in of_topic.values()]


def _remove(table: _ByTopic[_Endpoint], endpoint: _Endpoint) -> bool:
    of_topic = table.get(endpoint.data.topic_name, {})
    if of_topic.pop(endpoint.guid, None) is None:
        return False
    if not of_topic:
        del table[endpoint.data.topic_name]
    return True
