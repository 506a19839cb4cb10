"""BuiltinTopicReader: who is there, as samples.  DDS 1.4 §2.2.5 (Built-in Topics)."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeVar, cast

from ..engine import BuiltinTopicChange, LocalBuiltinTopicReader
from ..structure.builtin_topic_data import (
    ParticipantBuiltinTopicData,
    PublicationBuiltinTopicData,
    SubscriptionBuiltinTopicData,
    TopicBuiltinTopicData,
)
from ..structure.cache_change import CacheChange
from ..structure.errors import BadParameter
from ..structure.guid import Guid
from ..structure.sample_info import SampleInfo
from .entity import check_participant
from .sample import Sample
from .sample_reader import SampleReader

if TYPE_CHECKING:
    from .participant import DomainParticipant

__all__ = ["BuiltinTopicReader"]

_KINDS = (
    ParticipantBuiltinTopicData,
    TopicBuiltinTopicData,
    PublicationBuiltinTopicData,
    SubscriptionBuiltinTopicData,
)

T = TypeVar(
    "T",
    ParticipantBuiltinTopicData,
    TopicBuiltinTopicData,
    PublicationBuiltinTopicData,
    SubscriptionBuiltinTopicData,
)


class BuiltinTopicReader(SampleReader[T]):
    """Reads of remote participants, topics, writers or readers: ``async for``, ``take`` and ``read`` as of any reader.

    Each entity is an instance whose handle is its Guid.  One sample comes when it becomes known (to a reader that is
    made late, all that are known already), and one whenever it changes.  Its end is a sample without valid data, which
    still holds what was known last: NOT_ALIVE_DISPOSED when its participant said so, NOT_ALIVE_NO_WRITERS when it was
    lost (its lease ran out, its participant went, or security refuses it by now).

    ``info.publication_handle`` is the participant that announced it; topics, which nobody announces, are gathered from
    the endpoints by the reader's own.  Not shown: what belongs to the reader's own
    participant, which the application made itself (DDS 1.4 §2.2.5), and whom security has not admitted.
    """

    def __init__(self, participant: DomainParticipant, kind: type[T]) -> None:
        """``kind``: ParticipantBuiltinTopicData, or Topic..., Publication... or SubscriptionBuiltinTopicData.

        Raises BadParameter, AlreadyDeleted.
        """
        if kind not in _KINDS:
            raise BadParameter(
                f"a BuiltinTopicReader reads {', '.join(known.__name__ for known in _KINDS)}, not {kind!r}"
            )
        check_participant(participant)
        super().__init__(participant, None)
        self._topic_name: str = kind.TOPIC_NAME
        self._reader: LocalBuiltinTopicReader = self._pump.engine.builtin_readers.create(kind, self._pump.now())
        self._history = self._reader.history
        participant._adopt(self)
        participant._register(self.guid, self)

    def __repr__(self) -> str:
        return f"<BuiltinTopicReader of {self._topic_name}, {len(self._history)} samples>"

    @property
    def guid(self) -> Guid:
        """Its own, which no other participant knows."""
        return self._reader.guid

    def _sample(self, info: SampleInfo, change: CacheChange) -> Sample[T]:
        assert isinstance(change, BuiltinTopicChange)
        return Sample(cast(T, change.data), info)

    def _on_close(self) -> None:
        super()._on_close()
        self._participant._disown(self)
        self._participant._deregister(self.guid)
        self._participant._when_running(lambda pump: pump.engine.builtin_readers.delete(self._reader))
