"""Fetching: what is iterated over in ``ddsi.blocking`` and ``ddsi.aio``, brought over from the engine's thread.

Not part of DDS.  What was fetched is put aside, not returned: so nothing is lost when whoever asked is cancelled or
interrupted just then.  The iteration itself, which waits, is the faces'.
"""

from __future__ import annotations

from collections import deque
from typing import Generic, TypeVar

from .. import dcps
from ..structure.status import Status
from .engine_thread import EngineThread
from .entities import EntityPortal

__all__ = ["EventStreamPortal", "Fetching"]

T = TypeVar("T")


class Fetching(Generic[T]):
    """The base of readers and event streams, which set both attributes.

    Several tasks or threads may iterate at once: what one has fetched another may be handed.
    """

    _engine: EngineThread
    _fetched: deque[T]

    def _is_at_end(self) -> bool:
        """Can no more be fetched?"""
        raise NotImplementedError

    async def _fetch(self) -> None:
        """In the engine's thread: wait for one at least, and put it aside; at the end, leave without."""
        raise NotImplementedError


class EventStreamPortal(Fetching[Status]):
    """The statuses of one entity as they change."""

    def __init__(self, entity: EntityPortal) -> None:
        self._engine = entity._running_engine()
        self._stream: dcps.EventStream = self._engine.run_now(entity._entity.events)
        self._fetched: deque[Status] = deque()
        self._has_ended = False

    @property
    def dropped(self) -> int:
        """How many were forgotten because more than 1024 waited unread."""
        return self._stream.dropped

    def _is_at_end(self) -> bool:
        return self._has_ended

    async def _fetch(self) -> None:
        try:
            self._fetched.append(await self._stream.__anext__())
        except StopAsyncIteration:
            self._has_ended = True
