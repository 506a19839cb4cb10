"""Outbound: transmissions become submessages, submessages become messages, messages become datagrams to send.

RTPS 2.5 §8.3 and §8.4.  The hooks protect payload, submessage and message on the way; they are asked for the
octets that this adds before anything is packed.  Submessages of different endpoints do not share a message, and a
destination is never changed within one: some receivers drop the rest of a message after a submessage that
they cannot place, and some keep an INFO_DST longer than they should (Fast DDS does both).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

from ..behavior.reader_proxy import ReaderProxy
from ..behavior.transmissions import (
    SendAckNack,
    SendData,
    SendFragments,
    SendGap,
    SendHeartbeat,
    SendHeartbeatFrag,
    SendNackFrag,
    WriterTransmission,
)
from ..behavior.writer_proxy import WriterProxy
from ..messages import fast
from ..messages.acknack import AckNack, NackFrag
from ..messages.content_filter_info import encode_content_filter_info
from ..messages.data import Data
from ..messages.data_frag import DataFrag
from ..messages.gap import Gap
from ..messages.heartbeat import Heartbeat, HeartbeatFrag
from ..messages.interpreter import InfoDestination
from ..messages.packer import MessagePacker
from ..serialization.parameter_id import ParameterId
from ..serialization.parameter_list import ParameterList
from ..spi import Octets, Overhead, Parts, SecurityHooks
from ..structure.cache_change import CacheChange, ChangeKind
from ..structure.coherence import SEQUENCE_NUMBER_UNKNOWN, Coherence
from ..structure.guid import EntityId, Guid
from ..structure.locator import Locator
from .effects import SendDatagram
from .local_endpoints import LocalWriter

__all__ = ["Outbound", "fragment_octets_for"]

_PADDING = (b"", b"\0\0\0", b"\0\0", b"\0")
_UNKNOWN_ID = bytes(4)
_KEY_HASH_OCTETS = 16
# RTPS header, INFO_DST, INFO_TS, the head of a DATA_FRAG, a HEARTBEAT: what travels with a fragment.
_FRAGMENT_COMPANY = 20 + 16 + 12 + 36 + 32
_LARGEST_FRAGMENT = 65_000  # fragmentSize is a uint16, and a datagram ends at 65,507
# With so many receivers that their MACs fill a message, a larger message is the lesser evil than nothing but MACs.
_LEAST_FRAGMENT = 512


def fragment_octets_for(max_message_octets: int, configured: int | None, added: Overhead) -> int:
    """The fragment size: as configured, else what fills a message beside its company and what protection adds."""
    unprotected = max_message_octets - _FRAGMENT_COMPANY
    room = unprotected - added.payload - added.submessage - added.message
    room = max(room, min(unprotected, _LEAST_FRAGMENT))
    return max(min(configured or room, room, _LARGEST_FRAGMENT) & ~7, 8)


class Outbound:
    """Holds the messages under construction.  ``emit`` takes the finished ones."""

    def __init__(
        self,
        header: bytes,
        max_message_octets: int,
        fragment_size: int | None,
        hooks: SecurityHooks,
        emit: Callable[[SendDatagram], None],
    ) -> None:
        self._header = header
        self._max_message_octets = max_message_octets
        self._fragment_size = fragment_size
        self._hooks = hooks
        self._emit = emit
        self._dirty_writers: dict[Guid, LocalWriter] = {}
        # Messages to one participant, by sending entity, prefix and locators.
        self._directed: dict[tuple[bytes, bytes, tuple[Locator, ...]], tuple[MessagePacker, Guid, int]] = {}

    def new_packer(self) -> MessagePacker:
        """For a writer's messages to all its readers, of whom there is none yet: see :meth:`receivers_changed`."""
        return MessagePacker(self._header, self._max_message_octets)

    def receivers_changed(self, writer: LocalWriter) -> None:
        """Protection may grow with the number of receivers, and messages and fragments have to leave it room."""
        added = self._hooks.overhead(writer.guid, writer.receivers)
        writer.packer.capacity = self._max_message_octets - added.message
        writer.behavior.fragment_octets = fragment_octets_for(self._max_message_octets, self._fragment_size, added)
        if added.payload:
            writer.joining_readers = frozenset(filter(self._hooks.opens_after_joining, writer.receivers))

    def message_size_changed(self, max_message_octets: int, writers: Iterable[LocalWriter]) -> None:
        """We send through other interfaces.  No message may be open; what is in a history keeps its fragments' size."""
        self._max_message_octets = max_message_octets
        for writer in writers:
            self.receivers_changed(writer)

    @property
    def is_idle(self) -> bool:
        return not self._dirty_writers and not self._directed

    # --- writers -----------------------------------------------------------------------------------------

    def send_change(self, writer: LocalWriter, change: CacheChange) -> None:
        """The fast path for a sample: DATA to all matched readers.  General form: :meth:`_send_data`."""
        behavior = writer.behavior
        if not behavior.locators:
            return
        is_alone = change.related is None and change.original is None and change.coherence is None
        if change.kind is not ChangeKind.ALIVE or not is_alone:
            self._send_data(writer, change, None)
            return
        payload = self._hooks.encode_payload(writer.guid, change.payload)
        size = len(payload)
        padding = _PADDING[size & 3]
        writer_id, number, key_hash = writer.guid[12:], change.sequence_number, change.key_hash
        if key_hash:
            head = fast.data_head_with_key_hash(_UNKNOWN_ID, writer_id, number, key_hash, size + len(padding))
        else:
            head = fast.data_head(_UNKNOWN_ID, writer_id, number, size + len(padding))
        submessage = self._hooks.encode_submessage(writer.guid, writer.receivers, (head, payload, padding))
        self._append_to_group(writer, submessage, change.source_timestamp)

    def transmit(self, writer: LocalWriter, transmissions: Sequence[WriterTransmission]) -> None:
        for item in transmissions:
            match item:
                case SendData(change, None):
                    self.send_change(writer, change)
                case SendData(change, reader):
                    self._send_data(writer, change, reader)
                case SendFragments(change, first, last, reader):
                    # A reader that joins first gets other octets than the rest, so each is sent its own.
                    one_by_one = reader is None and writer.joining_readers
                    for recipient in list(writer.behavior.readers.values()) if one_by_one else (reader,):
                        self._send_fragments(writer, change, first, last, recipient)
                case SendHeartbeat():
                    self._send_heartbeat(writer, item)
                case SendHeartbeatFrag(change, last, count):
                    fragments = HeartbeatFrag(
                        EntityId.UNKNOWN, writer.guid.entity_id, change.sequence_number, last, count
                    )
                    self._append(writer, None, fragments.encode(), None)
                case SendGap(reader, start, irrelevant):
                    gap = Gap(reader.entity_id, writer.guid.entity_id, start, irrelevant)
                    self._append(writer, reader, gap.encode(), None)

    def _send_data(self, writer: LocalWriter, change: CacheChange, reader: ReaderProxy | None) -> None:
        payload: Octets = change.payload if change.kind is ChangeKind.ALIVE else _key_payload(change.payload)
        if payload:
            payload = self._hooks.encode_payload(writer.guid, payload)
        data = Data(
            reader.entity_id if reader is not None else EntityId.UNKNOWN,
            writer.guid.entity_id,
            change.sequence_number,
            _inline_qos(change, reader),
            payload,
            is_key=change.kind is not ChangeKind.ALIVE,
        )
        self._append(writer, reader, data.encode(), change.source_timestamp)

    def _send_fragments(
        self, writer: LocalWriter, change: CacheChange, first: int, last: int, reader: ReaderProxy | None
    ) -> None:
        """To all readers, a message that the next fragment does not fit into leaves before that one is made."""
        size, sample_size, fits = change.fragment_octets, len(change.payload), writer.packer.fits
        for number in range(first, last + 1):
            self._send_fragment(writer, change, number, reader)
            if reader is None and number < last and not fits(min(size, sample_size - number * size)):
                self._emit_group(writer)

    def _send_fragment(self, writer: LocalWriter, change: CacheChange, number: int, reader: ReaderProxy | None) -> None:
        size = change.fragment_octets
        count, sample_size = 1, len(change.payload)
        if reader is not None and reader.guid in writer.joining_readers:
            if change.sealed is None:
                change.sealed = self._hooks.encode_payload(writer.guid, change.payload)
            # What protection adds may make a fragment more; it goes with the last, so that all count fragments alike.
            is_last, sample_size = number * size >= sample_size, len(change.sealed)
            count = -(-sample_size // size) - number + 1 if is_last else 1
            payload: Octets = memoryview(change.sealed)[(number - 1) * size : (number - 1 + count) * size]
        else:
            octets = memoryview(change.payload)[(number - 1) * size : number * size]
            payload = self._hooks.encode_payload(writer.guid, octets)
        padding = _PADDING[len(payload) & 3]
        payload_octets = len(payload) + len(padding)
        if _is_usual(change, reader):
            head = fast.data_frag_head(
                reader.guid[12:] if reader is not None else _UNKNOWN_ID,
                writer.guid[12:],
                change.sequence_number,
                number,
                count,
                size,
                sample_size,
                change.key_hash if number == 1 else b"",
                payload_octets,
            )
        else:
            head = DataFrag(
                reader.entity_id if reader is not None else EntityId.UNKNOWN,
                writer.guid.entity_id,
                change.sequence_number,
                number,
                count,
                size,
                sample_size,
                _inline_qos(change, reader) if number == 1 else None,
                is_key=change.kind is not ChangeKind.ALIVE,
            ).encode_head(payload_octets)
        self._append(writer, reader, (head, payload, padding), change.source_timestamp)

    def _send_heartbeat(self, writer: LocalWriter, item: SendHeartbeat) -> None:
        for reader in item.readers if item.readers is not None else (None,):
            reader_id = reader.entity_id if reader is not None and len(item.readers or ()) == 1 else EntityId.UNKNOWN
            heartbeat = Heartbeat(
                reader_id,
                writer.guid.entity_id,
                item.first,
                item.last,
                item.count,
                item.final,
                item.liveliness,
                writer.group_info(item.first, item.last),
            )
            self._append(writer, reader, heartbeat.encode(), None)

    def _append(
        self, writer: LocalWriter, reader: ReaderProxy | None, submessage: bytes | Parts, ticks: int | None
    ) -> None:
        parts: Parts = (submessage,) if isinstance(submessage, bytes) else submessage
        if reader is None:
            if writer.behavior.locators:
                parts = self._hooks.encode_submessage(writer.guid, writer.receivers, parts)
                self._append_to_group(writer, parts, ticks)
        elif reader.locators:
            parts = self._hooks.encode_submessage(writer.guid, (reader.guid,), parts)
            priority = writer.data.qos.transport_priority.value
            self._append_directed(writer.guid, reader.guid, reader.locators, parts, ticks, priority)

    def _append_to_group(self, writer: LocalWriter, parts: Parts, ticks: int | None) -> None:
        """``ticks``: the sample's timestamp; None for what is no sample."""
        if not parts:
            return  # it must not leave
        packer = writer.packer
        size = sum(map(len, parts))
        if not packer.fits(size + 12):
            self._emit_group(writer)
        if ticks is not None:
            writer.has_fresh_samples = True
            if ticks != packer.timestamp:
                packer.add((fast.timestamp(ticks),), 12)
                packer.timestamp = ticks
        packer.add(parts, size)
        self._dirty_writers[writer.guid] = writer

    # --- readers -----------------------------------------------------------------------------------------

    def answer(self, reader: Guid, writer: WriterProxy, answers: Sequence[SendAckNack | SendNackFrag]) -> None:
        """ACKNACK and NACK_FRAG to one writer."""
        if not writer.locators:
            return
        submessage: AckNack | NackFrag
        for item in answers:
            match item:
                case SendAckNack(missing, count, final):
                    submessage = AckNack(reader.entity_id, writer.entity_id, missing, count, final)
                case SendNackFrag(sequence_number, missing, count):
                    submessage = NackFrag(reader.entity_id, writer.entity_id, sequence_number, missing, count)
            parts = self._hooks.encode_submessage(reader, (writer.guid,), (submessage.encode(),))
            self._append_directed(reader, writer.guid, writer.locators, parts, None)

    def _append_directed(
        self,
        sender: Guid,
        receiver: Guid,
        locators: tuple[Locator, ...],
        parts: Parts,
        ticks: int | None,
        priority: int = 0,
    ) -> None:
        if not parts:
            return  # it must not leave
        prefix = receiver.prefix
        key = (sender[12:], prefix, locators)
        held = self._directed.get(key)
        if held is None:
            capacity = self._max_message_octets - self._hooks.overhead(sender, (receiver,)).message
            packer = MessagePacker(self._header + InfoDestination(prefix).encode(), capacity)
            held = self._directed[key] = (packer, receiver, priority)
        packer = held[0]
        size = sum(map(len, parts))
        if not packer.fits(size + 12):
            self._emit_message(packer, (receiver,), locators, priority)
        if ticks is not None and ticks != packer.timestamp:
            packer.add((fast.timestamp(ticks),), 12)
            packer.timestamp = ticks
        packer.add(parts, size)

    # --- out ---------------------------------------------------------------------------------------------

    def send_plain(self, submessages: Parts, locators: tuple[Locator, ...]) -> None:
        """A message that is never protected (SPDP, the stateless topic), at once."""
        self._emit(SendDatagram(locators, [self._header, *submessages]))

    def flush(self) -> None:
        """Close every open message.  A HEARTBEAT rides behind the samples of each reliable writer."""
        if self._dirty_writers:
            for writer in list(self._dirty_writers.values()):
                if writer.has_fresh_samples:
                    self._piggyback(writer)
                self._emit_group(writer)
            self._dirty_writers.clear()
        if self._directed:
            directed, self._directed = self._directed, {}
            for (_, _, locators), (packer, receiver, priority) in directed.items():
                self._emit_message(packer, (receiver,), locators, priority)

    def _piggyback(self, writer: LocalWriter) -> None:
        """Only behind samples: a final HEARTBEAT right behind one that asks would take the question back (Fast DDS)."""
        writer.has_fresh_samples = False
        item = writer.behavior.piggyback_heartbeat()
        if item is None:
            return
        if writer.group is not None:
            self._send_heartbeat(writer, item)
            return
        octets = fast.heartbeat(_UNKNOWN_ID, writer.guid[12:], item.first, item.last, item.count, final=item.final)
        parts = self._hooks.encode_submessage(writer.guid, writer.receivers, (octets,))
        if not parts:
            return
        size = sum(map(len, parts))
        if not writer.packer.fits(size):
            self._emit_group(writer)
        writer.packer.add(parts, size)

    def _emit_group(self, writer: LocalWriter) -> None:
        priority = writer.data.qos.transport_priority.value
        self._emit_message(writer.packer, writer.receivers, writer.behavior.locators, priority)

    def _emit_message(
        self, packer: MessagePacker, receivers: tuple[Guid, ...], locators: tuple[Locator, ...], priority: int
    ) -> None:
        if packer.is_empty:
            return
        parts: Parts = packer.take()
        if locators:
            parts = self._hooks.encode_message(receivers, parts)
            if parts:
                self._emit(SendDatagram(locators, parts, priority))


def _key_payload(payload: Octets) -> Octets:
    """The payload of a dispose or unregister, made longer than a key hash by zeros where it is not.

    Fast DDS takes a key-only payload of 16 octets or less, header and all, for the key hash itself.
    """
    return payload if not 0 < len(payload) <= _KEY_HASH_OCTETS else bytes(payload).ljust(_KEY_HASH_OCTETS + 4, b"\0")


def _is_usual(change: CacheChange, reader: ReaderProxy | None) -> bool:
    """Is it a sample, beside which nothing has to travel but a key hash, if that?"""
    return (
        change.kind is ChangeKind.ALIVE
        and change.related is None
        and change.original is None
        and change.coherence is None
        and (reader is None or reader.content_filter is None)
    )


def _inline_qos(change: CacheChange, reader: ReaderProxy | None) -> ParameterList | None:
    """What must travel beside the payload: which end this is, and whose; and what the sample answers.

    The key hash goes with every dispose and unregister, and the serialised key too: some stacks need the one
    (Fast DDS), some the other (Cyclone DDS).  With samples it goes where their key is protected.  A reader whose
    content filter was evaluated here need not do it again.
    """
    if not change.key_hash and _is_usual(change, reader):
        return None
    content_filter = reader.content_filter if reader is not None and change.kind is ChangeKind.ALIVE else None
    coherence = change.coherence
    parameters = ParameterList(little_endian=True)
    if content_filter is not None:
        verdicts = {content_filter.signature: True}
        parameters.add(ParameterId.CONTENT_FILTER_INFO, encode_content_filter_info(verdicts))
    if change.key_hash:
        parameters.add(ParameterId.KEY_HASH, change.key_hash)
    if change.kind is not ChangeKind.ALIVE:
        parameters.add(ParameterId.STATUS_INFO, bytes((0, 0, 0, change.kind)))
    if change.related is not None:
        guid, number = change.related
        parameters.add(ParameterId.RELATED_SAMPLE_IDENTITY, guid + _number(number))
    if change.original is not None:
        guid, number = change.original
        parameters.add(ParameterId.ORIGINAL_WRITER_INFO, guid + _number(number))
    if coherence is not None:
        _add_coherence(parameters, coherence)
    return parameters


def _add_coherence(parameters: ParameterList, coherence: Coherence) -> None:
    """RTPS 2.5 §8.7.5, §8.7.6: what ends a set belongs to none of its writer's."""
    if coherence.is_end:
        parameters.add(ParameterId.COHERENT_SET, _number(SEQUENCE_NUMBER_UNKNOWN))
    elif coherence.set_sn:
        parameters.add(ParameterId.COHERENT_SET, _number(coherence.set_sn))
    if coherence.group_set_sn:
        parameters.add(ParameterId.GROUP_COHERENT_SET, _number(coherence.group_set_sn))
    if coherence.group_sn:
        parameters.add(ParameterId.GROUP_SEQ_NUM, _number(coherence.group_sn))
    if coherence.writer_set:
        parameters.add(ParameterId.WRITER_GROUP_INFO, coherence.writer_set)


def _number(number: int) -> bytes:
    """SequenceNumber: high, then low."""
    return (number >> 32).to_bytes(4, "little", signed=True) + (number & 0xFFFFFFFF).to_bytes(4, "little")
