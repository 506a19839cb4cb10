"""EndpointRegistry: every endpoint that remote participants announced, found by topic and by participant.

RTPS 2.5 §8.5.4 (SEDP).  Strangers fill this table.  Its bound, and who gives way when it is reached, is its user's
affair (``engine.eviction``), as writers and readers share one bound.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Generic, TypeVar

from ..structure.discovered import DiscoveredEndpointData
from ..structure.guid import Guid, GuidPrefix

__all__ = ["EndpointRegistry"]

Endpoint = TypeVar("Endpoint", bound=DiscoveredEndpointData)


class EndpointRegistry(Generic[Endpoint]):
    """Announced endpoints of one kind (writers or readers).  All that it returns is in the order of announcement."""

    __slots__ = ("_by_guid", "_by_prefix", "_by_topic")

    def __init__(self) -> None:
        self._by_guid: dict[Guid, Endpoint] = {}
        self._by_topic: dict[str, dict[Guid, Endpoint]] = {}
        self._by_prefix: dict[GuidPrefix, dict[Guid, Endpoint]] = {}

    def __len__(self) -> int:
        return len(self._by_guid)

    def get(self, guid: Guid) -> Endpoint | None:
        return self._by_guid.get(guid)

    def put(self, data: Endpoint) -> Endpoint | None:
        """Add or replace; returns what was known before."""
        before = self.remove(data.guid)
        self._by_guid[data.guid] = data
        self._by_topic.setdefault(data.topic_name, {})[data.guid] = data
        self._by_prefix.setdefault(data.guid.prefix, {})[data.guid] = data
        return before

    def remove(self, guid: Guid) -> Endpoint | None:
        data = self._by_guid.pop(guid, None)
        if data is not None:
            _take_out(self._by_topic, data.topic_name, guid)
            _take_out(self._by_prefix, guid.prefix, guid)
        return data

    def of_topic(self, topic_name: str) -> list[Endpoint]:
        return list(self._by_topic.get(topic_name, {}).values())

    def of_participant(self, prefix: GuidPrefix) -> list[Endpoint]:
        return list(self._by_prefix.get(prefix, {}).values())

    def all(self) -> Iterable[Endpoint]:
        return self._by_guid.values()


_Key = TypeVar("_Key", str, GuidPrefix)


def _take_out(index: dict[_Key, dict[Guid, Endpoint]], key: _Key, guid: Guid) -> None:
    del index[key][guid]
    if not index[key]:
        del index[key]
