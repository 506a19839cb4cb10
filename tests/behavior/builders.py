"""Small makers of changes, proxies, writers and readers, with defaults that tests name only where they matter."""

from __future__ import annotations

from collections.abc import Sequence

from ddsi.behavior.filtering_writer import FilteringWriter
from ddsi.behavior.stateful_reader import StatefulReader
from ddsi.behavior.stateful_writer import StatefulWriter
from ddsi.behavior.transmissions import SendData, SendFragments, SendGap, SendHeartbeat, WriterTransmission
from ddsi.structure.cache_change import CacheChange, ChangeKind
from ddsi.structure.discovered import DiscoveredReaderData, DiscoveredWriterData
from ddsi.structure.guid import GUID_UNKNOWN, EntityId, EntityKind, Guid, GuidPrefix
from ddsi.structure.locator import Locator
from ddsi.structure.qos import EndpointQos, Qos, reader_qos, writer_qos
from ddsi.structure.qos_policies import KeepAll, Reliable
from ddsi.structure.sequence_number import NumberSet
from ddsi.structure.vendor import OUR_VENDOR_ID

LOCATOR = Locator.udp_v4("10.0.0.2", 7411)
RELIABLE_QOS = Qos(reliability=Reliable(), history=KeepAll())


def guid(participant: int, key: int = 1, kind: EntityKind = EntityKind.WRITER_NO_KEY) -> Guid:
    return Guid.of(GuidPrefix(bytes((participant,)) * 12), EntityId.user(key, kind))


def reader_guid(participant: int, key: int = 1) -> Guid:
    return guid(participant, key, EntityKind.READER_NO_KEY)


WRITER = guid(1)


def change(
    number: int,
    payload: bytes = b"",
    *,
    key: bytes = b"",
    kind: ChangeKind = ChangeKind.ALIVE,
    writer: Guid = WRITER,
    destination: Guid = GUID_UNKNOWN,
) -> CacheChange:
    return CacheChange(kind, writer, number, payload, key, destination=destination)


def writer_data(
    qos: Qos = RELIABLE_QOS, *, of: Guid = WRITER, vendor_id: bytes = OUR_VENDOR_ID
) -> DiscoveredWriterData:
    return DiscoveredWriterData(guid=of, topic_name="t", type_name="T", qos=writer_qos(qos), vendor_id=vendor_id)


def reader_data(qos: Qos = RELIABLE_QOS, *, of: Guid | None = None) -> DiscoveredReaderData:
    return DiscoveredReaderData(guid=of or reader_guid(2), topic_name="t", type_name="T", qos=reader_qos(qos))


def stateful_writer(qos: Qos = RELIABLE_QOS, *, fragment_octets: int = 1000, bound: int = 1 << 20) -> StatefulWriter:
    return StatefulWriter(WRITER, writer_qos(qos), fragment_octets=fragment_octets, unacknowledged_octets_max=bound)


def filtering_writer(qos: Qos = RELIABLE_QOS, *, fragment_octets: int = 1000) -> FilteringWriter:
    return FilteringWriter(WRITER, writer_qos(qos), fragment_octets=fragment_octets, unacknowledged_octets_max=1 << 20)


class Sink:
    """A ChangeSink that takes what it is given while it has room."""

    def __init__(self, room: int = 1 << 30) -> None:
        self.room = room
        self.changes: list[CacheChange] = []

    @property
    def numbers(self) -> list[int]:
        return [change.sequence_number for change in self.changes]

    def add(self, change: CacheChange, now: float) -> bool:
        if len(self.changes) >= self.room:
            return False
        self.changes.append(change)
        return True


def stateful_reader(sink: Sink, qos: Qos = RELIABLE_QOS, *, max_samples: int = 100) -> StatefulReader:
    resolved: EndpointQos = reader_qos(qos)
    return StatefulReader(reader_guid(2), resolved, sink, reorder_max_samples=max_samples, reorder_max_octets=1 << 20)


def write(writer: StatefulWriter, payload: bytes = b"", now: float = 0.0, *, to: Guid = GUID_UNKNOWN) -> CacheChange:
    return writer.new_change(ChangeKind.ALIVE, payload, b"", 0, now, destination=to)


def numbers(base: int, *members: int) -> NumberSet:
    return NumberSet.of(base, members)


def shape(transmissions: Sequence[WriterTransmission]) -> list[str]:
    """What is to be sent, as short words: ``DATA 3``, ``DATA 3 to 2``, ``GAP 1-3 to 2``, ``HB 1-4 ? to 2`` (? asks)."""
    return [_word(transmission) for transmission in transmissions]


def _word(item: WriterTransmission) -> str:
    match item:
        case SendData(sent, reader):
            return f"DATA {sent.sequence_number}" + (f" to {reader.guid[0]}" if reader else "")
        case SendFragments(sent, first, last, reader):
            return f"FRAG {sent.sequence_number}.{first}-{last}" + (f" to {reader.guid[0]}" if reader else "")
        case SendGap(reader, start, irrelevant):
            more = "".join(f"+{number}" for number in irrelevant)
            return f"GAP {start}-{irrelevant.base - 1}{more} to {reader.guid[0]}"
        case SendHeartbeat(first, last, _, final, readers, liveliness):
            to = "".join(f" to {reader.guid[0]}" for reader in readers or ())
            return f"HB {first}-{last}{'' if final else ' ?'}{' L' if liveliness else ''}{to}"
        case _:
            return f"HB_FRAG {item.change.sequence_number}.{item.last}"
