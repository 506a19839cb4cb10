"""Matchmaker: pairs local endpoints with remote and local ones, and remembers why others do not pair.

RTPS 2.5 §8.5.4 and DDS 1.4 §2.2.3; the judgement itself is ``discovery.matching``.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..behavior.content_filtering_writer import ContentFilteringWriter
from ..behavior.defrag import Defragmenter, Keep
from ..behavior.stateful_reader import RemoteWriter
from ..behavior.stateless_reader import StatelessReader
from ..discovery.matching import MatchRefusal, RefusalKind, policies_refusal
from ..discovery.participant_proxy import ParticipantProxy
from ..spi import PENDING, Admission, Protection, Refused
from ..structure.discovered import DiscoveredEndpointData, DiscoveredReaderData, DiscoveredWriterData
from ..structure.guid import Guid
from ..structure.locator import Locator
from ..structure.status import SecurityRefused
from ..trace.reasons import LossReason, SampleLossReason
from .content_filters import writer_side_filter
from .local_endpoints import LocalReader, LocalWriter
from .type_matching import TypeVerdict

if TYPE_CHECKING:
    from .participant import Participant

__all__ = ["Matchmaker"]

# After these a writer may be matched again as the same that it was, and then repeats to the reader what it keeps.
_MAY_RETURN = frozenset(
    {LossReason.LEASE_EXPIRED, LossReason.QOS_CHANGED, LossReason.REJECTED_BY_SECURITY, LossReason.EVICTED}
)


class Matchmaker:
    """``refusals``: for each (local, remote) pair of one topic that does not match, the reason."""

    def __init__(self, engine: Participant) -> None:
        self._engine = engine
        self.refusals: dict[tuple[Guid, Guid], MatchRefusal] = {}
        self._pending: set[tuple[Guid, Guid]] = set()

    # --- something appeared or changed -------------------------------------------------------------------

    def writer_appeared(self, writer: LocalWriter, now: float) -> None:
        """A local writer was created, or its QoS changed."""
        for reader_data in self._engine.known_readers.of_topic(writer.data.topic_name):
            self._consider_reader(writer, reader_data, now)
        for reader in self._engine.user_readers(writer.data.topic_name):
            self._consider_local(writer, reader, now)

    def reader_appeared(self, reader: LocalReader, now: float) -> None:
        """A local reader was created, or its QoS changed."""
        for writer_data in self._engine.known_writers.of_topic(reader.data.topic_name):
            self._consider_writer(reader, writer_data, now)
        for writer in self._engine.user_writers(reader.data.topic_name):
            self._consider_local(writer, reader, now)

    def remote_reader_appeared(self, data: DiscoveredReaderData, now: float) -> None:
        for writer in self._engine.user_writers(data.topic_name):
            self._consider_reader(writer, data, now)

    def remote_writer_appeared(self, data: DiscoveredWriterData, now: float) -> None:
        for reader in self._engine.user_readers(data.topic_name):
            self._consider_writer(reader, data, now)

    # --- something went ----------------------------------------------------------------------------------

    def writer_gone(self, writer: LocalWriter, now: float) -> None:
        """A local writer is deleted: nothing of it stays in any table."""
        for guid in list(writer.behavior.readers):
            self._unmatch_reader(writer, guid, LossReason.CLOSED, now)
        for guid in list(writer.behavior.local_readers):
            self._unmatch_local(writer, self._engine.local_readers[guid], LossReason.CLOSED, now)
        self._forget(writer.guid)

    def reader_gone(self, reader: LocalReader, now: float) -> None:
        for guid in list(reader.behavior.writers):
            writer = self._engine.local_writers.get(guid)
            if writer is not None:
                self._unmatch_local(writer, reader, LossReason.CLOSED, now)
            else:
                self.unmatch_writer(reader, guid, LossReason.CLOSED, now)
        self._forget(reader.guid)

    def remote_reader_gone(self, data: DiscoveredReaderData, reason: LossReason, now: float) -> None:
        for writer in self._engine.user_writers(data.topic_name):
            if data.guid in writer.behavior.readers:
                self._unmatch_reader(writer, data.guid, reason, now)
            self._withdraw(writer.guid, data.guid)
        self._engine.hooks.remote_endpoint_lost(data.guid)

    def remote_writer_gone(self, data: DiscoveredWriterData, reason: LossReason, now: float) -> None:
        for reader in self._engine.user_readers(data.topic_name):
            if data.guid in reader.behavior.writers:
                self.unmatch_writer(reader, data.guid, reason, now)
            self._withdraw(reader.guid, data.guid)
        self._engine.hooks.remote_endpoint_lost(data.guid)

    def is_matched(self, data: DiscoveredEndpointData) -> bool:
        """Does a local endpoint have a match with this remote one?"""
        if isinstance(data, DiscoveredWriterData):
            return data.guid in self._engine.remote_writers
        return any(data.guid in writer.behavior.readers for writer in self._engine.user_writers(data.topic_name))

    def decided(self, local: Guid, remote: Guid, admission: Admission, now: float) -> None:
        """Security made up its mind about a pair that was pending."""
        if (local, remote) not in self._pending:
            return
        self._pending.discard((local, remote))
        writer = self._engine.local_writers.get(local)
        reader_data = self._engine.known_readers.get(remote)
        if writer is not None and reader_data is not None:
            is_closing = writer.guid in self._engine.closing
            if self._admits(local, remote, reader_data.topic_name, admission) and not is_closing:
                self._match_reader(writer, reader_data, now)
            return
        reader = self._engine.local_readers.get(local)
        writer_data = self._engine.known_writers.get(remote)
        if (
            reader is not None
            and writer_data is not None
            and self._admits(local, remote, writer_data.topic_name, admission)
        ):
            self._match_writer(reader, writer_data, now)

    # --- pairs -------------------------------------------------------------------------------------------

    def _consider_reader(self, writer: LocalWriter, data: DiscoveredReaderData, now: float) -> None:
        """A local writer and a remote reader of its topic."""
        engine = self._engine
        participant = engine.participants.get(data.guid[:12])
        if participant is None or not participant.is_admitted or writer.guid in engine.closing:
            return
        refusal, types = self._judge(writer.data, data, now)
        matched = data.guid in writer.behavior.readers
        if refusal is not None:
            if matched:
                self._unmatch_reader(writer, data.guid, LossReason.QOS_CHANGED, now)
            if self._refused(writer.guid, data.guid, data.topic_name, refusal):
                self._tell(writer, data, refusal)
        elif matched:
            if self._still_admits(writer.guid, writer.behavior.readers[data.guid].data, data):
                self._content_filter_announced(writer, data)
                writer.behavior.matched_reader_update(data.guid, data, participant.user_traffic(data.unicast))
            else:
                self._unmatch_reader(writer, data.guid, LossReason.REJECTED_BY_SECURITY, now)
        elif self._types_fit(writer, data, types, now):
            admission = engine.hooks.match(writer.guid, data)
            if self._admits(writer.guid, data.guid, data.topic_name, admission):
                self._match_reader(writer, data, now)

    def _consider_writer(self, reader: LocalReader, data: DiscoveredWriterData, now: float) -> None:
        """A local reader and a remote writer of its topic."""
        engine = self._engine
        participant = engine.participants.get(data.guid[:12])
        if participant is None or not participant.is_admitted:
            return
        refusal, types = self._judge(data, reader.data, now)
        proxy = reader.behavior.writers.get(data.guid)
        if refusal is not None:
            if proxy is not None:
                self.unmatch_writer(reader, data.guid, LossReason.QOS_CHANGED, now)
            if self._refused(reader.guid, data.guid, data.topic_name, refusal):
                self._tell(reader, data, refusal)
        elif proxy is not None:
            if self._still_admits(reader.guid, proxy.data, data):
                proxy.data = data
                _tell_history(reader, data)
                proxy.locators = participant.user_traffic(data.unicast)
            else:
                self.unmatch_writer(reader, data.guid, LossReason.REJECTED_BY_SECURITY, now)
        elif self._types_fit(reader, data, types, now):
            admission = engine.hooks.match(reader.guid, data)
            if self._admits(reader.guid, data.guid, data.topic_name, admission):
                self._match_writer(reader, data, now)

    def _consider_local(self, writer: LocalWriter, reader: LocalReader, now: float) -> None:
        """Two endpoints of this participant: the same rules, no wire."""
        refusal, types = self._judge(writer.data, reader.data, now)
        matched = reader.guid in writer.behavior.local_readers
        if refusal is not None:
            if matched:
                self._unmatch_local(writer, reader, LossReason.QOS_CHANGED, now)
            if self._refused(writer.guid, reader.guid, writer.data.topic_name, refusal):
                self._tell(writer, reader.data, refusal)
                self._tell(reader, writer.data, refusal)
        elif matched:
            writer.behavior.local_readers[reader.guid].data = reader.data
            reader.behavior.writers[writer.guid].data = writer.data
            _tell_history(reader, writer.data)
        elif writer.guid not in self._engine.closing and self._types_fit(writer, reader.data, types, now):
            self._match_local(writer, reader, now)

    # --- types -------------------------------------------------------------------------------------------

    def _judge(
        self, writer: DiscoveredWriterData, reader: DiscoveredReaderData, now: float
    ) -> tuple[MatchRefusal | None, TypeVerdict]:
        """Policies first: for a pair that they keep apart nobody need be asked for its types."""
        refusal = policies_refusal(writer, reader)
        types = self._engine.type_matching.judge(writer, reader, now, may_ask=refusal is None)
        return types.refusal or refusal, types

    def _types_fit(
        self, endpoint: LocalWriter | LocalReader, remote: DiscoveredEndpointData, types: TypeVerdict, now: float
    ) -> bool:
        """A pair that is not refused and not matched yet: may it be, or does it wait for types?"""
        engine, local = self._engine, endpoint.guid
        is_news = True
        if types.is_awaited:
            is_news = engine.type_matching.wait(local, remote.guid)
        else:
            engine.type_matching.no_longer_waiting(local, remote.guid)
        if types.step is not None and is_news:
            engine.recorder.types_compared(local, remote.guid, remote.topic_name, types.step, types.detail)
        if types.withdraws and remote.guid.prefix != engine.guid.prefix:
            engine.discovery.withdraw_types(endpoint, now)  # or the other would refuse us
        return not types.is_awaited

    def types_learnt(self, prefix: bytes, now: float) -> None:
        """A participant has answered about its types, or will not: pairs that waited for it are looked at again."""
        engine = self._engine
        for local, remote in engine.type_matching.waiting_for(prefix):
            writer, reader_data = engine.local_writers.get(local), engine.known_readers.get(remote)
            reader, writer_data = engine.local_readers.get(local), engine.known_writers.get(remote)
            if writer is not None and reader_data is not None:
                self._consider_reader(writer, reader_data, now)
            elif reader is not None and writer_data is not None:
                self._consider_writer(reader, writer_data, now)
            else:
                engine.type_matching.no_longer_waiting(local, remote)

    def _match_reader(self, writer: LocalWriter, data: DiscoveredReaderData, now: float) -> None:
        engine = self._engine
        participant = engine.participants[data.guid[:12]]
        transmissions = writer.behavior.matched_reader_add(
            data, participant.user_traffic(data.unicast), now, writer_side_filter(writer, data, engine.hooks)
        )
        engine.receivers_changed(writer)
        self._note_matched(writer.guid, data.guid, data.topic_name)
        engine.status(writer.guid, writer.match_changed(data.guid, 1))
        engine.writer_answers(writer, transmissions)

    def _content_filter_announced(self, writer: LocalWriter, data: DiscoveredReaderData) -> None:
        """A matched reader says again what it lets pass."""
        behavior = writer.behavior
        is_news = behavior.readers[data.guid].data.content_filter != data.content_filter
        if is_news and isinstance(behavior, ContentFilteringWriter):
            behavior.content_filter_changed(data.guid, writer_side_filter(writer, data, self._engine.hooks))

    def _match_writer(self, reader: LocalReader, data: DiscoveredWriterData, now: float) -> None:
        engine = self._engine
        participant = engine.participants[data.guid[:12]]
        self.attach_writer(reader, data, participant, participant.user_traffic(data.unicast), now)
        _tell_history(reader, data)
        engine.presentation.writer_matched(reader, data)
        self._note_matched(reader.guid, data.guid, data.topic_name)
        engine.status(reader.guid, reader.match_changed(data.guid, 1))
        engine.status(reader.guid, reader.liveliness_changed(data.guid, alive=1, not_alive=0))
        engine.liveliness.remote_writer_matched(data, now)

    def attach_writer(
        self,
        reader: LocalReader,
        data: DiscoveredWriterData,
        participant: ParticipantProxy | None,
        locators: tuple[Locator, ...],
        now: float,
    ) -> None:
        """Enter the pair into the tables that datagrams are looked up in; builtin endpoints come here directly."""
        engine = self._engine
        remote = engine.remote_writers.get(data.guid)
        if remote is None:
            is_stateless = isinstance(reader.behavior, StatelessReader)
            defragmenter = Defragmenter(
                engine.stateless_defrag_budget if is_stateless else engine.defrag_budget,
                max_samples=engine.config.max_reorder_samples,
                keep=Keep.NEWEST if is_stateless else Keep.LOWEST,
            )
            remote = engine.remote_writers[data.guid] = RemoteWriter(data, defragmenter, participant)
        uses_filter = reader.uses_filter or data.is_replay
        proxy = reader.behavior.matched_writer_add(data, locators, now, uses_filter=uses_filter)
        remote.readers.append((reader.behavior, proxy))
        remote.readers_changed()
        engine.proxy_touched(reader.behavior, proxy)

    def _match_local(self, writer: LocalWriter, reader: LocalReader, now: float) -> None:
        engine = self._engine
        reader_proxy = writer.behavior.matched_local_reader_add(reader.data, now)
        writer_proxy = reader.behavior.matched_writer_add(writer.data, (), now, is_local=True)
        _tell_history(reader, writer.data)
        engine.presentation.writer_matched(reader, writer.data)
        writer_proxy.reorder.next_sn = reader_proxy.history_sn + 1
        writer_proxy.last_seq = reader_proxy.history_sn
        self._note_matched(writer.guid, reader.guid, writer.data.topic_name)
        engine.status(writer.guid, writer.match_changed(reader.guid, 1))
        engine.status(reader.guid, reader.match_changed(writer.guid, 1))
        is_alive = writer_proxy.is_alive = not writer.has_lost_liveliness
        engine.status(
            reader.guid, reader.liveliness_changed(writer.guid, alive=int(is_alive), not_alive=int(not is_alive))
        )
        engine.local_delivery.deliver(writer, reader, now)
        engine.presentation.local_writer_matched(reader, writer, now)

    # --- the end of a pair -------------------------------------------------------------------------------

    def _unmatch_reader(self, writer: LocalWriter, guid: Guid, reason: LossReason, now: float) -> None:
        writer.behavior.matched_reader_remove(guid, now)
        self._engine.receivers_changed(writer)
        self._engine.hooks.unmatch(writer.guid, guid)
        self._engine.recorder.unmatched(writer.guid, guid, writer.data.topic_name, reason)
        self._engine.status(writer.guid, writer.match_changed(guid, -1))
        self._engine.writer_answers(writer, writer.behavior.unsent_changes(now))

    def unmatch_writer(self, reader: LocalReader, guid: Guid, reason: LossReason, now: float) -> None:
        engine = self._engine
        proxy = reader.behavior.writers.get(guid)
        # Who authenticated anew may be the same as before, and then repeats what it keeps.  Without protection a new
        # program's samples may have come in the old one's place already, and nothing tells what is a repetition.
        is_forgotten = reason is LossReason.RESTARTED
        may_return = reason in _MAY_RETURN or (is_forgotten and self._is_protected(reader, guid))
        self.detach_writer(reader, guid, now, may_return=may_return, is_forgotten=is_forgotten)
        engine.hooks.unmatch(reader.guid, guid)
        self._engine.recorder.unmatched(reader.guid, guid, reader.data.topic_name, reason)
        if reader.history is not None:
            reader.history.writer_unmatched(guid, now)
            engine.presentation.writer_unmatched(reader, guid, reason, now, may_return=reason in _MAY_RETURN)
        # A writer that was only silent may never have lost us, and then still brings what it has for us.
        is_final = reason not in (LossReason.CLOSED, LossReason.LEASE_EXPIRED)
        if proxy is not None and proxy.is_reliable and is_final and not (may_return and proxy.needs_historical_data):
            engine.samples_lost(reader, proxy, len(proxy.reorder), proxy.next_sn, SampleLossReason.WRITER_LOST)
        engine.status(reader.guid, reader.match_changed(guid, -1))
        alive = proxy is None or proxy.is_alive
        engine.status(
            reader.guid, reader.liveliness_changed(guid, alive=-1 if alive else 0, not_alive=0 if alive else -1)
        )

    def _is_protected(self, reader: LocalReader, writer: Guid) -> bool:
        """Of what governance says: the keys of who authenticated anew are wiped by now."""
        hooks = self._engine.hooks
        security = hooks.endpoint_security(reader.data)
        is_protected = security.is_submessage_protected or security.is_payload_protected
        return is_protected or not hooks.admits(writer, Protection.NONE)

    def detach_writer(
        self, reader: LocalReader, guid: Guid, now: float, *, may_return: bool = False, is_forgotten: bool = False
    ) -> None:
        """Undo :meth:`attach_writer`; fragments that were meant for this reader alone go with it."""
        engine = self._engine
        proxy = reader.behavior.matched_writer_remove(guid, now, may_return=may_return, is_forgotten=is_forgotten)
        engine.forget_proxy(reader.guid, guid)
        remote = engine.remote_writers.get(guid)
        if remote is None or proxy is None:
            return
        remote.defragmenter.prune(reader.guid.entity_id)
        remote.readers = [pair for pair in remote.readers if pair[1] is not proxy]
        if not remote.readers:
            remote.defragmenter.close()
            del engine.remote_writers[guid]
            engine.liveliness.remote_writer_gone(guid)
        else:
            remote.readers_changed()

    def _unmatch_local(self, writer: LocalWriter, reader: LocalReader, reason: LossReason, now: float) -> None:
        engine = self._engine
        may_return = reason in _MAY_RETURN
        will_repeat = may_return and reader.behavior.writers[writer.guid].needs_historical_data
        if writer.guid in engine.closing or not (will_repeat or reason is LossReason.CLOSED):
            engine.local_delivery.given_up(writer, reader)
        writer.behavior.matched_reader_remove(reader.guid, now)
        proxy = reader.behavior.matched_writer_remove(writer.guid, now, may_return=may_return)
        alive = proxy is None or proxy.is_alive
        self._engine.recorder.unmatched(writer.guid, reader.guid, writer.data.topic_name, reason)
        if reader.history is not None:
            reader.history.writer_unmatched(writer.guid, now)
            engine.presentation.writer_unmatched(reader, writer.guid, reason, now, may_return=may_return)
        engine.status(writer.guid, writer.match_changed(reader.guid, -1))
        engine.status(reader.guid, reader.match_changed(writer.guid, -1))
        engine.status(reader.guid, reader.liveliness_changed(writer.guid, alive=-int(alive), not_alive=int(alive) - 1))
        engine.writer_progressed(writer)

    # --- refusals ----------------------------------------------------------------------------------------

    def _tell(
        self,
        endpoint: LocalWriter | LocalReader,
        other: DiscoveredWriterData | DiscoveredReaderData,
        refusal: MatchRefusal,
    ) -> None:
        """The application hears of policies and types that do not fit; another partition is nobody's mistake."""
        if refusal.kind is RefusalKind.QOS:
            self._engine.status(endpoint.guid, endpoint.found_incompatible(other.guid, refusal.incompatibilities))
        elif refusal.kind is RefusalKind.TYPE:
            self._engine.status(endpoint.guid, endpoint.inconsistent_topic(other.type_name, refusal.detail))

    def _admits(self, local: Guid, remote: Guid, topic_name: str, admission: Admission) -> bool:
        if admission is PENDING:
            self._pending.add((local, remote))
            return False
        if isinstance(admission, Refused):
            refusal = MatchRefusal(RefusalKind.SECURITY, admission.reason, "")
            if self._refused(local, remote, topic_name, refusal):
                self._engine.status(local, SecurityRefused(remote=remote, reason=admission.reason))
            return False
        return True

    def _still_admits(
        self,
        local: Guid,
        before: DiscoveredWriterData | DiscoveredReaderData,
        data: DiscoveredWriterData | DiscoveredReaderData,
    ) -> bool:
        """A matched endpoint announces something else: may it, with that partition and those data tags?"""
        if data == before:
            return True
        admission = self._engine.hooks.match(local, data)
        return not isinstance(admission, Refused) or self._admits(local, data.guid, data.topic_name, admission)

    def _refused(self, local: Guid, remote: Guid, topic_name: str, refusal: MatchRefusal) -> bool:
        """Remember it; returns whether it is news."""
        self._no_longer_pending(local, remote)
        self._engine.type_matching.no_longer_waiting(local, remote)
        if self.refusals.get((local, remote)) == refusal:
            return False
        self.refusals[(local, remote)] = refusal
        self._engine.recorder.refused(local, remote, topic_name, refusal)
        self._engine.match_refused(local, remote)
        return True

    def _note_matched(self, local: Guid, remote: Guid, topic_name: str) -> None:
        self.refusals.pop((local, remote), None)
        self._pending.discard((local, remote))
        self._engine.recorder.matched(local, remote, topic_name)

    def _withdraw(self, local: Guid, remote: Guid) -> None:
        """The remote endpoint is gone: neither is it refused nor does it wait."""
        self.refusals.pop((local, remote), None)
        self._no_longer_pending(local, remote)
        self._engine.type_matching.no_longer_waiting(local, remote)

    def _no_longer_pending(self, local: Guid, remote: Guid) -> None:
        """The hooks asked us to wait for a pair that will not be one: they forget its keys as they would a match's."""
        if (local, remote) in self._pending:
            self._pending.discard((local, remote))
            self._engine.hooks.unmatch(local, remote)

    def _forget(self, local: Guid) -> None:
        for pair in [pair for pair in self.refusals if local in pair]:
            del self.refusals[pair]
        for pair in [pair for pair in self._pending if local in pair]:
            self._no_longer_pending(*pair)


def _tell_history(reader: LocalReader, data: DiscoveredWriterData) -> None:
    """Whose samples are coming: how strong the writer is, and how long they live."""
    if reader.history is not None:
        reader.history.writer_matched(data.guid, data.qos)
