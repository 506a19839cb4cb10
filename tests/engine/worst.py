"""Datagrams as large as UDP takes, each full of one thing: honest samples, and whatever might cost more than they do.

They are meant for :func:`listener`, an engine whose writer and reader are matched with ``Stranger()``.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from typing import Annotated

import ddsi
from ddsi import idl
from ddsi.engine import KeyCodec, LocalReader, LocalWriter, Participant
from ddsi.messages.acknack import AckNack, NackFrag
from ddsi.messages.data import Data
from ddsi.messages.data_frag import DataFrag
from ddsi.messages.gap import Gap
from ddsi.messages.heartbeat import Heartbeat, HeartbeatFrag
from ddsi.messages.interpreter import InfoDestination, InfoReply, InfoSource, InfoTimestamp, Pad
from ddsi.structure import builtin_entity_ids as ids
from ddsi.structure.cache_change import ChangeKind
from ddsi.structure.guid import EntityId, GuidPrefix
from ddsi.structure.qos import Qos, reader_qos, writer_qos
from ddsi.structure.qos_policies import DataRepresentationId, KeepAll, Reliable, TransientLocal
from ddsi.structure.sequence_number import NumberSet
from ddsi.xtypes import type_support
from tests.engine.wire import VENDOR, Stranger, engine

__all__ = ["HONEST", "MOST_OCTETS", "WORST", "listener"]

MOST_OCTETS = 65_507
RELIABLE = Qos(reliability=Reliable(), history=KeepAll())
HISTORY = RELIABLE | Qos(durability=TransientLocal())
CHANGES = 300
"""That the writer holds, so that much can be asked for."""

WRITER = Stranger().endpoint(1, is_writer=True).entity_id
READER = Stranger().endpoint(1, is_writer=False).entity_id
OUR_WRITER = EntityId(b"\0\0\1\3")
ALL = EntityId.UNKNOWN
EVERY_BIT = (1 << 256) - 1
EVERY_OTHER_BIT = int("10" * 128, 2)


@idl.struct
class Shape:
    color: Annotated[str, idl.key, idl.bound(128)]
    x: idl.int32
    y: idl.int32
    shapesize: idl.int32


def listener() -> tuple[Participant, LocalWriter, LocalReader]:
    """With a writer that has a history, and a keyed reader that has heard a first HEARTBEAT."""
    participant, stranger = engine(), Stranger()
    support = type_support(Shape)
    keys = KeyCodec(
        from_payload=support.key_from_payload,
        from_key_payload=support.key_from_key_payload,
        from_key_hash=support.key_from_key_hash,
        to_key_hash=lambda key: support.key_hash(key, DataRepresentationId.XCDR1),
        to_secret_key_hash=lambda key: support.key_hash(key, DataRepresentationId.XCDR1, is_secret=True),
    )
    writer = participant.create_writer("Out", "T", writer_qos(HISTORY), 0.0, is_keyed=False)
    reader = participant.create_reader("In", "T", reader_qos(RELIABLE), 0.0, is_keyed=False, keys=keys)
    stranger.introduce(participant)
    for octets in (stranger.sedp_writer(1, "In", RELIABLE), stranger.sedp_reader(1, "Out", HISTORY)):
        participant.receive_datagram(octets, stranger.address, 0.0)
    for _ in range(CHANGES):
        participant.write(writer, ChangeKind.ALIVE, b"\0\1\0\0" + bytes(60), b"", 0.0)
    beat = Heartbeat(ALL, WRITER, 1, 0, 1, final=True).encode()
    participant.receive_datagram(stranger.message(beat), stranger.address, 0.0)
    participant.drain_effects()
    assert writer.behavior.readers
    assert reader.behavior.writers
    return participant, writer, reader


def full_of(submessages: Callable[[int], bytes], *, before: bytes = b"") -> Callable[[], bytes]:
    """``submessages(0)``, ``submessages(1)`` and so on, behind ``before``, as many as there is room for."""

    def datagram() -> bytes:
        out = bytearray(Stranger().message(before))
        number = 0
        while len(out) + len(one := submessages(number)) <= MOST_OCTETS:
            out += one
            number += 1
        return bytes(out)

    return datagram


# --- what they are made of ------------------------------------------------------------------------------------------

_SHAPE = ddsi.serialize(Shape("BLUE", 1, 2, 3))
_EMPTY = b"\0\1\0\0"  # an encapsulation header, and nothing in it


def _data(number: int, payload: bytes, writer: EntityId = WRITER) -> bytes:
    return Data(ALL, writer, number, None, payload).encode()


def _data_with_inline_qos(number: int, parameters: bytes) -> bytes:
    head = struct.pack("<HH4s4siI", 0, 16, ALL, WRITER, 0, number)
    return struct.pack("<BBH", 0x15, 3, len(head) + len(parameters)) + head + parameters


def _fragment(sample: int, number: int, *, size: int = 1, of: int = 60_000) -> bytes:
    return DataFrag(ALL, WRITER, sample, number, 1, size, of, None, bytes(size)).encode()


def _heartbeat(first: int, last: int, count: int, writer: EntityId = WRITER) -> bytes:
    return Heartbeat(ALL, writer, first, last, count).encode()


def _gap(start: int, end: int, bits: int = 0, bitmap: int = 0) -> bytes:
    return Gap(ALL, WRITER, start, NumberSet(end, bits, bitmap)).encode()


def _acknack(base: int, count: int, bitmap: int = 0, *, final: bool = False, reader: EntityId = READER) -> bytes:
    return AckNack(reader, OUR_WRITER, NumberSet(base, 256 if bitmap else 0, bitmap), count, final).encode()


def _nack_frag(count: int, bitmap: int) -> bytes:
    return NackFrag(READER, OUR_WRITER, 5, NumberSet(1, 256, bitmap), count).encode()


def _heartbeat_frag(count: int, sample: int = 1) -> bytes:
    return HeartbeatFrag(ALL, WRITER, sample, 0xFFFFFFFF, count).encode()


def _parameter(pid: int, value: bytes = b"") -> bytes:
    return struct.pack("<HH", pid, len(value)) + value


_SENTINEL = b"\1\0\0\0"
_STRANGE_PARAMETERS = b"".join(_parameter(0x8000 + pid) for pid in range(1000))


def _locators(pid: int, count: int) -> bytes:
    return b"".join(
        _parameter(pid, struct.pack("<iI", 1, 7410) + bytes(12) + bytes((10, 9, number >> 8, number & 255)))
        for number in range(count)
    )


def _prefix(number: int) -> GuidPrefix:
    return GuidPrefix(VENDOR + b"zz" + number.to_bytes(8, "big"))


def _source(prefix: GuidPrefix) -> bytes:
    return InfoSource((2, 4), VENDOR, prefix).encode()


def _spdp(prefix: GuidPrefix, parameters: bytes) -> bytes:
    payload = b"\0\3\0\0" + _parameter(0x50, prefix + EntityId.PARTICIPANT) + parameters + _SENTINEL
    return Data(ids.SPDP_READER, ids.SPDP_WRITER, 1, None, payload).encode()


def _newcomer(number: int, parameters: bytes = b"") -> bytes:
    return _source(_prefix(number)) + _spdp(_prefix(number), _locators(0x32, 1) + parameters)


def _spdp_again(parameters: bytes) -> bytes:
    return _spdp(Stranger().prefix, parameters)


_GOODBYE = Stranger().goodbye()[20:]


def _sedp(number: int, *, key: int, topic: bytes = b"In", type_name: bytes = b"T", parameters: bytes = b"") -> bytes:
    """As short as it can be; the first number that is expected is 2."""
    guid = Stranger().endpoint(key, is_writer=True)
    names = b"".join(
        _parameter(pid, struct.pack("<I", len(name) + 1) + name + bytes(4 - len(name) % 4))
        for pid, name in ((5, topic), (7, type_name))
    )
    payload = b"\0\3\0\0" + _parameter(0x5A, guid) + names + parameters + _SENTINEL
    return Data(ids.SEDP_PUBLICATIONS_READER, ids.SEDP_PUBLICATIONS_WRITER, number + 2, None, payload).encode()


def _announced_as_usual(number: int) -> bytes:
    stranger = Stranger()
    stranger._sn[ids.SEDP_PUBLICATIONS_WRITER] = number + 1
    return stranger.sedp_writer(number + 10, "In", RELIABLE)[20:]


def _restart(number: int) -> bytes:
    """An endpoint is announced; then its participant's numbers contradict that, twice."""
    beats = (_heartbeat(1, 0, 2 * number + count, ids.SEDP_PUBLICATIONS_WRITER) for count in (2, 3))
    return _sedp(-1, key=1) + b"".join(beats)


# --- honest ones ----------------------------------------------------------------------------------------------------

HONEST = full_of(lambda n: _data(n + 1, _SHAPE))
"""Small samples, as a burst of writes makes them: 1,259 of 52 octets."""

# --- and all others -------------------------------------------------------------------------------------------------

WORST: dict[str, Callable[[], bytes]] = {
    # Submessages of next to nothing.
    "pads": full_of(lambda n: Pad(0).encode()),
    "timestamps invalidated": full_of(lambda n: InfoTimestamp(None).encode()),
    "timestamps": full_of(lambda n: InfoTimestamp(n << 32).encode()),
    "timestamps, big-endian": full_of(lambda n: InfoTimestamp(n << 32).encode(little_endian=False)),
    "destinations": full_of(lambda n: InfoDestination(GuidPrefix.UNKNOWN).encode()),
    "sources": full_of(lambda n: _source(_prefix(n))),
    "replies to nowhere": full_of(lambda n: InfoReply(()).encode()),
    "a vendor's own": full_of(lambda n: b"\x80\1\4\0" + bytes(4)),
    "envelopes of nothing": full_of(lambda n: b"\x31\1\x14\0" + bytes(20) + b"\x32\1\x14\0" + bytes(20)),
    "the beginning of an envelope": full_of(lambda n: b"\x31\1\4\0" + bytes(4)),
    # Samples.
    "samples of an unknown writer": full_of(lambda n: _data(n + 1, _EMPTY, EntityId(b"\0\0\x77\3"))),
    "samples without a key": full_of(lambda n: _data(n + 1, _EMPTY)),
    "samples without a key, out of order": full_of(lambda n: _data(2 * n + 2, _EMPTY)),
    "every other sample": full_of(lambda n: _data(2 * n + 2, _SHAPE)),
    "samples backwards": full_of(lambda n: _data(2000 - n, _SHAPE)),
    "samples of nothing": full_of(lambda n: _data_with_inline_qos(n + 1, _SENTINEL)),
    "inline QoS of a thousand parameters": full_of(
        lambda n: _data_with_inline_qos(n + 1, _STRANGE_PARAMETERS + _SENTINEL)
    ),
    # GAP.
    "gaps of one": full_of(lambda n: _gap(n + 1, n + 2)),
    "gaps with holes between them": full_of(lambda n: _gap(2 * n + 5, 2 * n + 6)),
    "gaps of 256 members": full_of(lambda n: _gap(5, 5, 256, EVERY_BIT)),
    "gaps of 128 holes": full_of(lambda n: _gap(5 + 300 * n, 5 + 300 * n, 256, EVERY_OTHER_BIT)),
    "gaps of 128 holes, backwards": full_of(
        lambda n: _gap(10**6 - 300 * n, 10**6 - 300 * n, 256, EVERY_OTHER_BIT)
    ),
    "gaps of nearly everything": full_of(lambda n: _gap(1, (1 << 61) + n)),
    # HEARTBEAT.
    "heartbeats": full_of(lambda n: _heartbeat(1, n + 1, n + 2)),
    "heartbeats of nearly everything": full_of(lambda n: _heartbeat(n + 1, (1 << 61) + n, n + 2)),
    "heartbeats of a builtin writer": full_of(lambda n: _heartbeat(1, n + 1, n + 2, ids.SEDP_PUBLICATIONS_WRITER)),
    "heartbeats of an unknown writer": full_of(lambda n: _heartbeat(1, n + 1, n + 2, EntityId(b"\0\0\x77\3"))),
    "restarts": full_of(_restart, before=_sedp(0, key=1)),
    # ACKNACK.
    "requests for 256 changes": full_of(lambda n: _acknack(1, n + 2, EVERY_BIT)),
    "requests, each for others": full_of(lambda n: _acknack(min(n, CHANGES - 10) + 2, n + 2, EVERY_BIT)),
    "acknowledgments": full_of(lambda n: _acknack(2, n + 2)),
    "preemptive acknowledgments": full_of(lambda n: _acknack(1, 0)),
    "requests of an unknown reader": full_of(
        lambda n: _acknack(1, n + 2, EVERY_BIT, reader=EntityId(b"\0\0\x77\4"))
    ),
    # Fragments.
    "fragments of an octet": full_of(lambda n: _fragment(1, n + 1)),
    "fragments of as many samples": full_of(lambda n: _fragment(n + 1, 1)),
    "fragments of as many samples, backwards": full_of(lambda n: _fragment(3000 - n, 1)),
    "65,000 fragments at once": full_of(
        lambda n: DataFrag(ALL, WRITER, n + 1, 1, 65_000, 1, 65_001, None, bytes(65_000)).encode()
    ),
    "fragments announced": full_of(_heartbeat_frag, before=_fragment(1, 1)),
    "fragments announced, every other here": full_of(
        _heartbeat_frag, before=b"".join(_fragment(1, 2 * n + 1) for n in range(300))
    ),
    "requests for 256 fragments": full_of(lambda n: _nack_frag(n + 2, EVERY_BIT)),
    "requests for every other fragment": full_of(lambda n: _nack_frag(n + 2, EVERY_OTHER_BIT)),
    # SPDP.
    "newcomers": full_of(_newcomer),
    "newcomers with all builtin endpoints": full_of(lambda n: _newcomer(n, _parameter(0x58, b"\xff\xff\xff\xff"))),
    "the same announcement": full_of(lambda n: _spdp_again(_locators(0x32, 1))),
    "an announcement that changes": full_of(lambda n: _spdp_again(_locators(0x32, n % 200 + 1)[-28:])),
    "comings and goings": full_of(lambda n: _GOODBYE if n % 2 else _spdp_again(_locators(0x32, 1))),
    "announcements of 900 locators": full_of(lambda n: _spdp_again(_locators(0x32, 900))),
    "announcements of a thousand parameters": full_of(lambda n: _spdp_again(_STRANGE_PARAMETERS)),
    "announcements of 512 properties": full_of(
        lambda n: _spdp_again(_parameter(0x59, 2 * (struct.pack("<I", 256) + bytes(2048))))
    ),
    # SEDP.
    "endpoints as they are": full_of(_announced_as_usual),
    "endpoints as short as can be": full_of(lambda n: _sedp(n, key=n + 10)),
    "endpoints of another topic": full_of(lambda n: _sedp(n, key=n + 10, topic=b"Out")),
    "an endpoint that changes its topic": full_of(lambda n: _sedp(n, key=1, topic=(b"In", b"Out")[n % 2])),
    "an endpoint that changes its type": full_of(lambda n: _sedp(n, key=1, type_name=(b"T", b"U")[n % 2])),
    "endpoints in 256 partitions": full_of(
        lambda n: _sedp(n, key=n + 10, parameters=_parameter(0x29, struct.pack("<I", 256) + bytes(1024)))
    ),
    "endpoints of 900 locators": full_of(lambda n: _sedp(n, key=n + 10, parameters=_locators(0x2F, 900))),
    "endpoints of a thousand parameters": full_of(lambda n: _sedp(n, key=n + 10, parameters=_STRANGE_PARAMETERS)),
}  # fmt: skip
