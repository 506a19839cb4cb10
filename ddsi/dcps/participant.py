"""DomainParticipant: the way into a domain.  DDS 1.4 §2.2.2.2.1 (DomainParticipant).

An async context manager: inside it, its tasks run; when the body ends, peers are told, and no task or
socket is left behind.  What the body raises leaves as itself.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable
from contextlib import AbstractAsyncContextManager
from types import TracebackType
from typing import TYPE_CHECKING, Self

import trio

from ..config import Config
from ..config.environment import load_config
from ..discovery.matching import MatchRefusal
from ..engine import DataAvailable, DiscoveryChanged, Effect, StatusChanged, WriterProgress
from ..structure.builtin_entity_ids import SEDP_PUBLICATIONS_READER, SEDP_SUBSCRIPTIONS_READER
from ..structure.discovered import DiscoveredParticipantData, DiscoveredReaderData, DiscoveredWriterData
from ..structure.errors import AlreadyDeleted, BadParameter, DdsTimeout, PreconditionNotMet
from ..structure.guid import Guid
from ..structure.qos import Qos
from ..transport import Pump, PumpOptions
from .entity import Entity

if TYPE_CHECKING:
    from ..trace.sink import TraceSink

__all__ = ["DomainParticipant"]

_HIGHEST_DOMAIN = 232
_SEDP_READERS = (SEDP_PUBLICATIONS_READER, SEDP_SUBSCRIPTIONS_READER)
_LINGER_S = 1.0


class DomainParticipant(Entity):
    """A member of a domain: ``async with DomainParticipant(0) as participant: ...``

    Everything created with it is closed with it.
    """

    def __init__(
        self,
        domain_id: int = 0,
        *,
        qos: Qos | None = None,
        config: Config | None = None,
        trace: TraceSink | None = None,
    ) -> None:
        """``domain_id``: 0 to 232.  ``config``: None takes what ``DDSI_URI`` says, else the defaults.

        ``trace`` receives the events that ``docs/trace.md`` describes.  Nothing happens before ``async with``.
        """
        super().__init__(qos)
        if not isinstance(domain_id, int) or not 0 <= domain_id <= _HIGHEST_DOMAIN:
            raise BadParameter(f"a domain id is a whole number from 0 to {_HIGHEST_DOMAIN}, not {domain_id!r}")
        self._domain_id = domain_id
        self._config = config if config is not None else load_config(domain_id)
        self._trace = trace
        self._pump: Pump | None = None
        self._entities: list[Entity] = []
        self._by_guid: dict[Guid, Entity] = {}
        self._discovery_lot = trio.lowlevel.ParkingLot()
        self._manager: AbstractAsyncContextManager[trio.Nursery] | None = None
        self._nursery: trio.Nursery | None = None

    def __repr__(self) -> str:
        state = "closed" if self._is_closed else str(self._pump.engine.guid.prefix) if self._pump else "not entered"
        return f"<DomainParticipant of domain {self._domain_id}, {state}>"

    @property
    def domain_id(self) -> int:
        return self._domain_id

    @property
    def config(self) -> Config:
        return self._config

    @property
    def guid(self) -> Guid:
        return self._running_pump().engine.guid

    # --- life --------------------------------------------------------------------------------------------

    async def __aenter__(self) -> Self:
        self._check_open()
        if self._pump is not None:
            raise PreconditionNotMet("a DomainParticipant is entered once; make another for another run")
        await trio.lowlevel.checkpoint()
        self._pump = Pump(self._options(), self._perform, self._trace)
        self._manager = trio.open_nursery()
        self._nursery = await self._manager.__aenter__()
        await self._pump.run(self._nursery)
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        assert self._nursery is not None
        assert self._manager is not None
        try:
            if error is None:
                await self._linger()
        finally:
            self.close()
            self._nursery.cancel_scope.cancel()
            try:
                await self._manager.__aexit__(None, None, None)
            except BaseExceptionGroup as group:
                _raise_what_matters(group, error)

    async def _linger(self) -> None:
        """Reliable samples that are still under way get a moment to arrive."""
        pump = self._running_pump()
        pump.settle()
        with trio.move_on_after(_LINGER_S):
            for writer in pump.engine.user_writers():
                behavior = writer.behavior
                writer.wants_acknowledgment += 1
                while behavior.is_reliable and behavior.min_acked_sn() < behavior.cache.last_sn:
                    pump.engine.request_acknowledgment(writer, pump.now())
                    pump.settle()
                    with trio.move_on_after(0.01):
                        await trio.sleep_forever()

    def _on_close(self) -> None:
        for entity in reversed(self._entities):
            entity.close()
        self._discovery_lot.unpark_all()
        if self._pump is not None:
            self._pump.close()
        if self._nursery is not None:
            self._nursery.cancel_scope.cancel()

    def _options(self) -> PumpOptions:
        properties = self._qos.properties
        user_data = self._qos.user_data
        return PumpOptions(
            domain_id=self._domain_id,
            config=self._config,
            entity_name=self._qos.entity_name or "",
            user_data=user_data.value if user_data is not None else b"",
            properties=properties,
        )

    # --- who is there ------------------------------------------------------------------------------------

    def discovered_participants(self) -> list[DiscoveredParticipantData]:
        """The remote participants that are known now."""
        return [proxy.data for proxy in self._running_pump().engine.participants.values()]

    def discovered_publications(self) -> list[DiscoveredWriterData]:
        """The remote writers that are known now."""
        return list(self._running_pump().engine.known_writers.all())

    def discovered_subscriptions(self) -> list[DiscoveredReaderData]:
        """The remote readers that are known now."""
        return list(self._running_pump().engine.known_readers.all())

    def knows_all_announced(self) -> bool:
        """Has every endpoint come that the participants known now had when they were discovered?

        RTPS 2.5 §8.5.4: SEDP is transient-local, so each of its writers says at the match how much there is to come.
        """
        engine = self._running_pump().engine
        readers = (engine.local_readers[Guid.of(engine.guid.prefix, reader_id)] for reader_id in _SEDP_READERS)
        return all(proxy.has_historical_data for reader in readers for proxy in reader.behavior.writers.values())

    def match_refusals(self) -> dict[tuple[Guid, Guid], MatchRefusal]:
        """For every (own, other) pair of endpoints of one topic that does not match: why not."""
        return dict(self._running_pump().engine.matchmaker.refusals)

    def drop_counts(self) -> Counter[str]:
        """How many datagrams, submessages and announcements were not acted upon, by reason."""
        pump = self._running_pump()
        counts: Counter[str] = Counter({str(reason): count for reason, count in pump.engine.drops.items()})
        if pump.dropped_at_send:
            counts["queue_full"] += pump.dropped_at_send
        return counts

    async def wait_for_discovery(self) -> None:
        """Until the tables of remote participants and endpoints change."""
        self._check_open()
        await self._discovery_lot.park()

    def ignore_participant(self, guid: Guid) -> None:
        """Act as if that participant were not there, from now on.  DDS 1.4 §2.2.2.2.1.14."""
        pump = self._running_pump()
        pump.engine.discovery.ignore(guid, pump.now())
        pump.settle()

    def assert_liveliness(self) -> None:
        """Say that all writers of manual-by-participant liveliness are alive.  DDS 1.4 §2.2.2.2.1.20."""
        pump = self._running_pump()
        pump.engine.liveliness.assert_participant(pump.now())
        pump.settle()

    # --- inside ------------------------------------------------------------------------------------------

    def _running_pump(self) -> Pump:
        if self._is_closed:
            raise AlreadyDeleted("this DomainParticipant was closed before")
        if self._pump is None:
            raise PreconditionNotMet("enter the participant first: async with DomainParticipant(...) as participant")
        return self._pump

    def _when_running(self, action: Callable[[Pump], None]) -> None:
        """At an entity's end: act on the engine unless it is gone already."""
        if self._pump is not None:
            action(self._pump)
            self._pump.settle()

    def _adopt(self, entity: Entity) -> None:
        self._entities.append(entity)

    def _register(self, guid: Guid, entity: Entity) -> None:
        self._by_guid[guid] = entity

    def _deregister(self, guid: Guid) -> None:
        self._by_guid.pop(guid, None)

    def _perform(self, effect: Effect) -> None:
        """Act on one effect of the engine that concerns the application."""
        match effect:
            case DataAvailable(reader):
                entity = self._by_guid.get(reader)
                if entity is not None:
                    entity._has_news()
            case WriterProgress(writer):
                entity = self._by_guid.get(writer)
                if entity is not None:
                    entity._made_progress()
            case StatusChanged(guid, status):
                entity = self if guid == self._engine_guid() else self._by_guid.get(guid)
                if entity is not None:
                    entity._status_changed(status)
            case DiscoveryChanged():
                self._discovery_lot.unpark_all()

    def _engine_guid(self) -> Guid:
        assert self._pump is not None
        return self._pump.engine.guid

    async def _wait_until(
        self, entity: Entity, holds: Callable[[], bool], timeout: float | None, otherwise: str
    ) -> None:
        """Until ``holds``, looked at whenever the entity may have changed.  Raises DdsTimeout saying ``otherwise``."""
        entity._check_open()
        self._running_pump().before_waiting()
        await trio.lowlevel.checkpoint()
        with trio.fail_after(math.inf) if timeout is None else trio.move_on_after(timeout):
            while not holds():
                await entity._changed.park()
                entity._check_open()
            return
        raise DdsTimeout(f"{otherwise} after {timeout} s; `ddsi ls` shows who is there")


def _raise_what_matters(group: BaseExceptionGroup[BaseException], body_error: BaseException | None) -> None:
    """Out of what the tasks left: their own failure, unwrapped; cancellation only if nothing else is on its way."""
    _, failures = group.split(trio.Cancelled)
    leaf: BaseException = failures if failures is not None else group
    while isinstance(leaf, BaseExceptionGroup) and len(leaf.exceptions) == 1:
        leaf = leaf.exceptions[0]
    if failures is None:
        if body_error is not None:
            return
        while isinstance(leaf, BaseExceptionGroup):
            leaf = leaf.exceptions[0]
    raise leaf from None
