"""PersistenceService: keeps what durable writers write, beyond their lives and its own.

DDS 1.4 §2.2.3.4 (DURABILITY), §2.2.3.5 (DURABILITY_SERVICE).  The specification leaves it to a service that it does not
describe; this is one, for writers and readers of any vendor.  One per domain is enough.  What it does for each topic is
told in :mod:`.durable_topic`.
"""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import suppress
from fnmatch import fnmatchcase
from os import PathLike, fspath
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self

import trio

from ..discovery.endpoint_parameters import encode_writer
from ..storage import SampleStore, StoredTopic
from ..structure.discovered import DiscoveredWriterData
from ..structure.errors import AlreadyDeleted, DdsTimeout, NotAllowedBySecurity, PreconditionNotMet
from ..structure.guid import Guid
from ..structure.qos_policies import Transient
from ..structure.time import Time
from ..xtypes.type_support import TypeSupport, type_support
from .durable_topic import DurableTopic
from .entity import check_participant
from .lifetime import Lifetime

if TYPE_CHECKING:
    from .participant import DomainParticipant

__all__ = ["PersistenceService"]

_TYPE_TIMEOUT_S = 5.0
_CLEANUP_PERIOD_S = 1.0
_LOOK_PERIOD_S = 1.0


class PersistenceService:
    """Serves a domain while its body runs: ``async with PersistenceService(participant, "samples.sqlite"): ...``

    It records the topics whose remote writers offer TRANSIENT or PERSISTENT durability, as their ``durability_service``
    policy asks, and hands the samples on to readers that come when the writers are gone.  What is PERSISTENT it has
    after a restart too, however it ended; what is TRANSIENT only while it runs.
    """

    def __init__(
        self, participant: DomainParticipant, path: str | PathLike[str], *, topics: tuple[str, ...] = ("*",)
    ) -> None:
        """``participant``: one that was entered, and does nothing else with these topics.  ``topics``: patterns, with
        ``*`` and ``?``, of the names of those that it serves.

        ``path``: of the file, which is made if there is none.  It is opened by ``async with``, which raises
        BadParameter, naming it, where it is no store of a service, or another process has it open.
        """
        check_participant(participant)
        participant._running_pump()
        self._participant = participant
        self._patterns = topics
        self._path = fspath(path)
        self._opened: SampleStore | None = None
        self._was_entered = False
        self._topics: dict[StoredTopic, DurableTopic] = {}
        self.refusals: dict[StoredTopic, str] = {}
        """Topics that security does not let it serve, and why."""
        self._lifetime = Lifetime(self._run)
        self._scope = trio.CancelScope()
        self._nursery: trio.Nursery | None = None

    def __repr__(self) -> str:
        return f"<PersistenceService of {len(self._topics)} topics in {self._path}>"

    @property
    def _store(self) -> SampleStore:
        if self._opened is not None:
            return self._opened
        if self._was_entered:
            raise AlreadyDeleted(f"{self!r} has ended")
        raise PreconditionNotMet(f"{self!r} has not opened its file yet: enter it first, by `async with`")

    def counts(self) -> dict[str, int]:
        """How many samples it holds, by topic.  Raises PreconditionNotMet before it is entered, then AlreadyDeleted."""
        found: dict[str, int] = {}
        for topic in self._store.topics():
            found[topic.name] = found.get(topic.name, 0) + self._store.count(topic)
        return found

    @trio.lowlevel.enable_ki_protection
    async def __aenter__(self) -> Self:
        if self._was_entered:
            raise PreconditionNotMet(f"{self!r} was entered before; a PersistenceService is entered once, make another")
        await trio.lowlevel.checkpoint()
        opened = SampleStore(self._path)
        opened.forget(Transient.KIND)
        self._was_entered, self._opened = True, opened
        await self._lifetime.enter()
        return self

    @trio.lowlevel.enable_ki_protection
    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self._scope.cancel()
        try:
            await self._lifetime.leave(error)
        finally:
            for topic in self._topics.values():
                topic.close()
            self._store.close()
            self._opened = None

    async def _run(self) -> None:
        try:
            with self._scope:
                async with trio.open_nursery() as self._nursery:
                    self._nursery.start_soon(self._clean_up)
                    for stored in self._store.topics():
                        self._serve(stored, None, {})
                    while True:
                        await self._look()
                        with trio.move_on_after(_LOOK_PERIOD_S):
                            await self._participant.wait_for_discovery()
        except* AlreadyDeleted:
            if not self._participant._is_closed:
                raise
            # The participant was closed, and so is everything of ours.

    async def _look(self) -> None:
        """Which durable writers are there?"""
        leases = {data.guid.prefix: data.lease_duration for data in self._participant.discovered_participants()}
        writers: dict[StoredTopic, dict[Guid, DiscoveredWriterData]] = {topic: {} for topic in self._topics}
        for data in self._participant.discovered_publications():
            if data.qos.durability.KIND < Transient.KIND or data.is_replay or not self._is_served(data.topic_name):
                continue
            writers.setdefault(_stored(data), {})[data.guid] = data
        for stored, found in writers.items():
            of_writers = {guid: leases.get(guid.prefix, 0.0) for guid in found}
            topic = self._topics.get(stored)
            if topic is not None and (topic.knows_type or not found):
                topic.writers_changed(of_writers, self._participant._running_pump().now())
            elif stored not in self.refusals:
                support = await self._support(found.values())
                if topic is None or support is not None:
                    self._serve(stored, support, of_writers)

    def _is_served(self, topic_name: str) -> bool:
        return any(fnmatchcase(topic_name, pattern) for pattern in self._patterns)

    def _serve(self, stored: StoredTopic, support: TypeSupport[Any] | None, leases: dict[Guid, float]) -> None:
        """From now on; what was served without knowing its type is served anew."""
        assert self._nursery is not None
        self._store.add_topic(stored)
        before = self._topics.pop(stored, None)
        if before is not None:
            before.close()
        try:
            topic = DurableTopic(self._participant, self._store, stored, support, leases)
        except NotAllowedBySecurity as error:
            self.refusals[stored] = str(error)
            return
        self._topics[stored] = topic
        self._participant._running_pump().settle()
        self._nursery.start_soon(topic.record)

    async def _support(self, writers: Iterable[DiscoveredWriterData]) -> TypeSupport[Any] | None:
        """Of the writers' type, if one of them can tell what that is."""
        for data in writers:
            with suppress(PreconditionNotMet, DdsTimeout):
                return type_support(await self._participant.endpoint_type(data, timeout=_TYPE_TIMEOUT_S))
        return None

    async def _clean_up(self) -> None:
        while True:
            await trio.sleep(_CLEANUP_PERIOD_S)
            self._store.expire(Time(self._participant._running_pump().engine.wall_ticks()))
            self._store.commit()


def _stored(data: DiscoveredWriterData) -> StoredTopic:
    representations = data.qos.data_representation.ids
    return StoredTopic(
        data.topic_name,
        data.type_name,
        tuple(sorted(data.qos.partition.names)),
        int(representations[0]) if representations else 0,
        data.is_keyed,
        data.qos.durability.KIND,
        encode_writer(data),
    )
