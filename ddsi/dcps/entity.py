"""Entity: what all DCPS entities share - a Qos, statuses as values and as a stream of events, and an end.

DDS 1.4 §2.2.2.1.1 (Entity), §2.2.4 (Listeners, Conditions and Wait-sets; here: ``async for``).
"""

from __future__ import annotations

from collections import deque
from collections.abc import AsyncIterator
from typing import TypeVar

import trio

from ..structure.errors import AlreadyDeleted
from ..structure.qos import Qos
from ..structure.status import Status

__all__ = ["Entity", "EventStream"]

_S = TypeVar("_S")
_MAX_EVENTS = 1024
_MAX_EARLY_EVENTS = 64


class EventStream(AsyncIterator[Status]):
    """The statuses of one entity as they change.  It ends when the entity is closed.

    At most 1024 wait unread; then the oldest are forgotten and :attr:`dropped` counts them.
    """

    def __init__(self, early: deque[Status]) -> None:
        self._events = deque(early)
        self._lot = trio.lowlevel.ParkingLot()
        self._is_closed = False
        self.dropped = 0

    def put(self, event: Status) -> None:
        if len(self._events) >= _MAX_EVENTS:
            self._events.popleft()
            self.dropped += 1
        self._events.append(event)
        self._lot.unpark_all()

    def close(self) -> None:
        self._is_closed = True
        self._lot.unpark_all()

    def __aiter__(self) -> EventStream:
        return self

    async def __anext__(self) -> Status:
        await trio.lowlevel.checkpoint_if_cancelled()
        while not self._events:
            if self._is_closed:
                raise StopAsyncIteration
            await self._lot.park()
        return self._events.popleft()


class Entity:
    """The base of all entities.  ``close()`` is synchronous, may be called twice, and closes what is inside first."""

    def __init__(self, qos: Qos | None) -> None:
        self._qos = qos if qos is not None else Qos()
        self._is_closed = False
        self._changed = trio.lowlevel.ParkingLot()
        self._statuses: dict[type, Status] = {}
        self._streams: list[EventStream] = []
        # What happened before anybody listened (a match within the participant happens at once).
        self._early_events: deque[Status] = deque(maxlen=_MAX_EARLY_EVENTS)

    @property
    def qos(self) -> Qos:
        """The Qos that the entity was given."""
        return self._qos

    @property
    def is_closed(self) -> bool:
        return self._is_closed

    def events(self) -> EventStream:
        """The communication statuses from now on (the first caller also gets what came before), one event a change."""
        stream = EventStream(self._early_events)
        self._early_events.clear()
        if self._is_closed:
            stream.close()
        self._streams.append(stream)
        return stream

    def status(self, kind: type[_S]) -> _S:
        """The present value of one status, for instance ``writer.status(PublicationMatched).current_count``."""
        value = self._statuses.get(kind)
        return value if isinstance(value, kind) else kind()

    def close(self) -> None:
        """End the entity; what it held is released at once, and peers are told."""
        if self._is_closed:
            return
        self._is_closed = True
        self._on_close()
        self._changed.unpark_all()
        for stream in self._streams:
            stream.close()

    def _on_close(self) -> None:
        """What the kind of entity does at its end."""

    def _has_news(self) -> None:
        """A reader: there are samples to take."""

    def _made_progress(self) -> None:
        """A writer: something was acknowledged."""

    def _status_changed(self, status: Status) -> None:
        self._changed.unpark_all()
        self._statuses[type(status)] = status
        if not self._streams:
            self._early_events.append(status)
        for stream in self._streams:
            stream.put(status)

    def _check_open(self) -> None:
        if self._is_closed:
            raise AlreadyDeleted(f"this {type(self).__name__} was closed before")
