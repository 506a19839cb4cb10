"""Inbound: a datagram becomes changes, gaps, heartbeats and acknowledgments for those they are meant for.

RTPS 2.5 §8.3.4 (The RTPS Message Receiver).  Everything here is hostile until a MAC says otherwise: whatever a parser
refuses ends the message, is counted, and goes no further.  DATA in its usual form takes a short path (``_data``); all
else is decoded into the classes of ``messages``.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from typing import TYPE_CHECKING

from ..behavior.defrag import PartialSample
from ..behavior.stateful_reader import RemoteWriter
from ..behavior.writer_proxy import WriterProxy
from ..discovery.participant_proxy import ParticipantProxy
from ..messages.acknack import AckNack, NackFrag
from ..messages.data import Data
from ..messages.fast import DATA_BODY, SUBMESSAGE_HEAD, envelope_end, key_hash_alone
from ..messages.fragment_run import FragmentRun
from ..messages.gap import Gap
from ..messages.heartbeat import Heartbeat, HeartbeatFrag
from ..messages.interpreter import InfoDestination, InfoSource, InfoTimestamp
from ..messages.raw_submessage import RawSubmessage, SubmessageKind, iterate_submessages, submessage_name
from ..serialization.parameter_list import MustUnderstandUnknown
from ..spi import NoKeys, NotForUs, Octets, Outcome, Protection, Rejected
from ..structure.builtin_entity_ids import SPDP_WRITER
from ..structure.cache_change import CacheChange, ChangeKind, StatusInfo
from ..structure.errors import MalformedMessage, MalformedSample
from ..structure.guid import EntityId, Guid
from ..structure.locator import Locator
from ..structure.sequence_number import NumberSet
from ..trace.reasons import DropReason, SampleLossReason
from .inline_qos import NUMBERS_END, InlineQos
from .local_endpoints import LocalReader

if TYPE_CHECKING:
    from .participant import Participant

__all__ = ["Inbound", "Incoming"]

_DATA = int(SubmessageKind.DATA)
_DATA_FRAG = int(SubmessageKind.DATA_FRAG)
_INFO_TS = int(SubmessageKind.INFO_TS)
_TIMESTAMP = struct.Struct("<II")
_LE_DATA_ONLY = 0x05  # flags E and D: a sample, little-endian, without inline QoS
_LE_DATA_AND_QOS = 0x07
_SEC_PREFIX = int(SubmessageKind.SEC_PREFIX)
_SRTPS_PREFIX = int(SubmessageKind.SRTPS_PREFIX)
_UNKNOWN_ID = bytes(4)
_CONTRADICTIONS_OF_A_RESTART = 3  # one or two may be HEARTBEATs that were long under way
# What one message may ask for beyond its parsing, counted as if each were so many members of a number set.  Honest ones
# hold an announcement of a participant, some sets, and the end of one large sample with the beginning of another.
_MOST_WORK = 16_384
_WORK_OF_A_PARTICIPANT = 1024
_WORK_OF_A_FRAGMENTED_SAMPLE = 256
_UNKNOWN_PREFIX = bytes(12)
# INFO_REPLY is understood and not acted upon: answers go to the locators that the participant announced.
_WITHOUT_EFFECT = frozenset({SubmessageKind.PAD, SubmessageKind.INFO_REPLY, SubmessageKind.INFO_REPLY_IP4})
_WORTH_A_PLACE = 1 << 14  # octets of a run that are decrypted to where they belong, to spare a copy
_KEY_HASH_QOS = 24  # octets of an inline QoS that holds a key hash alone
_CLEAR, _IN_MESSAGE, _IN_ENVELOPE = int(Protection.NONE), int(Protection.MESSAGE), int(Protection.SUBMESSAGE)


class Incoming:
    """The receiver's state for one message.  RTPS 2.5 §8.3.4, table 8.12.  Mutable, one per datagram."""

    __slots__ = (
        "destination",
        "is_for_us",
        "now",
        "participant",
        "prefix",
        "protection",
        "source",
        "timestamp",
        "vendor_id",
        "version",
        "work",
    )

    def __init__(self, source: Locator, prefix: bytes, vendor_id: bytes, version: tuple[int, int], now: float) -> None:
        self.source = source
        self.prefix = prefix
        self.vendor_id = vendor_id
        self.version = version
        self.now = now
        self.participant: ParticipantProxy | None = None
        self.timestamp: int | None = None
        self.destination = _UNKNOWN_PREFIX
        self.is_for_us = True
        self.protection = _CLEAR
        self.work = 0


class Inbound:
    """Parses for one participant; ``engine`` holds the tables that it looks things up in."""

    def __init__(self, engine: Participant) -> None:
        self._engine = engine
        self._own_prefix = bytes(engine.guid[:12])
        self._hooks = engine.hooks
        self._handlers: dict[int, Callable[[Incoming, RawSubmessage], None]] = {
            SubmessageKind.DATA: self._general_data,
            SubmessageKind.DATA_FRAG: lambda incoming, raw: self._data_frag(incoming, raw.flags, raw.body),
            SubmessageKind.HEARTBEAT: self._heartbeat,
            SubmessageKind.HEARTBEAT_FRAG: self._heartbeat_frag,
            SubmessageKind.GAP: self._gap,
            SubmessageKind.ACKNACK: self._acknack,
            SubmessageKind.NACK_FRAG: self._nack_frag,
            SubmessageKind.INFO_TS: self._info_timestamp,
            SubmessageKind.INFO_DST: self._info_destination,
            SubmessageKind.INFO_SRC: self._info_source,
        }

    def receive(self, octets: Octets, source: Locator, now: float) -> None:
        """One datagram.  Raises nothing; what is dropped is counted by reason."""
        view = memoryview(octets)
        if len(view) < 20 or bytes(view[:4]) != b"RTPS":
            self._engine.dropped(DropReason.NOT_RTPS, source)
            return
        if view[4] != 2:
            self._engine.dropped(DropReason.UNSUPPORTED_VERSION, source)
            return
        prefix = bytes(view[8:20])
        if prefix == self._own_prefix:
            self._engine.dropped(DropReason.OWN_MESSAGE, source)
            return
        incoming = Incoming(source, prefix, bytes(view[6:8]), (2, view[5]), now)
        self._identify(incoming)
        try:
            self._message(incoming, view)
        except MalformedMessage as error:
            reason = (
                DropReason.MUST_UNDERSTAND if isinstance(error, MustUnderstandUnknown) else DropReason.MALFORMED_MESSAGE
            )
            self._engine.dropped(reason, source, str(error))

    def _identify(self, incoming: Incoming) -> None:
        """Whoever spoke is alive: any datagram renews its lease (RTPS 2.5 §8.5.3.3.2 asks for SPDP)."""
        participant = self._engine.participants.get(incoming.prefix)
        incoming.participant = participant
        if participant is not None:
            participant.last_heard = incoming.now
            if participant.heard_from(incoming.source):
                self._engine.host_heard(participant, incoming.now)
            if participant.has_lost_liveliness:
                self._engine.liveliness.revive(participant, incoming.now)

    def _message(self, incoming: Incoming, view: memoryview) -> None:
        if len(view) >= 24 and view[20] == _SRTPS_PREFIX:
            decoded = self._hooks.decode_message(view, incoming.prefix)
            if isinstance(decoded, Outcome):
                self.undecodable(decoded, incoming.source)
                return
            view = memoryview(decoded)
            incoming.protection = _IN_MESSAGE
        self._submessages(incoming, view, 20)

    def _submessages(self, incoming: Incoming, view: memoryview, start: int) -> None:
        """Dispatch what lies in ``view[start:]``.

        Submessages in their usual form - little-endian, with their length - are recognised here, and DATA, INFO_TS and
        envelopes take a way of their own; all others are walked by ``iterate_submessages``, which knows all the rules,
        one at a time, as samples come in long runs.
        """
        position, end, handlers = start, len(view), self._handlers
        unpack_head = SUBMESSAGE_HEAD.unpack_from
        while end - position >= 4:
            kind, flags, length = unpack_head(view, position)
            body = position + 4
            position = body + length
            if kind == _DATA and flags == _LE_DATA_ONLY and length and position <= end and not length & 3:
                if incoming.is_for_us:
                    self._data(incoming, view, body, position)
            elif kind == _SEC_PREFIX and flags == 1 and length == 20:
                position = self._usual_envelope(incoming, view, body - 4, end)
            elif (
                kind == _DATA and flags == _LE_DATA_AND_QOS and length and position <= end and not length & 3
                and (key_hash := key_hash_alone(view, body, position))
            ):  # fmt: skip
                if incoming.is_for_us:
                    self._data(incoming, view, body, position, key_hash)
            elif kind == _INFO_TS and flags == 1 and length == 8 and position <= end:
                seconds, fraction = _TIMESTAMP.unpack_from(view, body)
                incoming.timestamp = seconds << 32 | fraction
            elif kind == _DATA_FRAG and flags & 1 and length and position <= end and not length & 3:
                self._data_frag(incoming, flags, view[body:position])
            elif flags & 1 and length and position <= end and not length & 3 and (handler := handlers.get(kind)):
                handler(incoming, RawSubmessage(kind, flags, view[body:position], body - 4))
            else:
                position = self._general_submessages(incoming, view, body - 4)

    def _general_submessages(self, incoming: Incoming, view: memoryview, start: int) -> int:
        """One submessage, or one SEC_ envelope of several: returns where the next begins."""
        envelope_start = -1
        for raw in iterate_submessages(view, start=start):
            kind = raw.kind
            if envelope_start >= 0:
                if kind == SubmessageKind.SEC_POSTFIX:
                    self._envelope(incoming, view[envelope_start : raw.end])
                    return raw.end
            elif kind == SubmessageKind.SEC_PREFIX:
                envelope_start = raw.offset
            else:
                handler = self._handlers.get(kind)
                if handler is not None:
                    handler(incoming, raw)
                elif kind < 0x80 and kind not in _WITHOUT_EFFECT:  # vendors' own are to be skipped (RTPS 2.5 §8.3.4.1)
                    self._engine.dropped(DropReason.UNSUPPORTED, incoming.source, submessage_name(kind))
                return raw.end
        if envelope_start >= 0:
            raise MalformedMessage("an envelope without its end", element="SEC_PREFIX", offset=envelope_start)
        return len(view)

    def _usual_envelope(self, incoming: Incoming, view: memoryview, start: int, end: int) -> int:
        """A little-endian SEC_PREFIX is at ``view[start]``: returns where what follows its envelope begins."""
        outside = incoming.protection
        if not incoming.is_for_us or outside & _IN_ENVELOPE:
            opened = None
        else:
            opened = self._hooks.open_envelope(view, start, end, incoming.prefix)
        if opened is None:
            past = envelope_end(view, start, end)
            if not past:
                return self._general_submessages(incoming, view, start)
            self._envelope(incoming, view[start:past])
            return past
        submessage, past = opened
        incoming.protection = outside | _IN_ENVELOPE
        kind = submessage[0]
        if kind == _DATA_FRAG:
            self._data_frag(incoming, submessage[1], memoryview(submessage)[4:])
        elif kind == _DATA and submessage[1] == _LE_DATA_ONLY:
            self._data(incoming, submessage, 4, len(submessage))
        else:
            self._submessages(incoming, memoryview(submessage), 0)
        incoming.protection = outside
        return past

    def _envelope(self, incoming: Incoming, octets: memoryview) -> None:
        """SEC_PREFIX to SEC_POSTFIX: whose it is, is told by INFO_DST before anything is decrypted."""
        if not incoming.is_for_us:
            return
        outside = incoming.protection
        if outside & _IN_ENVELOPE:
            raise MalformedMessage("an envelope within an envelope", element="SEC_PREFIX")
        decoded = self._hooks.decode_submessage(octets, incoming.prefix)
        if isinstance(decoded, Outcome):
            self.undecodable(decoded, incoming.source)
            return
        incoming.protection = outside | _IN_ENVELOPE
        self._submessages(incoming, memoryview(decoded), 0)
        incoming.protection = outside

    def undecodable(self, outcome: Outcome, source: Locator | None) -> None:
        """Security did not open something that came from there."""
        match outcome:
            case NotForUs():
                self._engine.dropped(DropReason.NOT_FOR_US, source)
            case NoKeys(key_id):
                self._engine.dropped(DropReason.NO_KEYS, source, key_id.hex())
            case Rejected(reason):
                self._engine.dropped(DropReason.REJECTED_BY_SECURITY, source, reason)

    def _may_ask(self, incoming: Incoming, work: int) -> bool:
        """May this message make us do so much more?  What it asks for in vain it, or the next one, will ask again."""
        if incoming.work + work > _MOST_WORK:
            self._engine.dropped(DropReason.OVERLOADED_MESSAGE, incoming.source)
            return False
        incoming.work += work
        return True

    # --- the receiver's state ----------------------------------------------------------------------------

    def _info_timestamp(self, incoming: Incoming, raw: RawSubmessage) -> None:
        incoming.timestamp = InfoTimestamp.decode(raw.flags, raw.body).timestamp

    def _info_destination(self, incoming: Incoming, raw: RawSubmessage) -> None:
        prefix = bytes(InfoDestination.decode(raw.flags, raw.body).guid_prefix)
        incoming.destination = prefix
        incoming.is_for_us = prefix in (self._own_prefix, _UNKNOWN_PREFIX)
        if not incoming.is_for_us:
            self._engine.dropped(DropReason.NOT_FOR_US, incoming.source)

    def _info_source(self, incoming: Incoming, raw: RawSubmessage) -> None:
        info = InfoSource.decode(raw.flags, raw.body)
        prefix = bytes(info.guid_prefix)
        if prefix != incoming.prefix:
            # Protection proves who sent it.  Nobody may speak under its cover for somebody else.
            if incoming.protection & _IN_ENVELOPE:
                raise MalformedMessage("another source within an envelope", element="INFO_SRC", offset=raw.offset)
            incoming.protection = _CLEAR
        incoming.prefix = prefix
        incoming.vendor_id = info.vendor_id
        incoming.version = info.protocol_version
        incoming.timestamp = None
        incoming.participant = self._engine.participants.get(incoming.prefix)

    # --- DATA --------------------------------------------------------------------------------------------

    def _data(self, incoming: Incoming, view: Octets, start: int, end: int, key_hash: bytes = b"") -> None:
        """A sample in its usual form, its body at ``view[start:end]``: ``key_hash`` is all of its inline QoS, if any.

        The general form is :meth:`_general_data`; both end in :meth:`_change`.
        """
        if end - start < 24:
            raise MalformedMessage("a DATA without room for its payload", element="DATA", offset=start)
        _, to_inline_qos, reader_id, writer_id, high, low = DATA_BODY.unpack_from(view, start)
        number = high << 32 | low
        payload_start = start + 4 + to_inline_qos + (_KEY_HASH_QOS if key_hash else 0)
        if not 0 < number < NUMBERS_END or to_inline_qos < 16 or to_inline_qos & 3 or end - payload_start < 4:
            raise MalformedMessage(f"number {number}, octetsToInlineQos {to_inline_qos}", element="DATA", offset=start)
        remote = self._engine.remote_writers.get(incoming.prefix + writer_id)
        if remote is None:
            inline = InlineQos(key_hash=key_hash) if key_hash else None
            self._from_unmatched(incoming, writer_id, reader_id, number, view[payload_start:end], inline)
            return
        if not self._hooks.admits(remote.guid, incoming.protection):
            self._engine.dropped(DropReason.CLEAR_TEXT, incoming.source)
            return
        payload = self._hooks.decode_payload(remote.guid, view[payload_start:end])
        if isinstance(payload, Outcome):
            self.undecodable(payload, incoming.source)
            return
        timestamp = incoming.timestamp
        change = CacheChange(
            ChangeKind.ALIVE,
            remote.guid,
            number,
            bytes(payload),
            b"",
            timestamp if timestamp is not None else self._engine.wall_ticks(),
            key_hash=key_hash,
        )
        self._change(incoming, remote, reader_id, change)

    def _general_data(self, incoming: Incoming, raw: RawSubmessage) -> None:
        if not incoming.is_for_us:
            return
        data = Data.decode(raw.flags, raw.body)
        _check_number(data.writer_sn, raw)
        inline = InlineQos.read(data.inline_qos)
        remote = self._engine.remote_writers.get(incoming.prefix + data.writer_id)
        if remote is None:
            self._from_unmatched(
                incoming, data.writer_id, data.reader_id, data.writer_sn, data.serialized_payload, inline
            )
            return
        if not self._hooks.admits(remote.guid, incoming.protection):
            self._engine.dropped(DropReason.CLEAR_TEXT, incoming.source)
            return
        if data.non_standard_payload and not self._hooks.protects_payload(remote.guid):
            self._not_cdr(incoming, remote, data.reader_id, data.writer_sn)
            return
        payload: Octets | Outcome = data.serialized_payload
        is_bare_end = not len(data.serialized_payload) and bool(inline.status & 3)
        if len(data.serialized_payload) or (is_bare_end and incoming.protection == _CLEAR):
            payload = self._hooks.decode_payload(remote.guid, data.serialized_payload)
        if isinstance(payload, Outcome):
            self.undecodable(payload, incoming.source)
            if is_bare_end:  # whoever is honest has said all that he has to say under this number
                self._nothing(incoming, remote, data.reader_id, data.writer_sn)
            return
        self._joined(incoming, remote, data.reader_id, data.writer_sn, bytes(payload), inline, is_key=data.is_key)

    def _joined(
        self,
        incoming: Incoming,
        remote: RemoteWriter,
        reader_id: bytes,
        number: int,
        payload: bytes | bytearray,
        inline: InlineQos,
        *,
        is_key: bool,
    ) -> None:
        """A whole change with what stood beside it: which end of an instance, if any, is it?"""
        kind = ChangeKind(inline.status & 3) if is_key or not len(payload) else ChangeKind.ALIVE
        coherence = inline.coherence_of(has_sample=bool(is_key or len(payload) or kind))
        if kind is ChangeKind.ALIVE and (is_key or not len(payload)) and not (coherence and coherence.is_end):
            self._nothing(incoming, remote, reader_id, number, is_filtered=bool(inline.status & StatusInfo.FILTERED))
            return
        timestamp = incoming.timestamp
        change = CacheChange(
            kind,
            remote.guid,
            number,
            payload,
            b"",
            timestamp if timestamp is not None else self._engine.wall_ticks(),
            key_hash=inline.key_hash,
            related=inline.related,
            coherence=coherence,
        )
        change.verdicts = inline.verdicts
        change.original = inline.original
        self._change(incoming, remote, reader_id, change)

    def _nothing(
        self, incoming: Incoming, remote: RemoteWriter, reader_id: bytes, number: int, *, is_filtered: bool = False
    ) -> None:
        """A change that says nothing to us: filtered out by the writer, say.  Its number counts as received."""
        for reader, proxy in remote.readers:
            if reader_id in (_UNKNOWN_ID, reader.guid[12:]):
                local = self._engine.local_readers[reader.guid]
                if is_filtered and local.sets is not None:
                    local.sets.filtered(proxy.guid, number, number + 1)
                reader.receive_gap(proxy, number, NumberSet(number + 1), incoming.now)
                self._engine.proxy_touched(reader, proxy)
                self._engine.presentation.passed(local, proxy, incoming.now)

    def _change(self, incoming: Incoming, remote: RemoteWriter, reader_id: bytes, change: CacheChange) -> None:
        """To every matched reader that it is addressed to."""
        now = incoming.now
        if reader_id != _UNKNOWN_ID and all(reader_id != reader.guid[12:] for reader, _ in remote.readers):
            self._engine.dropped(DropReason.UNKNOWN_ENDPOINT, incoming.source)
        for reader, proxy in remote.readers:
            if reader_id != _UNKNOWN_ID and reader_id != reader.guid[12:]:
                continue
            local = self._engine.local_readers[reader.guid]
            if change.original is not None and reader.is_repeated(change):
                self._nothing(incoming, remote, reader.guid[12:], change.sequence_number)
                continue
            if change.is_end_of_set:
                if local.sets is None:
                    self._nothing(incoming, remote, reader.guid[12:], change.sequence_number)
                    continue
            elif local.keys is not None:
                try:
                    key = local.key_of(change)
                except MalformedSample as error:
                    self._engine.sample_malformed(local, change, str(error))
                    key = None
                if key is None:
                    self._nothing(incoming, remote, reader.guid[12:], change.sequence_number)
                    continue
                change.key = key
            due = proxy.schedule.due
            lost = reader.receive_data(proxy, change, now)
            if proxy.schedule.due != due:
                self._engine.proxy_touched(reader, proxy)
            if lost:
                self._engine.samples_lost(
                    local, proxy, lost, change.sequence_number - lost, SampleLossReason.BEST_EFFORT
                )
        if remote.asserts_by_data:
            self._engine.liveliness.writer_asserted(remote.guid, now)
        if remote.defragmenter:
            remote.forget_settled(change.sequence_number)

    def _from_unmatched(
        self,
        incoming: Incoming,
        writer_id: bytes,
        reader_id: bytes,
        number: int,
        payload: Octets,
        inline: InlineQos | None = None,
    ) -> None:
        """DATA of a writer that no reader here is matched with.  SPDP is the one that is expected."""
        if writer_id == SPDP_WRITER:
            guid = Guid(incoming.prefix + writer_id)
            if incoming.participant is not None and not self._hooks.admits(guid, incoming.protection):
                # It is alive (see `_identify`), and that is all that we believe.
                if inline is not None and inline.status:
                    self._engine.dropped(DropReason.CLEAR_TEXT, incoming.source, f"goodbye of {guid.participant}")
                return
            change = CacheChange(
                ChangeKind((inline.status & 3) if inline is not None else 0),
                guid,
                number,
                bytes(payload),
                key_hash=inline.key_hash if inline is not None else b"",
            )
            if self._may_ask(incoming, _WORK_OF_A_PARTICIPANT):
                self._engine.discovery.receive_spdp(incoming, change)
            return
        self._unmatched(incoming, writer_id)

    def _unmatched(self, incoming: Incoming, writer_id: bytes) -> None:
        """No reader of ours is matched with the writer that says something."""
        reason = DropReason.UNMATCHED
        if incoming.participant is None:
            reason = DropReason.UNKNOWN_PARTICIPANT
        elif not (EntityId(writer_id).is_builtin or self._engine.known_writers.get(Guid(incoming.prefix + writer_id))):
            reason = DropReason.UNKNOWN_WRITER
        self._engine.dropped(reason, incoming.source)

    def _data_frag(self, incoming: Incoming, flags: int, body: memoryview) -> None:
        """One run of fragments: decoded and joined once, whoever reads it."""
        if not incoming.is_for_us:
            return
        run = FragmentRun(flags, body)
        if run.writer_sn >= NUMBERS_END:
            raise _absurd(run.writer_sn, _DATA_FRAG)
        remote = self._engine.remote_writers.get(incoming.prefix + run.writer_id)
        if remote is None:
            self._unmatched(incoming, run.writer_id)
            return
        if not self._hooks.admits(remote.guid, incoming.protection):
            self._engine.dropped(DropReason.CLEAR_TEXT, incoming.source)
            return
        if run.sample_size > self._engine.config.max_sample_size:
            self._engine.dropped(DropReason.SAMPLE_TOO_LARGE, incoming.source, f"{run.sample_size} octets")
            return
        if not self._is_wanted(incoming, remote, run):
            return
        is_begun = run.writer_sn in remote.defragmenter
        if not is_begun and not self._may_ask(incoming, _WORK_OF_A_FRAGMENTED_SAMPLE):
            return
        is_protected = self._hooks.protects_payload(remote.guid)
        if run.non_standard_payload and not is_protected:
            self._not_cdr(incoming, remote, run.reader_id, run.writer_sn)
            return
        # Protection makes a run longer than padding does.  One that was not made longer is part of a sample that was
        # protected as a whole (OpenDDS): it cannot be opened before the last fragment is here.
        is_sealed = is_protected and len(run.payload) < run.length + 4
        begun: PartialSample | None = None
        place: memoryview | None = None
        if is_protected and not is_sealed and run.length >= _WORTH_A_PLACE:
            begun = remote.defragmenter.begin(
                run.writer_sn, run.reader_id, run.length, sample_size=run.sample_size, fragment_size=run.fragment_size
            )
            place = None if begun is None else begun.place_of(run.first, run.count)
        fragments: Octets | Outcome = run.payload
        if not is_sealed:
            fragments = self._hooks.decode_payload(remote.guid, run.payload, place)
        if isinstance(fragments, Outcome):
            self.undecodable(fragments, incoming.source)
            return
        if len(fragments) < run.length:
            raise MalformedMessage(f"{len(fragments)} octets of {run.length}", element="DATA_FRAG")
        # Read at once: it lies in a buffer that holds something else when the last fragment comes.
        inline: InlineQos | None = None
        if run.key_hash:
            inline = InlineQos(key_hash=run.key_hash)
        elif run.inline_qos is not None:
            inline = InlineQos.read(run.inline_qos)
        self._add_fragments(incoming, remote, run, memoryview(fragments), inline, is_sealed=is_sealed, begun=begun)

    def _not_cdr(self, incoming: Incoming, remote: RemoteWriter, reader_id: bytes, number: int) -> None:
        """Flag N.  RTPS 2.5 §8.3.8.2: only who has agreed on such a payload can read it."""
        self._engine.dropped(DropReason.UNSUPPORTED, incoming.source, "a payload that is no CDR")
        self._nothing(incoming, remote, reader_id, number)

    def _is_wanted(self, incoming: Incoming, remote: RemoteWriter, run: FragmentRun) -> bool:
        """Does any reader lack this sample?  Each is told that it exists."""
        wanted = False
        for reader, proxy in remote.readers:
            if run.reader_id in (_UNKNOWN_ID, reader.guid[12:]):
                wanted = reader.fragment_received(proxy, run.writer_sn, incoming.now) or wanted
        return wanted

    def _add_fragments(
        self,
        incoming: Incoming,
        remote: RemoteWriter,
        run: FragmentRun,
        fragments: memoryview,
        inline: InlineQos | None,
        *,
        is_sealed: bool,
        begun: PartialSample | None = None,
    ) -> None:
        defragmenter = remote.defragmenter
        dropped = defragmenter.dropped
        sample = defragmenter.add(
            run.writer_sn,
            run.reader_id,
            sample_size=run.sample_size,
            fragment_size=run.fragment_size,
            first=run.first,
            count=run.count,
            fragments=fragments,
            now=incoming.now,
            is_sealed=is_sealed,
            begun=begun,
        )
        if defragmenter.dropped != dropped:
            self._engine.dropped(DropReason.TABLE_FULL_FRAGMENTS, incoming.source)
        if sample is None:
            return
        if inline is not None or sample.timestamp is None:
            # Cyclone DDS sends inline QoS with the first fragment only, which may come last.
            sample.inline_qos = inline or sample.inline_qos
            sample.timestamp = incoming.timestamp
        if sample.is_complete:
            self._sample_complete(incoming, remote, run, sample)

    def _sample_complete(
        self, incoming: Incoming, remote: RemoteWriter, run: FragmentRun, sample: PartialSample
    ) -> None:
        octets: bytes | bytearray = sample.octets
        if sample.is_sealed:
            payload = self._hooks.decode_payload(remote.guid, octets)
            if isinstance(payload, Outcome):
                self.undecodable(payload, incoming.source)
                return
            octets = bytes(payload)
        timestamp, incoming.timestamp = incoming.timestamp, sample.timestamp
        inline = sample.inline_qos if isinstance(sample.inline_qos, InlineQos) else InlineQos()
        self._joined(incoming, remote, sample.reader_id, run.writer_sn, octets, inline, is_key=run.is_key)
        incoming.timestamp = timestamp

    # --- HEARTBEAT, GAP ----------------------------------------------------------------------------------

    def _pairs(self, incoming: Incoming, writer_id: bytes, reader_id: bytes) -> list[tuple[LocalReader, WriterProxy]]:
        """The local readers that are matched with this writer and meant by the submessage."""
        if not incoming.is_for_us:
            return []
        remote = self._engine.remote_writers.get(incoming.prefix + writer_id)
        if remote is None:
            self._unmatched(incoming, writer_id)
            return []
        if not self._hooks.admits(remote.guid, incoming.protection):
            self._engine.dropped(DropReason.CLEAR_TEXT, incoming.source)
            return []
        pairs = [
            (self._engine.local_readers[reader.guid], proxy)
            for reader, proxy in remote.readers
            if reader_id in (_UNKNOWN_ID, reader.guid[12:])
        ]
        if not pairs:
            self._engine.dropped(DropReason.UNKNOWN_ENDPOINT, incoming.source)
        return pairs

    def _heartbeat(self, incoming: Incoming, raw: RawSubmessage) -> None:
        heartbeat = Heartbeat.decode(raw.flags, raw.body)
        _check_number(heartbeat.last_sn, raw)
        restarted = False
        pairs = self._pairs(incoming, heartbeat.writer_id, heartbeat.reader_id)
        for local, proxy in pairs:
            due = proxy.schedule.due
            self._engine.presentation.heartbeat(local, proxy, heartbeat)
            lost = local.behavior.receive_heartbeat(
                proxy, heartbeat.first_sn, heartbeat.last_sn, heartbeat.count, incoming.now, final=heartbeat.final
            )
            if lost:
                self._engine.samples_lost(local, proxy, lost, heartbeat.first_sn - lost, SampleLossReason.NOT_AVAILABLE)
            if proxy.schedule.due != due:
                self._engine.proxy_touched(local.behavior, proxy)
            self._engine.presentation.passed(local, proxy, incoming.now)
            restarted = restarted or proxy.contradictions >= _CONTRADICTIONS_OF_A_RESTART
        self._forget_settled(incoming, heartbeat.writer_id)
        # A participant that may not say in clear that it changed does not begin anew by its numbers: HEARTBEATs of the
        # past can be sent again by anybody, protected as they are.  Such a one has to authenticate anew.
        if (
            restarted
            and self._hooks.admits(incoming.prefix + SPDP_WRITER, incoming.protection)
            and self._may_ask(incoming, _WORK_OF_A_PARTICIPANT)
        ):
            self._engine.discovery.participant_restarted(incoming)
        if heartbeat.liveliness and pairs:
            self._engine.liveliness.writer_asserted(Guid(incoming.prefix + heartbeat.writer_id), incoming.now)

    def _heartbeat_frag(self, incoming: Incoming, raw: RawSubmessage) -> None:
        """RTPS 2.5 §8.3.8.7: ask at once for fragments that should be here.  Ignored for samples of which none is."""
        heartbeat = HeartbeatFrag.decode(raw.flags, raw.body)
        _check_number(heartbeat.writer_sn, raw)
        if not self._may_ask(incoming, _WORK_OF_A_FRAGMENTED_SAMPLE):
            return
        for local, proxy in self._pairs(incoming, heartbeat.writer_id, heartbeat.reader_id):
            if proxy.is_reliable and heartbeat.writer_sn >= proxy.next_sn:
                self._engine.fragments_announced(local, proxy, heartbeat.writer_sn, heartbeat.last_fragment_num)

    def _gap(self, incoming: Incoming, raw: RawSubmessage) -> None:
        gap = Gap.decode(raw.flags, raw.body)
        _check_number(max(gap.gap_start, gap.gap_list.end), raw)
        if not self._may_ask(incoming, gap.gap_list.bitmap.bit_count()):
            return
        for local, proxy in self._pairs(incoming, gap.writer_id, gap.reader_id):
            if local.sets is not None and gap.filtered_count:
                local.sets.gap_received(proxy.guid, gap.gap_start, gap.gap_list, gap.filtered_count)
            local.behavior.receive_gap(proxy, gap.gap_start, gap.gap_list, incoming.now)
            self._engine.proxy_touched(local.behavior, proxy)
            self._engine.presentation.passed(local, proxy, incoming.now)
        self._forget_settled(incoming, gap.writer_id)

    def _forget_settled(self, incoming: Incoming, writer_id: bytes) -> None:
        """Numbers may have become irrelevant of which fragments are here."""
        remote = self._engine.remote_writers.get(incoming.prefix + writer_id)
        if remote is not None and remote.defragmenter:
            remote.forget_settled()

    # --- ACKNACK -----------------------------------------------------------------------------------------

    def _acknack(self, incoming: Incoming, raw: RawSubmessage) -> None:
        acknack = AckNack.decode(raw.flags, raw.body)
        _check_number(acknack.reader_sn_state.end, raw)
        if not incoming.is_for_us:
            return
        writer = self._engine.local_writers.get(Guid(self._own_prefix + acknack.writer_id))
        reader_guid = Guid(incoming.prefix + acknack.reader_id)
        proxy = writer.behavior.readers.get(reader_guid) if writer is not None else None
        if writer is None or proxy is None:
            self._engine.dropped(DropReason.UNKNOWN_READER, incoming.source)
            return
        if not self._hooks.admits(reader_guid, incoming.protection):
            self._engine.dropped(DropReason.CLEAR_TEXT, incoming.source)
            return
        if not self._may_ask(incoming, acknack.reader_sn_state.bitmap.bit_count()):
            return
        acked_sn = proxy.acked_sn
        answers = writer.behavior.receive_acknack(
            proxy, acknack.reader_sn_state, acknack.count, incoming.now, final=acknack.final
        )
        if proxy.acked_sn > acked_sn:
            self._engine.recorder.acknowledged(writer.guid, reader_guid, proxy.acked_sn)
        self._engine.writer_answers(writer, answers)

    def _nack_frag(self, incoming: Incoming, raw: RawSubmessage) -> None:
        nack = NackFrag.decode(raw.flags, raw.body)
        _check_number(nack.writer_sn, raw)
        if not incoming.is_for_us:
            return
        writer = self._engine.local_writers.get(Guid(self._own_prefix + nack.writer_id))
        reader_guid = Guid(incoming.prefix + nack.reader_id)
        proxy = writer.behavior.readers.get(reader_guid) if writer is not None else None
        if writer is None or proxy is None:
            self._engine.dropped(DropReason.UNKNOWN_READER, incoming.source)
            return
        if not self._hooks.admits(reader_guid, incoming.protection):
            self._engine.dropped(DropReason.CLEAR_TEXT, incoming.source)
            return
        if not self._may_ask(incoming, nack.fragment_number_state.bitmap.bit_count()):
            return
        answers = writer.behavior.receive_nack_frag(
            proxy, nack.writer_sn, nack.fragment_number_state, nack.count, incoming.now
        )
        self._engine.writer_answers(writer, answers)


def _check_number(number: int, raw: RawSubmessage) -> None:
    if number >= NUMBERS_END:
        raise _absurd(number, raw.kind, raw.offset)


def _absurd(number: int, kind: int, offset: int = 0) -> MalformedMessage:
    return MalformedMessage(f"no writer reaches {number}", element=submessage_name(kind), offset=offset)
