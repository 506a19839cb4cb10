"""Listener: methods that are called when something happens to an entity.  DDS 1.4 §2.2.4.3.

They are called in a thread of the listener's own, one for each entity, never in the engine's and never under a lock: a
listener may take its time, write, read, create and close entities, its own among them.  While it is busy, changes of
statuses queue up (1024 at most), and arrivals of data become one call.  It ends
with its entity.
"""

from __future__ import annotations

import logging
import threading
from typing import TYPE_CHECKING, Any

from .. import dcps
from ..dcps.sample_reader import SampleReader
from ..structure import status as s
from ..structure.errors import AlreadyDeleted, BadParameter, DdsError
from ..structure.status import Status

if TYPE_CHECKING:
    from ..portal.entities import EntityPortal

__all__ = ["Listener", "Listening"]

_log = logging.getLogger("ddsi.blocking")


class Listener:
    """Derive from it and override what is of interest.  ``entity`` is the one that it was given to.

    What a method raises is logged, to ``ddsi.blocking``, and changes nothing else.
    """

    def on_data_available(self, reader: Any) -> None:
        """Samples have come since the last call began; several arrivals may be one call."""

    def on_data_on_readers(self, subscriber: Any) -> None:
        """As :meth:`on_data_available`, of any reader of the subscriber that it was given to."""

    def on_publication_matched(self, writer: Any, status: s.PublicationMatched) -> None:
        """A writer gained or lost a matched reader."""

    def on_offered_incompatible_qos(self, writer: Any, status: s.OfferedIncompatibleQos) -> None:
        """A reader of the writer's topic asks for more than the writer offers."""

    def on_offered_deadline_missed(self, writer: Any, status: s.OfferedDeadlineMissed) -> None:
        """A writer did not write an instance within its deadline."""

    def on_liveliness_lost(self, writer: Any, status: s.LivelinessLost) -> None:
        """A writer of manual liveliness did not assert it in time."""

    def on_subscription_matched(self, reader: Any, status: s.SubscriptionMatched) -> None:
        """A reader gained or lost a matched writer."""

    def on_requested_incompatible_qos(self, reader: Any, status: s.RequestedIncompatibleQos) -> None:
        """A writer of the reader's topic offers less than the reader asks for."""

    def on_requested_deadline_missed(self, reader: Any, status: s.RequestedDeadlineMissed) -> None:
        """A reader did not receive an instance within its deadline."""

    def on_liveliness_changed(self, reader: Any, status: s.LivelinessChanged) -> None:
        """A matched writer is now alive, or is no longer."""

    def on_sample_lost(self, reader: Any, status: s.SampleLost) -> None:
        """Samples will never be delivered."""

    def on_sample_rejected(self, reader: Any, status: s.SampleRejected) -> None:
        """A sample was refused because of a resource limit."""

    def on_inconsistent_topic(self, entity: Any, status: s.InconsistentTopic) -> None:
        """A peer uses the topic's name with another type."""

    def on_security_refused(self, entity: Any, status: s.SecurityRefused) -> None:
        """A remote participant or endpoint was refused by security."""

    def on_security_revoked(self, participant: Any, status: s.SecurityRevoked) -> None:
        """The participant's own rights have ended: it closes."""


_METHODS: dict[type, str] = {
    s.PublicationMatched: "on_publication_matched",
    s.OfferedIncompatibleQos: "on_offered_incompatible_qos",
    s.OfferedDeadlineMissed: "on_offered_deadline_missed",
    s.LivelinessLost: "on_liveliness_lost",
    s.SubscriptionMatched: "on_subscription_matched",
    s.RequestedIncompatibleQos: "on_requested_incompatible_qos",
    s.RequestedDeadlineMissed: "on_requested_deadline_missed",
    s.LivelinessChanged: "on_liveliness_changed",
    s.SampleLost: "on_sample_lost",
    s.SampleRejected: "on_sample_rejected",
    s.InconsistentTopic: "on_inconsistent_topic",
    s.SecurityRefused: "on_security_refused",
    s.SecurityRevoked: "on_security_revoked",
}


class Listening:
    """One listener's ears at one entity: the thread that waits for what happens and calls the listener for it."""

    def __init__(self, entity: EntityPortal, listener: Listener) -> None:
        """Raises BadParameter when it is no Listener."""
        if not isinstance(listener, Listener):
            raise BadParameter(f"a listener is derived from ddsi.blocking.Listener, which {listener!r} is not")
        self._entity = entity
        self._engine = entity._running_engine()
        self._inner = entity._entity
        self._listener = listener
        self._is_stopped = False
        self._events: dcps.EventStream = self._engine.run_now(self._inner.events)
        threading.Thread(target=self._run, name="ddsi listener", daemon=True).start()

    def stop(self) -> None:
        """No more calls begin.  One that goes on is not waited for: it may be the one that asks."""
        self._is_stopped = True
        self._engine.post(self._events.close)

    def _run(self) -> None:
        while True:
            try:
                happened = self._engine.run(self._next)
            except DdsError:  # the participant has gone altogether
                return
            if happened is None or self._is_stopped:
                return
            self._call(happened)

    def _call(self, happened: Status) -> None:
        try:
            if isinstance(happened, s.DataAvailable):
                self._listener.on_data_available(self._entity)
            elif isinstance(happened, s.DataOnReaders):
                self._listener.on_data_on_readers(self._entity)
            elif method := _METHODS.get(type(happened)):
                getattr(self._listener, method)(self._entity, happened)
        except Exception as error:
            if not (isinstance(error, AlreadyDeleted) and self._inner.is_closed):  # it was closed under its hands
                _log.exception("%r failed", self._listener)

    async def _next(self) -> Status | None:
        """In the engine's thread: what happens next; None at the end."""
        try:
            happened = await self._events.__anext__()
        except StopAsyncIteration:
            return None
        if isinstance(happened, s.DataAvailable) and isinstance(self._inner, SampleReader):
            if self._inner.is_closed:
                return None
            self._inner._tell()
        return happened
