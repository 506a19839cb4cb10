"""DomainParticipant: the way into a domain.  DDS 1.4 §2.2.2.2.1 (DomainParticipant).

An async context manager: inside it, its tasks run; when the body ends, peers are told, and no task or
socket is left behind.  What the body raises leaves as itself.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from types import TracebackType
from typing import TYPE_CHECKING, Any, ClassVar, Self
from weakref import WeakValueDictionary

import trio

from ..config import Config
from ..config.environment import load_config
from ..config.secure import participant_properties
from ..discovery.explanation import Explanation
from ..discovery.matching import MatchRefusal
from ..engine import (
    DataAvailable,
    DiscoveryChanged,
    Effect,
    LocalWriter,
    MatchRefused,
    StatusChanged,
    WriterProgress,
    participant_data,
)
from ..structure import builtin_entity_ids as ids
from ..structure.builtin_topic_data import ParticipantBuiltinTopicData
from ..structure.discovered import DiscoveredParticipantData, DiscoveredReaderData, DiscoveredWriterData
from ..structure.errors import AlreadyDeleted, BadParameter, DdsTimeout, PreconditionNotMet
from ..structure.guid import Guid
from ..structure.qos import Qos
from ..structure.qos_changes import check_changeable
from ..structure.qos_concerns import QosOwner
from ..structure.status import SecurityRefused, SecurityRevoked
from ..transport import Pump, PumpOptions
from .endpoint import Endpoint
from .entity import Entity, Parent, deadline_scope
from .explaining import explain_all
from .lifetime import Lifetime
from .refusal_log import RefusalLog
from .topic import Topic
from .type_access import AnnouncedEndpoint, fetch_type_object, fetch_type_objects
from .type_discovery import endpoint_type, find_type

if TYPE_CHECKING:
    from ..trace.sink import TraceSink
    from ..xtypes.type_object import BuiltTypes, TypeIdentifier, TypeObject

__all__ = ["DomainParticipant"]

_HIGHEST_DOMAIN = 232
_SEDP_READERS = (
    ids.SEDP_PUBLICATIONS_READER,
    ids.SEDP_SUBSCRIPTIONS_READER,
    ids.SEDP_PUBLICATIONS_SECURE_READER,
    ids.SEDP_SUBSCRIPTIONS_SECURE_READER,
)
_LINGER_S = 1.0
_LINGER_LOOK_S = 0.01


class DomainParticipant(Parent):
    """A member of a domain: ``async with DomainParticipant(0) as participant: ...``

    Everything created with it is closed with it.
    """

    _QOS_OWNER: ClassVar[QosOwner] = "participant"
    STATUSES: ClassVar[tuple[type, ...]] = (SecurityRefused, SecurityRevoked)

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
        if config is not None and not isinstance(config, Config):
            raise BadParameter(f"DomainParticipant: config is a ddsi.Config(...), not {config!r}")
        self._domain_id = domain_id
        self._config = config if config is not None else load_config(domain_id)
        self._trace = trace
        self._pump: Pump | None = None
        self._lifetime: Lifetime | None = None
        self._by_guid: dict[Guid, Entity] = {}
        self._discovery_lot = trio.lowlevel.ParkingLot()
        self._refusal_log = RefusalLog()
        self._dynamic_types: WeakValueDictionary[tuple[str, bytes], type[Any]] = WeakValueDictionary()

    def __repr__(self) -> str:
        state = "closed" if self._is_closed else str(self._pump.engine.guid.prefix) if self._pump else "not entered"
        return f"<DomainParticipant of domain {self._domain_id}, {state}>"

    @property
    def participant(self) -> DomainParticipant:
        return self

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

    @trio.lowlevel.enable_ki_protection
    async def __aenter__(self) -> Self:
        self._check_open()
        self._check_in_trio()
        if self._pump is not None:
            raise PreconditionNotMet(f"{self!r} was entered before; a DomainParticipant is entered once, make another")
        await trio.lowlevel.checkpoint()
        pump = Pump(self._options(), self._perform, self._trace)
        self._pump = pump
        try:
            pump.start()
            self._lifetime = Lifetime(pump.run)
            await self._lifetime.enter()
        except BaseException:
            self.close()
            raise
        return self

    if not TYPE_CHECKING:  # type checkers refuse a plain `with` by themselves

        def __enter__(self):
            raise PreconditionNotMet(
                f"{self!r} is entered by `async with`; `with` is for DomainParticipant of ddsi.blocking"
            )

        def __exit__(self, *error):
            """Never called; Python looks for it before ``__enter__``."""

    @trio.lowlevel.enable_ki_protection
    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        assert self._lifetime is not None
        leaving = error
        try:
            if error is None and not self._is_closed:
                await self._linger()
        except BaseException as interruption:
            leaving = interruption
        try:
            self.close()
        except Exception as failure:  # whatever it is, the tasks and sockets are gone
            leaving = leaving or failure
        await self._lifetime.leave(leaving)
        if leaving is not error and leaving is not None:
            raise leaving

    async def _linger(self) -> None:
        """Reliable samples that are still under way to other participants get a moment to arrive."""
        pump = self._running_pump()
        for endpoint in self._endpoints():
            endpoint._say_farewell()
        pump.settle()
        with trio.move_on_after(_LINGER_S):
            while lagging := [writer for writer in pump.engine.user_writers() if _has_samples_under_way(writer)]:
                for writer in lagging:
                    pump.engine.request_acknowledgment(writer, pump.now())
                pump.settle()
                await trio.sleep(_LINGER_LOOK_S)

    def _on_close(self) -> None:
        try:
            super()._on_close()
        finally:
            self._discovery_lot.unpark_all()
            if self._pump is not None:
                self._pump.close()

    def abandon(self) -> None:
        """In the child of a fork: it is the parent's, so end it here without a word, nor a look at its tasks."""
        self._is_closed = True
        if self._pump is not None:
            self._pump.abandon()

    def _options(self) -> PumpOptions:
        user_data = self._qos.user_data
        return PumpOptions(
            domain_id=self._domain_id,
            config=self._config,
            entity_name=self._qos.entity_name or "",
            user_data=user_data.value if user_data is not None else b"",
            properties=participant_properties(self._qos.properties, self._config),
        )

    def _change_qos(self, after: Qos) -> None:
        if self._pump is not None:
            check_changeable(self._qos, after, "a DomainParticipant")
            user_data = after.user_data.value if after.user_data is not None else b""
            self._pump.engine.qos_changes.change_user_data(user_data, self._pump.now())
            self._pump.settle()
        self._own_qos = self._qos = after

    def lookup_topicdescription(self, name: str) -> Topic[Any] | None:
        """A topic of this participant, by its name; None: there is none.  DDS 1.4 §2.2.2.2.1.13."""
        return next((entity for entity in self._members if isinstance(entity, Topic) and entity.name == name), None)

    def _endpoints(self) -> list[Endpoint]:
        """All writers and readers of topics, wherever they belong to."""
        return [entity for entity in self._by_guid.values() if isinstance(entity, Endpoint)]

    # --- who is there ------------------------------------------------------------------------------------

    def discovered_participants(self) -> list[DiscoveredParticipantData]:
        """The remote participants that are known now, without those that security has not admitted (yet)."""
        return [proxy.data for proxy in self._running_pump().engine.participants.values() if proxy.is_admitted]

    def discovered_participant_data(self, handle: Guid) -> ParticipantBuiltinTopicData:
        """What is known of a participant: what it announces of itself, and who it is where it is authenticated.

        ``handle``: its Guid, the ``participant_key`` of an endpoint's data; our own participant's is known too.  Raises
        BadParameter when there is none, or security has not admitted it.

        DDS 1.4 §2.2.2.2.1 (get_discovered_participant_data).
        """
        engine = self._running_pump().engine
        if handle == engine.guid:
            return participant_data(engine.discovery.data, engine.hooks)
        proxy = engine.participants.get(handle[:12])
        if proxy is None or proxy.guid != handle or not proxy.is_admitted:
            raise BadParameter(f"{self!r} knows no participant {handle!r}, or not yet, or no longer")
        return participant_data(proxy.data, engine.hooks)

    def discovered_publications(self) -> list[DiscoveredWriterData]:
        """The remote writers that are known now."""
        return list(self._running_pump().engine.known_writers.all())

    def discovered_subscriptions(self) -> list[DiscoveredReaderData]:
        """The remote readers that are known now."""
        return list(self._running_pump().engine.known_readers.all())

    async def type_objects(self, endpoint: AnnouncedEndpoint, *, timeout: float | None = 10.0) -> BuiltTypes:
        """What the type of a remote writer or reader is made of: its TypeObject, complete where the peer has that, and
        those of all types that it needs; from the endpoint's participant where they are not known yet.

        Raises PreconditionNotMet, saying why, where there is nothing to be had (the endpoint announces no type
        information, or its participant does not know or does not answer), and DdsTimeout after ``timeout`` seconds.

        DDS-XTypes 1.3 §7.6.3.3.  See ``dcps/type_access.py`` for an example.
        """
        return await fetch_type_objects(self, endpoint, timeout)

    async def type_object(self, identifier: TypeIdentifier, owner: Guid, *, timeout: float | None = 10.0) -> TypeObject:
        """One TypeObject; ``owner`` is the participant, or an endpoint of it, that is asked where it is not known yet.

        Raises as :meth:`type_objects` does, and BadParameter for an identifier that stands for no TypeObject.
        """
        return await fetch_type_object(self, identifier, owner, timeout)

    async def discover_type(self, topic_name: str, *, timeout: float | None = 10.0) -> type[Any]:
        """The type of a topic that others write or read, as a class for ``Topic(participant, topic_name, ...)``.

        Waits until somebody announces the topic and tells its type; of several types, the first that can be had, of
        writers before readers.  It is that of :func:`ddsi.dynamic_type`.

        Raises DdsTimeout when nobody announced the topic within ``timeout`` seconds, and PreconditionNotMet, saying
        why, where those who did tell no more than the type's name: then the program must bring the type (``idl.load``).
        """
        return await find_type(self, topic_name, timeout)

    async def endpoint_type(self, endpoint: AnnouncedEndpoint, *, timeout: float | None = 10.0) -> type[Any]:
        """The type of one remote writer or reader, as a class.  Raises as :meth:`type_objects` does."""
        return await endpoint_type(self, endpoint, timeout)

    def knows_all_announced(self) -> bool:
        """Has every endpoint come that the participants known now had when they were discovered?

        RTPS 2.5 §8.5.4: SEDP is transient-local, so each of its writers says at the match how much there is to come.
        """
        builtin = self._running_pump().engine.builtin
        readers = [reader for reader_id in _SEDP_READERS if (reader := builtin.reader(reader_id)) is not None]
        return all(proxy.has_historical_data for reader in readers for proxy in reader.behavior.writers.values())

    def match_refusals(self) -> dict[tuple[Guid, Guid], MatchRefusal]:
        """For every (own, other) pair of endpoints of one topic that does not match: why not."""
        return dict(self._running_pump().engine.matchmaker.refusals)

    def explain(self, *asked: str | Guid) -> Explanation:
        """Why writers and readers match or do not: for every pair, all that stands between the two, with remedies.

        ``asked``: a topic's name or a shell pattern of names; or an endpoint's Guid; or two Guids and more, which are
        compared whatever their topics are.  Nothing: all topics.  It is of our endpoints and of others', and these are
        judged by what they announce.  Where their types must be asked for first, ``is_complete`` is False: ask once
        more a moment later.

        Raises BadParameter for a mixture, for two names, and for Guids that are all of writers or all of readers.
        """
        return explain_all(self, asked)

    def drop_counts(self) -> Counter[str]:
        """How many datagrams, submessages and announcements were not acted upon, by reason."""
        pump = self._running_pump()
        counts: Counter[str] = Counter({str(reason): count for reason, count in pump.engine.drops.items()})
        if pump.dropped_at_send:
            counts["queue_full"] += pump.dropped_at_send
        return counts

    async def wait_for_discovery(self) -> None:
        """Until the tables of remote participants and endpoints change.  Raises AlreadyDeleted when they never will."""
        self._running_pump()
        await self._discovery_lot.park()
        self._check_open()

    def ignore_participant(self, guid: Guid) -> None:
        """Act as if that participant were not there, from now on.  DDS 1.4 §2.2.2.2.1.14."""
        pump = self._running_pump()
        pump.engine.discovery.ignore(guid, pump.now())
        pump.settle()

    def ignore_publication(self, guid: Guid) -> None:
        """Act as if that remote writer were not there, from now on.  DDS 1.4 §2.2.2.2.1.16."""
        pump = self._running_pump()
        pump.engine.discovery.ignore_endpoint(guid, pump.now())
        pump.settle()

    def ignore_subscription(self, guid: Guid) -> None:
        """Act as if that remote reader were not there, from now on.  DDS 1.4 §2.2.2.2.1.17."""
        self.ignore_publication(guid)

    def ignore_topic(self, topic_name: str) -> None:
        """Act as if no remote participant had writers or readers of that topic, from now on.  DDS 1.4 §2.2.2.2.1.15."""
        pump = self._running_pump()
        pump.engine.discovery.ignore_topic(topic_name, pump.now())
        pump.settle()

    def assert_liveliness(self) -> None:
        """Say that all writers of manual-by-participant liveliness are alive.  DDS 1.4 §2.2.2.2.1.20."""
        pump = self._running_pump()
        pump.engine.liveliness.assert_participant(pump.now())
        pump.settle()

    # --- inside ------------------------------------------------------------------------------------------

    def _check_in_trio(self) -> None:
        try:
            trio.lowlevel.current_task()
        except RuntimeError:
            raise PreconditionNotMet(
                f"{self!r} lives in trio, which does not run here: start the program by `trio.run(main)`, or take "
                "DomainParticipant of ddsi.aio for asyncio, of ddsi.blocking for a plain script or thread"
            ) from None

    def _running_pump(self) -> Pump:
        if self._is_closed:
            self._check_not_revoked()
            raise AlreadyDeleted(f"{self!r}: what was asked needs a participant that is open; make another")
        if self._pump is None:
            raise PreconditionNotMet(
                f"{self!r}: enter it first, by `async with DomainParticipant(...) as participant:`"
            )
        return self._pump

    def _when_running(self, action: Callable[[Pump], None]) -> None:
        """At an entity's end: act on the engine unless it is gone already."""
        if self._pump is not None and not self._pump.is_closed:
            action(self._pump)
            self._pump.settle()

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
                if isinstance(status, SecurityRevoked):
                    self._end_revoked(status.reason)
            case MatchRefused(local, remote):
                if self._pump is not None:
                    self._refusal_log.tell(self._pump.engine, local, remote)
            case DiscoveryChanged():
                self._discovery_lot.unpark_all()

    def _end_revoked(self, reason: str) -> None:
        """Our rights have ended.  Not at once: somebody is in the middle of acting on the engine's effects."""

        def end() -> None:
            if not self._is_closed:
                self._revoke(reason)
                self.close()

        self._running_pump().call_soon(end)

    def _engine_guid(self) -> Guid:
        assert self._pump is not None
        return self._pump.engine.guid

    async def _wait_until(
        self, entity: Entity, holds: Callable[[], bool], timeout: float | None, otherwise: str
    ) -> None:
        """Until ``holds``, looked at whenever the entity may have changed.  Raises DdsTimeout saying ``otherwise``."""
        entity._check_open()
        scope = deadline_scope(timeout)
        self._running_pump().before_waiting()
        await trio.lowlevel.checkpoint()
        with scope:
            while True:
                entity._check_open()  # whenever others had their turn: nobody wakes who begins to wait afterwards
                if holds():
                    return
                await entity._changed.park()
        raise DdsTimeout(f"{otherwise} after {timeout} s; `ddsi ls` shows who is there")


def _has_samples_under_way(writer: LocalWriter) -> bool:
    behavior = writer.behavior
    last_sn = behavior.cache.last_sn
    return behavior.is_reliable and any(
        proxy.is_reliable and proxy.acked_sn < last_sn for proxy in behavior.readers.values()
    )
