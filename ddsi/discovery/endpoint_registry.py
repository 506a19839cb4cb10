"""EndpointRegistry: every endpoint that remote participants announced, found by topic.

RTPS 2.5 §8.5.4 (SEDP).  Strangers fill this table, so it is bounded: in all, and per participant; what does not
fit is not stored and counted by the caller.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Generic, TypeVar

from ..structure.discovered import DiscoveredEndpointData
from ..structure.guid import Guid

__all__ = ["EndpointRegistry"]

Endpoint = TypeVar("Endpoint", bound=DiscoveredEndpointData)


class EndpointRegistry(Generic[Endpoint]):
    """Announced endpoints of one kind (writers or readers), by Guid and by topic name."""

    __slots__ = ("_by_guid", "_by_topic")

    def __init__(self) -> None:
        self._by_guid: dict[Guid, Endpoint] = {}
        self._by_topic: dict[str, dict[Guid, Endpoint]] = {}

    def __len__(self) -> int:
        return len(self._by_guid)

    def get(self, guid: Guid) -> Endpoint | None:
        return self._by_guid.get(guid)

    def put(self, data: Endpoint) -> Endpoint | None:
        """Add or replace; returns what was known before."""
        before = self.remove(data.guid)
        self._by_guid[data.guid] = data
        self._by_topic.setdefault(data.topic_name, {})[data.guid] = data
        return before

    def remove(self, guid: Guid) -> Endpoint | None:
        data = self._by_guid.pop(guid, None)
        if data is not None:
            of_topic = self._by_topic[data.topic_name]
            del of_topic[guid]
            if not of_topic:
                del self._by_topic[data.topic_name]
        return data

    def of_topic(self, topic_name: str) -> list[Endpoint]:
        return list(self._by_topic.get(topic_name, {}).values())

    def of_participant(self, prefix: bytes) -> list[Endpoint]:
        return [data for guid, data in self._by_guid.items() if guid.startswith(prefix)]

    def all(self) -> Iterable[Endpoint]:
        return self._by_guid.values()
