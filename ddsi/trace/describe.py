"""Submessages in words, one line each: ``DATA Square #3``, ``ACKNACK Square base 4 missing {4,6} count 2``.

RTPS 2.5 §8.3.8 (the submessages).  ``#`` stands before sequence numbers only.  Used by the sequence diagram and by the
command line; nothing here decides anything.  Octets may come from the network: broken ones are described as such,
and the length of what is said is bounded.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from datetime import UTC, datetime

from ..messages.acknack import AckNack, NackFrag
from ..messages.data import Data
from ..messages.data_frag import DataFrag
from ..messages.gap import Gap
from ..messages.heartbeat import Heartbeat, HeartbeatFrag
from ..messages.interpreter import InfoDestination, InfoReply, InfoReplyIp4, InfoSource, InfoTimestamp, Pad
from ..messages.opaque import HeaderExtension, Opaque, Unknown
from ..messages.raw_submessage import submessage_name
from ..messages.submessages import Submessage
from ..serialization.cursor import Octets
from ..structure.cache_change import StatusInfo
from ..structure.guid import EntityId, Guid, GuidPrefix
from ..structure.time import TICKS_PER_SECOND
from ..structure.vendor import vendor_name
from .announcement import announcement_in, liveliness_kind, status_info
from .names import BUILTIN_NAMES, Names
from .wording import count_text, number_ranges, printable, range_text

__all__ = ["Describer", "SampleText"]

SampleText = Callable[[Guid, Octets], str]
"""Says what a serialized payload of this writer holds, shortly (its key, say); empty where it cannot tell."""

_STATUS_TEXTS = {
    StatusInfo.DISPOSED: "dispose",
    StatusInfo.UNREGISTERED: "unregister",
    StatusInfo.DISPOSED | StatusInfo.UNREGISTERED: "dispose and unregister",
    StatusInfo.FILTERED: "filtered out",
}


@dataclass(frozen=True, slots=True)
class Describer:
    """Describes submessages with these names, and what is in user data if ``sample_text`` can tell."""

    names: Names = field(default_factory=Names)
    sample_text: SampleText | None = None

    def submessage(
        self,
        submessage: Submessage,
        *,
        source: GuidPrefix = GuidPrefix.UNKNOWN,
        destination: GuidPrefix = GuidPrefix.UNKNOWN,
    ) -> str:
        """The submessage in words.  ``source`` and ``destination`` are the participants, as the header, INFO_SRC and
        INFO_DST have them: entity ids mean nothing without."""
        match submessage:
            case Data():
                return self._data(submessage, source)
            case DataFrag():
                return self._data_frag(submessage, source)
            case Heartbeat():
                return self._heartbeat(submessage, source)
            case HeartbeatFrag():
                head = self._from_writer("HEARTBEAT_FRAG", source, submessage.writer_id)
                fragments = range_text(1, submessage.last_fragment_num)
                target = self._to_reader(submessage.reader_id)
                return f"{head} #{submessage.writer_sn} fragments {fragments} count {submessage.count}{target}"
            case Gap():
                return self._gap(submessage, source)
            case AckNack():
                return self._acknack(submessage, source, destination)
            case NackFrag():
                head = self._from_reader("NACK_FRAG", source, destination, submessage.reader_id, submessage.writer_id)
                missing = number_ranges(submessage.fragment_number_state)
                return f"{head} #{submessage.writer_sn} missing fragments {missing} count {submessage.count}"
            case _:
                return self._without_entities(submessage)

    def _data(self, data: Data, source: GuidPrefix) -> str:
        head = self._from_writer("DATA", source, data.writer_id)
        return (
            f"{head}{self._sample(data, source)} #{data.writer_sn}{self._fate(data)}{self._to_reader(data.reader_id)}"
        )

    def _sample(self, data: Data, source: GuidPrefix) -> str:
        if self.sample_text is None or data.writer_id.is_builtin or not data.serialized_payload:
            return ""
        text = printable(self.sample_text(Guid.of(source, data.writer_id), data.serialized_payload))
        return f" {text}" if text else ""

    def _fate(self, data: Data) -> str:
        """What becomes of the instance, and what a builtin topic says with it."""
        status = _STATUS_TEXTS.get(status_info(data), "")
        if not status and (data.is_key or not data.serialized_payload):
            status = "key only" if data.is_key else "no payload"
        announced = announcement_in(data)
        said = liveliness_kind(data)
        if announced is not None and announced.topic_name:
            said = f"{printable(announced.topic_name)} ({printable(announced.type_name)})"
        elif announced is not None and announced.guid.entity_id != EntityId.PARTICIPANT:
            said = self.names.guid(announced.guid)
        return (f" {status}" if status else "") + (f": {said}" if said else "")

    def _data_frag(self, data_frag: DataFrag, source: GuidPrefix) -> str:
        head = self._from_writer("DATA_FRAG", source, data_frag.writer_id)
        fragment_count = -(-data_frag.sample_size // data_frag.fragment_size)
        fragments = range_text(data_frag.fragment_starting_num, data_frag.last_fragment_num)
        size = count_text(data_frag.sample_size, "octet")
        target = self._to_reader(data_frag.reader_id)
        return f"{head} #{data_frag.writer_sn} {fragments}/{fragment_count} of {size}{target}"

    def _heartbeat(self, heartbeat: Heartbeat, source: GuidPrefix) -> str:
        head = self._from_writer("HEARTBEAT", source, heartbeat.writer_id)
        first_sn, last_sn = heartbeat.first_sn, heartbeat.last_sn
        has = f"empty, next {first_sn}" if last_sn < first_sn else f"{first_sn}..{last_sn}"
        flags = (" final" if heartbeat.final else "") + (" liveliness" if heartbeat.liveliness else "")
        return f"{head} {has} count {heartbeat.count}{flags}{self._to_reader(heartbeat.reader_id)}"

    def _gap(self, gap: Gap, source: GuidPrefix) -> str:
        head = self._from_writer("GAP", source, gap.writer_id)
        end = gap.gap_list.base
        run = range_text(gap.gap_start, end - 1) if end > gap.gap_start else ""
        members = number_ranges(gap.gap_list) if gap.gap_list else ""
        irrelevant = " and ".join(part for part in (run, members) if part) or "nothing"
        return f"{head} {irrelevant}{self._to_reader(gap.reader_id)}"

    def _acknack(self, acknack: AckNack, source: GuidPrefix, destination: GuidPrefix) -> str:
        head = self._from_reader("ACKNACK", source, destination, acknack.reader_id, acknack.writer_id)
        wanted = acknack.reader_sn_state
        missing = f" missing {number_ranges(wanted)}" if wanted else ""
        final = " final" if acknack.final else ""
        return f"{head} base {wanted.base}{missing} count {acknack.count}{final}"

    def _from_writer(self, kind: str, source: GuidPrefix, writer_id: EntityId) -> str:
        return f"{kind} {self.names.entity(source, writer_id)}"

    def _from_reader(
        self, kind: str, source: GuidPrefix, destination: GuidPrefix, reader_id: EntityId, writer_id: EntityId
    ) -> str:
        """An answer is called after the writer that it is for; after its reader where only that is known by name."""
        if self.names.knows(source, reader_id) and not self.names.knows(destination, writer_id):
            return f"{kind} {self.names.entity(source, reader_id)}"
        return f"{kind} {self.names.entity(destination, writer_id)}"

    def _to_reader(self, reader_id: EntityId) -> str:
        """Said only where one of an application's readers is meant: builtin ones are one of a kind anyway."""
        if reader_id == EntityId.UNKNOWN or reader_id in BUILTIN_NAMES:
            return ""
        return f" -> {self.names.entity(GuidPrefix.UNKNOWN, reader_id)}"

    def _without_entities(self, submessage: Submessage) -> str:
        """INFO_*, PAD, and what is not read here."""
        match submessage:
            case InfoTimestamp(timestamp):
                return f"INFO_TS {_timestamp_text(timestamp)}"
            case InfoDestination(guid_prefix):
                everybody = guid_prefix == GuidPrefix.UNKNOWN
                return f"INFO_DST {'everybody' if everybody else self.names.letter(guid_prefix)}"
            case InfoSource(version, vendor_id, guid_prefix):
                vendor, (major, minor) = vendor_name(vendor_id), version
                return f"INFO_SRC {self.names.letter(guid_prefix)} ({vendor}, RTPS {major}.{minor})"
            case InfoReply(unicast, multicast):
                return f"INFO_REPLY {', '.join(str(locator) for locator in (*unicast, *(multicast or ()))[:4])}"
            case InfoReplyIp4(unicast_locator, _):
                return f"INFO_REPLY_IP4 {unicast_locator}"
            case Pad(length):
                return f"PAD {count_text(length, 'octet')}"
            case HeaderExtension(_, body):
                return f"HEADER_EXTENSION {count_text(len(body), 'octet')}"
            case Opaque(kind, _, body):
                return f"{submessage_name(kind)} {count_text(len(body), 'octet')}"
            case Unknown(kind, _, body):
                whose = "vendor's own" if submessage.is_vendor_specific else "unknown submessage"
                return f"{whose} {kind:02x} ({count_text(len(body), 'octet')})"
            case _:
                raise AssertionError(f"no words for {submessage!r}")


def _timestamp_text(ticks: int | None) -> str:
    """A source timestamp as UTC with microseconds."""
    if ticks is None:
        return "none"
    seconds, fraction = divmod(ticks, TICKS_PER_SECOND)
    microseconds = fraction * 1_000_000 // TICKS_PER_SECOND
    return datetime.fromtimestamp(seconds, UTC).replace(microsecond=microseconds).strftime("%Y-%m-%dT%H:%M:%S.%fZ")
