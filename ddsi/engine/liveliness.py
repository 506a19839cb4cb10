"""Liveliness: saying that our writers are alive, and noticing when others' are not.

DDS 1.4 §2.2.3.11 (LIVELINESS), RTPS 2.5 §8.4.13 (Writer Liveliness Protocol).  Automatic writers live as long as their
participant speaks, so one ParticipantMessage serves all of them; manual ones are asserted by the application.
Deadlines are checked when they are due, never per datagram.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from ..behavior.stateful_reader import RemoteWriter
from ..behavior.writer_proxy import WriterProxy
from ..discovery.participant_message import ParticipantMessageData
from ..discovery.participant_proxy import ParticipantProxy
from ..structure.builtin_entity_ids import PARTICIPANT_MESSAGE_SECURE_WRITER, PARTICIPANT_MESSAGE_WRITER
from ..structure.cache_change import CacheChange, ChangeKind
from ..structure.discovered import DiscoveredWriterData
from ..structure.errors import MalformedMessage
from ..structure.guid import Guid
from ..structure.qos_policies import Automatic, ManualByParticipant, ManualByTopic
from ..structure.vendor import CYCLONE
from .local_endpoints import LocalReader, LocalWriter

if TYPE_CHECKING:
    from .participant import Participant

__all__ = ["Liveliness"]

AUTOMATIC_KIND = b"\x00\x00\x00\x01"
MANUAL_BY_PARTICIPANT_KIND = b"\x00\x00\x00\x02"
_ASSERT_IN_CLEAR = frozenset((CYCLONE,))  # whatever governance says: they use the secure topic for nothing
_SHORTEST_LEASE_S = 0.01  # nobody can keep a shorter one, and trying to would be all that we do


class Liveliness:
    """Both directions for one participant."""

    def __init__(self, engine: Participant) -> None:
        self._engine = engine
        self._asserted: dict[Guid, float] = {}  # remote writers with a finite lease: when last, by themselves

    # --- our writers -------------------------------------------------------------------------------------

    def writer_added(self, writer: LocalWriter, now: float) -> None:
        policy = writer.data.qos.liveliness
        if policy.lease_duration == math.inf:
            return
        if isinstance(policy, Automatic):
            self._engine.alarms.assertion(now)
        else:
            writer.assertion_due = now + policy.lease_duration
            self._engine.alarms.writer_liveliness(writer)

    def assertion_period(self) -> float:
        """Seconds between automatic assertions: 80 % of the shortest lease below 10 s, else 2 s before its end.

        So that a lost one can be repaired in time; below half a second only the next one can come in time.
        """
        leases = [
            writer.data.qos.liveliness.lease_duration
            for writer in self._engine.user_writers()
            if isinstance(writer.data.qos.liveliness, Automatic)
        ]
        shortest = max(min(leases, default=math.inf), _SHORTEST_LEASE_S)
        if shortest < 0.5:
            return shortest * 0.3
        return shortest * 0.8 if shortest < 10 else shortest - 2

    def assert_automatic(self, now: float) -> None:
        self._send(AUTOMATIC_KIND, Automatic, now)

    def assert_participant(self, now: float) -> None:
        """The application says that its manual-by-participant writers are alive."""
        self._send(MANUAL_BY_PARTICIPANT_KIND, ManualByParticipant, now)
        for writer in self._engine.user_writers():
            self._renew(writer, now, ManualByParticipant)

    def assert_writer(self, writer: LocalWriter, now: float) -> None:
        """The application says that this writer is alive, by a call or by writing."""
        policy = writer.data.qos.liveliness
        if isinstance(policy, ManualByParticipant):
            self.assert_participant(now)
        elif isinstance(policy, ManualByTopic):
            self._renew(writer, now, ManualByTopic)
            self._engine.writer_answers(writer, writer.behavior.assert_liveliness())

    def written(self, writer: LocalWriter, now: float) -> None:
        """A sample was written; DDS 1.4 §2.2.3.11: that asserts too.  Readers see it by the DATA itself."""
        policy = writer.data.qos.liveliness
        if isinstance(policy, ManualByTopic):
            self._renew(writer, now, ManualByTopic)
        elif isinstance(policy, ManualByParticipant) and now > writer.assertion_due - policy.lease_duration * 0.9:
            self.assert_participant(now)

    def _renew(self, writer: LocalWriter, now: float, kind: type) -> None:
        policy = writer.data.qos.liveliness
        if isinstance(policy, kind) and policy.lease_duration < math.inf:
            writer.assertion_due = now + policy.lease_duration
            self._engine.alarms.writer_liveliness(writer)
            if writer.has_lost_liveliness:
                writer.has_lost_liveliness = False
                self._set_alive_here(writer, now, alive=True)

    def writer_due(self, writer: LocalWriter, now: float) -> None:
        """Not asserted in time: the application is told, once, and so are the readers of this participant."""
        if writer.assertion_due <= now and not writer.has_lost_liveliness:
            writer.has_lost_liveliness = True
            self._engine.status(writer.guid, writer.liveliness_lost())
            self._set_alive_here(writer, now, alive=False)

    def _set_alive_here(self, writer: LocalWriter, now: float, *, alive: bool) -> None:
        for guid in writer.behavior.local_readers:
            reader = self._engine.local_readers[guid]
            self._tell(reader, reader.behavior.writers[writer.guid], now, alive=alive)

    def _send(self, kind: bytes, policy: type, now: float) -> None:
        """On the secure topic for those whose liveliness is protected, on the plain one for all others."""
        message = ParticipantMessageData(self._engine.guid.prefix, kind, b"\0")
        writers = [writer for writer in self._engine.user_writers() if isinstance(writer.data.qos.liveliness, policy)]
        for is_protected in sorted({writer.protection.liveliness_protected for writer in writers} or {False}):
            writer_id = PARTICIPANT_MESSAGE_SECURE_WRITER if is_protected else PARTICIPANT_MESSAGE_WRITER
            self._engine.write_builtin(writer_id, ChangeKind.ALIVE, message.encode(), message.key, now)

    # --- others' writers ---------------------------------------------------------------------------------

    def receive_participant_message(self, change: CacheChange, now: float, *, is_secure: bool) -> None:
        """An assertion of another participant.  RTPS 2.5 §8.4.13.5 (ParticipantMessageData).

        On the secure topic it serves all of its writers; on the plain one only those whose liveliness is not
        protected, and of these the automatic ones live as long as anything at all is heard of their participant.  What
        is sent once more by somebody else does not come here: its number was received before.
        """
        if change.kind is not ChangeKind.ALIVE:
            return
        try:
            message = ParticipantMessageData.decode(change.payload)
        except MalformedMessage as error:
            self._engine.dropped_discovery(change, str(error))
            return
        participant = self._engine.participants.get(message.prefix)
        if participant is None or message.prefix != change.writer_guid.prefix:
            return
        if is_secure:
            participant.last_proof = now
            self._revive(participant, Automatic, now)
        if message.kind == MANUAL_BY_PARTICIPANT_KIND:
            participant.last_manual_assertion = now
            if is_secure:
                participant.last_protected_assertion = now
            self._revive(participant, ManualByParticipant, now)

    def remote_writer_matched(self, data: DiscoveredWriterData, now: float) -> None:
        if data.qos.liveliness.lease_duration < math.inf:
            self._asserted.setdefault(data.guid, now)
            self._engine.alarms.remote_liveliness(data.guid, now + data.qos.liveliness.lease_duration)

    def remote_writer_gone(self, guid: Guid) -> None:
        self._asserted.pop(guid, None)
        self._engine.alarms.remote_liveliness(guid, math.inf)

    def writer_asserted(self, guid: Guid, now: float) -> None:
        """A HEARTBEAT with the liveliness flag, or DATA, of a manual-by-topic writer."""
        if guid in self._asserted:
            self._asserted[guid] = now
            remote = self._engine.remote_writers.get(guid)
            if remote is not None:
                self._set_alive(remote, now, alive=True)

    def remote_writer_due(self, guid: Guid, now: float) -> None:
        """Its lease may have ended: look when it was last heard of."""
        remote = self._engine.remote_writers.get(guid)
        if remote is None:
            return
        lease = remote.data.qos.liveliness.lease_duration
        due = self._last_sign(remote) + lease
        if due > now:
            self._engine.alarms.remote_liveliness(guid, due)
            return
        participant = remote.participant
        if isinstance(participant, ParticipantProxy) and isinstance(remote.data.qos.liveliness, Automatic):
            participant.has_lost_liveliness = True
        self._set_alive(remote, now, alive=False)

    def _last_sign(self, remote: RemoteWriter) -> float:
        participant = remote.participant
        if not isinstance(participant, ParticipantProxy):
            return math.inf
        policy, asserted = remote.data.qos.liveliness, self._asserted.get(remote.guid, 0.0)
        if isinstance(policy, Automatic):
            return max(participant.last_proof, asserted) if self._must_be_proved(remote) else participant.last_heard
        if isinstance(policy, ManualByParticipant):
            is_proved = self._must_be_proved(remote)
            said = participant.last_protected_assertion if is_proved else participant.last_manual_assertion
            return max(said, asserted)
        return asserted

    def _must_be_proved(self, remote: RemoteWriter) -> bool:
        """Does only the secure topic tell that it lives?  Not where that topic itself is not protected."""
        participant = remote.participant
        return (
            isinstance(participant, ParticipantProxy)
            and participant.vendor_id not in _ASSERT_IN_CLEAR
            and any(
                self._engine.local_readers[behavior.guid].protection.liveliness_protected
                for behavior, _ in remote.readers
            )
            and self._engine.hooks.participant_security(self._engine.guid).is_liveliness_protected
        )

    def revive(self, participant: ParticipantProxy, now: float) -> None:
        """It speaks again: its automatic writers are alive."""
        participant.has_lost_liveliness = False
        self._revive(participant, Automatic, now)

    def _revive(self, participant: ParticipantProxy, kind: type, now: float) -> None:
        for guid in list(self._asserted):
            remote = self._engine.remote_writers.get(guid)
            if (
                remote is not None
                and remote.participant is participant
                and isinstance(remote.data.qos.liveliness, kind)
                and self._last_sign(remote) + remote.data.qos.liveliness.lease_duration > now
            ):
                self._set_alive(remote, now, alive=True)

    def _set_alive(self, remote: RemoteWriter, now: float, *, alive: bool) -> None:
        if alive:
            self._engine.alarms.remote_liveliness(remote.guid, now + remote.data.qos.liveliness.lease_duration)
        for behavior, proxy in remote.readers:
            self._tell(self._engine.local_readers[behavior.guid], proxy, now, alive=alive)

    def _tell(self, reader: LocalReader, proxy: WriterProxy, now: float, *, alive: bool) -> None:
        """One reader, about one of its writers, if it is news."""
        if proxy.is_alive == alive:
            return
        proxy.is_alive = alive
        if not alive and reader.history is not None:
            reader.history.writer_lost(proxy.guid, now)
        change = 1 if alive else -1
        self._engine.status(reader.guid, reader.liveliness_changed(proxy.guid, alive=change, not_alive=-change))
        self._engine.recorder.liveliness(reader.guid, proxy.guid, alive=alive)
