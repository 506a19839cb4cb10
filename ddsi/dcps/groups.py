"""Publisher and Subscriber: groups of writers and of readers that share a partition, presentation and group data.

DDS 1.4 §2.2.2.4.1 (Publisher), §2.2.2.5.2 (Subscriber), §2.2.3.6 (PRESENTATION).  A participant may stand in their
place, but for what concerns a whole group: coherent sets that span writers, and order among readers.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, ClassVar, Self, TypeVar, cast

import trio

from ..engine import LocalWriter
from ..structure.errors import AlreadyDeleted, BadParameter, DdsTimeout, PreconditionNotMet
from ..structure.qos import Qos
from ..structure.qos_changes import check_changeable
from ..structure.qos_concerns import QosOwner
from ..structure.qos_policies import AccessScope
from ..structure.sample_info import ANY_INSTANCE_STATE, ANY_SAMPLE_STATE, ANY_VIEW_STATE, SampleState
from ..structure.status import DataAvailable, DataOnReaders
from .conditions import ReadCondition
from .endpoint import Endpoint, follow_all
from .entity import Entity, Parent, check_participant, deadline_scope
from .sample_reader import SampleReader
from .topic import Topic

if TYPE_CHECKING:
    from .data_reader import DataReader
    from .data_writer import DataWriter
    from .participant import DomainParticipant

__all__ = ["Publisher", "Subscriber", "check_family"]


S = TypeVar("S")

_ON_READERS = DataOnReaders(is_available=True)
_ANY = ReadCondition()
_UNREAD = ReadCondition(sample_states=SampleState.NOT_READ)


class _Group(Parent):
    def __init__(self, participant: DomainParticipant, qos: Qos | None = None) -> None:
        super().__init__(qos)
        check_participant(participant)
        self._pump = participant._running_pump()
        self._participant = participant
        self._is_enabled = participant._enables_members
        participant._adopt(self)

    def __repr__(self) -> str:
        return f"<{type(self).__name__} in domain {self._participant.domain_id}, {len(self._members)} members>"

    @property
    def participant(self) -> DomainParticipant:
        return self._participant

    @property
    def endpoint_defaults(self) -> Qos:
        return self._qos

    @property
    def _factory(self) -> Parent:
        return self._participant

    def _change_qos(self, after: Qos) -> None:
        if self._is_enabled:
            check_changeable(self._qos, after, f"a {type(self).__name__}")
        follow_all(member._plan(group=after) for member in self._members if isinstance(member, Endpoint))
        self._own_qos = self._qos = after

    def _lookup(self, topic_name: str) -> Endpoint | None:
        members = (member for member in self._members if isinstance(member, Endpoint))
        return next((member for member in members if member.topic.name == topic_name), None)

    def _on_close(self) -> None:
        super()._on_close()
        self._participant._disown(self)


class Publisher(_Group):
    """The writers created with it have its policies wherever they do not set their own."""

    _QOS_OWNER: ClassVar[QosOwner] = "publisher"

    def __init__(self, participant: DomainParticipant, qos: Qos | None = None) -> None:
        super().__init__(participant, qos)
        self._group = self._pump.engine.presentation.new_publisher()
        self._is_suspended = False

    def lookup_datawriter(self, topic_name: str) -> Endpoint | None:
        """A writer of that topic that belongs to the publisher; None: there is none.  DDS 1.4 §2.2.2.4.1.6."""
        return self._lookup(topic_name)

    # --- coherent sets -----------------------------------------------------------------------------------

    def begin_coherent_changes(self) -> None:
        """What the publisher's writers write from now on belongs to one set, until :meth:`end_coherent_changes`.

        Readers that ask for coherent access see all of it at once, or nothing: the part of each writer for itself with
        access scope TOPIC, the parts of all together with GROUP.  To others, and with INSTANCE, it means nothing.
        May be nested; the outermost counts.  DDS 1.4 §2.2.2.4.1.10.  Raises AlreadyDeleted.
        """
        self._check_open()
        self._group.begin_coherent_changes()

    def end_coherent_changes(self) -> None:
        """The set is whole.  DDS 1.4 §2.2.2.4.1.11.  Raises PreconditionNotMet (none was begun), AlreadyDeleted."""
        self._end_coherent_changes(is_complete=True)

    @contextmanager
    def coherent_changes(self) -> Iterator[None]:
        """``with publisher.coherent_changes():`` what is written in the body is one set.

        Where the body raises, or closes the publisher, readers with coherent access never see any of it.
        """
        self.begin_coherent_changes()
        is_complete = False
        try:
            yield
            is_complete = True
        finally:
            if not self._is_closed:
                self._end_coherent_changes(is_complete=is_complete)

    def _end_coherent_changes(self, *, is_complete: bool) -> None:
        self._check_open()
        if not self._group.is_open:
            raise PreconditionNotMet(f"{self!r}: no coherent changes were begun; call begin_coherent_changes() before")
        self._pump.engine.presentation.end_coherent_changes(self._group, self._pump.now(), is_complete=is_complete)
        self._pump.settle()

    # --- suspended publications --------------------------------------------------------------------------

    def suspend_publications(self) -> None:
        """Until :meth:`resume_publications`, what the publisher's writers write is kept and not sent.

        What KEEP_LAST replaces meanwhile is never sent; what may not be replaced fills the history, so that ``write``
        may have to wait.  DDS 1.4 §2.2.2.4.1.8.  Raises AlreadyDeleted.
        """
        self._check_open()
        self._is_suspended = True
        for writer in self._writers():
            self._pump.engine.presentation.suspend(writer)

    def resume_publications(self) -> None:
        """Send what was kept.  DDS 1.4 §2.2.2.4.1.9.  Raises PreconditionNotMet (not suspended), AlreadyDeleted."""
        self._check_open()
        if not self._is_suspended:
            raise PreconditionNotMet(f"{self!r}: publications are not suspended; call suspend_publications() before")
        self._is_suspended = False
        for writer in self._writers():
            self._pump.engine.presentation.resume(writer, self._pump.now())
        self._pump.settle()

    async def wait_for_acknowledgments(self, timeout: float | None = None) -> None:
        """Until every matched reliable reader has all that the publisher's writers wrote so far.

        DDS 1.4 §2.2.2.4.1.12.  Raises DdsTimeout, AlreadyDeleted.
        """
        self._check_open()
        with deadline_scope(timeout):
            for writer in [member for member in self._members if isinstance(member, Endpoint)]:
                try:
                    await cast("DataWriter[Any]", writer).wait_for_acknowledgments()
                except AlreadyDeleted:
                    self._check_open()  # a writer that has been closed is not waited for
            return
        raise DdsTimeout(f"{self!r}: not all of its readers have acknowledged all after {timeout} s")

    def _writers(self) -> list[LocalWriter]:
        endpoints = [member._local() for member in self._members if isinstance(member, Endpoint)]
        return [endpoint for endpoint in endpoints if isinstance(endpoint, LocalWriter)]


class Subscriber(_Group):
    """The readers created with it have its policies wherever they do not set their own."""

    _QOS_OWNER: ClassVar[QosOwner] = "subscriber"
    STATUSES: ClassVar[tuple[type, ...]] = (DataOnReaders,)

    def __init__(self, participant: DomainParticipant, qos: Qos | None = None) -> None:
        super().__init__(participant, qos)
        self._group = self._pump.engine.presentation.new_subscriber()
        self._news = trio.lowlevel.ParkingLot()

    def status(self, kind: type[S]) -> S:
        if kind is DataOnReaders:
            return cast(S, DataOnReaders(is_available=bool(self._readers_with_news())))
        return super().status(kind)

    def status_changes(self) -> frozenset[type]:
        return frozenset({DataOnReaders}) if self._readers_with_news() else frozenset()

    def lookup_datareader(self, topic_name: str) -> Endpoint | None:
        """A reader of that topic that belongs to the subscriber; None: there is none.  DDS 1.4 §2.2.2.5.2.7."""
        return self._lookup(topic_name)

    def _readers_with_news(self) -> list[Entity]:
        return [member for member in self._members if DataAvailable in member.status_changes()]

    def _has_news(self) -> None:
        self._news.unpark_all()
        self._changed.unpark_all()
        for stream in self._streams:
            stream.put(_ON_READERS)

    # --- access ------------------------------------------------------------------------------------------

    def begin_access(self) -> None:
        """From now on nothing becomes visible in readers with access scope GROUP, so that what one of them shows fits
        what the others show.  Required there before ``take`` and ``read``; else it means nothing.

        May be nested: then :meth:`end_access` is called as often.  DDS 1.4 §2.2.2.5.2.8.  Raises AlreadyDeleted.
        """
        self._check_open()
        self._group.begin_access()

    def end_access(self) -> None:
        """What has come meanwhile becomes visible.  DDS 1.4 §2.2.2.5.2.9.

        Raises PreconditionNotMet (none was begun), AlreadyDeleted.
        """
        self._check_open()
        if not self._group.is_accessed:
            raise PreconditionNotMet(f"{self!r}: no access was begun; call begin_access() before")
        self._group.end_access()
        self._pump.engine.presentation.release(self._group, self._pump.now())
        self._pump.settle()

    @contextmanager
    def access(self) -> Iterator[Self]:
        """``with subscriber.access():`` :meth:`begin_access` and :meth:`end_access` around the body."""
        self.begin_access()
        try:
            yield self
        finally:
            if not self._is_closed:
                self.end_access()

    def get_datareaders(
        self,
        condition: ReadCondition | None = None,
        *,
        sample_states: int = ANY_SAMPLE_STATE,
        view_states: int = ANY_VIEW_STATE,
        instance_states: int = ANY_INSTANCE_STATE,
    ) -> list[DataReader[Any]]:
        """The readers that have samples in these states, each once.

        With ordered access and access scope GROUP a reader is there for each of its samples, and the order is that in
        which the samples are to be taken: one from each entry.  With GROUP within :meth:`access` only.
        DDS 1.4 §2.2.2.5.2.10.  Raises PreconditionNotMet, AlreadyDeleted.
        """
        self._check_open()
        found: list[tuple[int, DataReader[Any]]] = []
        for reader in self._readers():
            is_ordered = isinstance(reader, Endpoint) and self._limit_of(reader, None) == 1
            states, selector = reader._selection(condition, sample_states, view_states, instance_states)
            infos = reader._history.matching(selector=selector, **states)
            found.extend((info.arrival, reader) for info in (infos if is_ordered else infos[:1]))
        return [reader for _, reader in sorted(found, key=lambda entry: entry[0])]

    def notify_datareaders(self) -> None:
        """Wake whoever waits for one of the readers that has samples.  DDS 1.4 §2.2.2.5.2.11.

        Raises AlreadyDeleted.
        """
        self._check_open()
        for reader in self._readers():
            if reader._matches(_ANY):
                reader._has_news()

    async def wait(self) -> None:
        """Until one of the readers has a sample that has not been read.  Raises AlreadyDeleted, also meanwhile."""
        self._check_open()
        await self._pump.checkpoint(self._pump.now())
        while True:
            self._check_open()
            for reader in self._readers():
                reader._history.seen()
            self._pump.before_waiting()
            if any(reader._matches(_UNREAD) for reader in self._readers()):
                return
            await self._news.park()
            self._pump.has_yielded()

    # --- inside ------------------------------------------------------------------------------------------

    def _readers(self) -> list[DataReader[Any]]:
        """A MultiTopicReader is one, in the place of those that it takes from."""
        members = (member for member in self._members if isinstance(member, SampleReader) and not member._is_part)
        return [cast("DataReader[Any]", member) for member in members]

    def _limit_of(self, reader: DataReader[Any], max_samples: int | None) -> int | None:
        """How many samples may be taken from it at once, of ``max_samples`` that are wanted.

        Raises PreconditionNotMet: not now.
        """
        policy = reader.endpoint_qos.presentation
        if policy.access_scope is not AccessScope.GROUP:
            return max_samples
        if not self._group.is_accessed:
            raise PreconditionNotMet(f"{reader!r} has access scope GROUP: read within `with subscriber.access():`")
        if not policy.ordered_access:
            return max_samples
        return 1 if max_samples is None else min(max_samples, 1)

    def _on_close(self) -> None:
        super()._on_close()
        self._news.unpark_all()
        self._participant._when_running(lambda pump: pump.engine.presentation.subscriber_gone(self._group))


def check_family(parent: Parent, topic: Topic[Any], group: type[Publisher] | type[Subscriber]) -> DomainParticipant:
    """The participant in which ``parent`` (itself, or such a ``group`` of it) makes an endpoint of ``topic``.

    Raises BadParameter, PreconditionNotMet (not entered; the topic is another participant's), AlreadyDeleted.
    """
    if not isinstance(parent, Parent) or (isinstance(parent, _Group) and not isinstance(parent, group)):
        raise BadParameter(f"the first argument is a DomainParticipant or a {group.__name__}, not {parent!r}")
    if not isinstance(topic, Topic):
        raise BadParameter(f"the second argument is a ddsi.Topic(participant, name, type), not {topic!r}")
    parent._check_open()
    topic._check_open()
    participant = parent.participant
    participant._running_pump()
    if topic.participant is not participant:
        raise PreconditionNotMet(f"{topic!r} was made with {topic.participant!r}; make one with {participant!r}")
    return participant
