"""The short ways of DATA, in and out, agree with the general ones: same samples, state, drops and octets."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from ddsi.engine import LocalReader, LocalWriter, Participant
from ddsi.engine.inbound import Inbound, Incoming
from ddsi.messages.data import Data
from ddsi.messages.gap import Gap
from ddsi.messages.heartbeat import Heartbeat
from ddsi.messages.interpreter import InfoDestination, InfoTimestamp
from ddsi.messages.raw_submessage import iterate_submessages
from ddsi.serialization.parameter_list import ParameterList
from ddsi.structure.cache_change import CacheChange, ChangeKind
from ddsi.structure.guid import EntityId, Guid, GuidPrefix
from ddsi.structure.qos import Qos, reader_qos, writer_qos
from ddsi.structure.qos_policies import BestEffort, KeepAll, Reliable
from ddsi.structure.sequence_number import NumberSet
from tests.engine.wire import Stranger, engine, sent

RELIABLE = Qos(reliability=Reliable(), history=KeepAll())
BEST_EFFORT = Qos(reliability=BestEffort(), history=KeepAll())


class GeneralInbound(Inbound):
    """Every submessage by ``iterate_submessages`` and its class: what the specification says, and nothing shorter."""

    def _submessages(self, incoming: Incoming, view: memoryview, start: int) -> None:
        position = start
        while len(view) - position >= 4:
            position = self._general_submessages(incoming, view, position)


@dataclass
class Listener:
    """An engine with a reader, and the stranger's writer that it is matched with."""

    participant: Participant
    reader: LocalReader
    stranger: Stranger
    writer: Guid

    @classmethod
    def make(cls, qos: Qos, *, general: bool) -> Listener:
        participant = engine()
        if general:
            participant.inbound = GeneralInbound(participant)
        reader = participant.create_reader("Square", "T", reader_qos(qos), 0.0, is_keyed=False)
        stranger = Stranger()
        stranger.introduce(participant)
        participant.receive_datagram(stranger.sedp_writer(1, "Square", RELIABLE), stranger.address, 0.0)
        writer = stranger.endpoint(1, is_writer=True)
        assert writer in reader.behavior.writers
        beat = Heartbeat(EntityId.UNKNOWN, writer.entity_id, 1, 0, 1, final=True).encode()
        participant.receive_datagram(stranger.message(beat), stranger.address, 0.0)
        participant.drain_effects()
        return cls(participant, reader, stranger, writer)

    def hear(self, *submessages: bytes, now: float = 1.0) -> None:
        self.participant.receive_datagram(self.stranger.message(*submessages), self.stranger.address, now)

    def state(self) -> dict[str, object]:
        """Everything that a datagram may have changed."""
        assert self.reader.history is not None
        proxy = self.reader.behavior.writers.get(self.writer)
        if proxy is None:  # its participant began anew, as HEARTBEATs contradicted each other
            return {"drops": dict(self.participant.drops), "sent": sent(self.participant)}
        return {
            "samples": [
                (change.sequence_number, change.kind, bytes(change.payload), change.source_timestamp)
                for _, change in self.reader.history.read()
            ],
            "next": proxy.next_sn,
            "last": proxy.last_seq,
            "held": len(proxy.reorder),
            "due": proxy.schedule.due,
            "drops": dict(self.participant.drops),
            "lost": self.reader.lost.total_count,
            "sent": sent(self.participant),
            "deadline": self.participant.next_deadline(),
        }


WRITER_ID = Stranger().endpoint(1, is_writer=True).entity_id
OTHER_ID = EntityId(b"\0\0\x09\x03")
READER_IDS = [EntityId.UNKNOWN, EntityId(b"\0\0\1\4"), EntityId(b"\0\0\7\4")]
OWN_PREFIX = GuidPrefix(b"\x01\xdd" + b"E" * 10)

payloads = st.binary(max_size=24).map(lambda octets: b"\0\1\0\0" + octets)


def _inline_qos(parameters: list[tuple[int, bytes]], *, little_endian: bool) -> ParameterList | None:
    inline = ParameterList(little_endian=little_endian)
    for parameter, value in parameters:
        inline.add(parameter, value)
    return inline if parameters else None


no_parameters: list[tuple[int, bytes]] = []
inline_qos = (
    st.just(no_parameters)
    | st.just([(0x70, bytes(range(16)))])
    | st.lists(st.tuples(st.sampled_from([0x70, 0x71, 0x8123]), st.binary(max_size=20)), max_size=2)
)
data = st.builds(
    lambda reader, writer, number, inline, payload, little: Data(
        reader, writer, number, _inline_qos(inline, little_endian=little), payload
    ).encode(little_endian=little),
    st.sampled_from(READER_IDS),
    st.sampled_from([WRITER_ID, WRITER_ID, WRITER_ID, OTHER_ID]),
    st.integers(1, 12),
    inline_qos,
    payloads,
    st.booleans(),
)
others = st.one_of(
    st.builds(lambda ticks: InfoTimestamp(ticks).encode(), st.integers(0, 1 << 63) | st.none()),
    st.builds(
        lambda prefix: InfoDestination(prefix).encode(),
        st.sampled_from([GuidPrefix.UNKNOWN, OWN_PREFIX, GuidPrefix(b"x" * 12)]),
    ),
    st.builds(
        lambda first, count, number: Heartbeat(EntityId.UNKNOWN, WRITER_ID, first, first + count - 1, number).encode(),
        st.integers(1, 8),
        st.integers(0, 8),
        st.integers(1, 9),
    ),
    st.builds(
        lambda start, count: Gap(EntityId.UNKNOWN, WRITER_ID, start, NumberSet(start + count)).encode(),
        st.integers(1, 8),
        st.integers(0, 4),
    ),
    st.just(b"\x01\x01\0\0"),  # PAD
    st.just(b"\x80\x01\x04\0abcd"),  # a vendor's own
)
mutations = st.lists(st.tuples(st.integers(0, 400), st.integers(0, 255)), max_size=3)


@given(st.lists(st.lists(st.one_of(data, data, others), min_size=1, max_size=6), max_size=5), mutations, st.booleans())
@example([[Data(EntityId.UNKNOWN, WRITER_ID, 1, None, b"\0\1\0\0abcd").encode()]], [(3, 0)], True)
@example([[Data(EntityId.UNKNOWN, WRITER_ID, 1, None, b"\0\1\0\0abcd").encode()[:-4]]], [], True)
def test_a_datagram_does_the_same_by_the_short_way_as_by_the_general_one(
    messages: list[list[bytes]], mutated: list[tuple[int, int]], reliable: bool
) -> None:
    """Also one that was mutated: both refuse the same, at the same place."""
    qos = RELIABLE if reliable else BEST_EFFORT
    short, general = Listener.make(qos, general=False), Listener.make(qos, general=True)
    for index, submessages in enumerate(messages):
        octets = bytearray(b"".join(submessages))
        for position, value in mutated:
            if index == 0 and position < len(octets):
                octets[position] = value
        for listener in (short, general):
            listener.hear(bytes(octets), now=1.0 + index)
    assert short.state() == general.state()


@pytest.mark.parametrize("length_field", [0, 28])
def test_a_length_of_zero_reaches_to_the_end_of_the_message(length_field: int) -> None:
    """RTPS 2.5 §9.4.5.1.3; the short way leaves it to the general one."""
    octets = bytearray(Data(EntityId.UNKNOWN, WRITER_ID, 1, None, b"\0\1\0\0abcd").encode())
    assert octets[2:4] == b"\x1c\0"
    octets[2] = length_field
    listener = Listener.make(RELIABLE, general=False)
    listener.hear(bytes(octets))
    assert [sample[:3] for sample in listener.state()["samples"]] == [  # type: ignore[attr-defined]
        (1, ChangeKind.ALIVE, b"\0\1\0\0abcd")
    ]


# --- out ------------------------------------------------------------------------------------------------------------


def _speaker() -> tuple[Participant, LocalWriter, Stranger]:
    participant = engine()
    writer = participant.create_writer("Square", "T", writer_qos(RELIABLE), 0.0, is_keyed=False)
    stranger = Stranger()
    stranger.introduce(participant)
    participant.receive_datagram(stranger.sedp_reader(1, "Square", RELIABLE), stranger.address, 0.0)
    assert writer.behavior.readers
    participant.drain_effects()
    return participant, writer, stranger


@given(
    st.lists(st.binary(max_size=40), min_size=1, max_size=8),
    st.lists(st.integers(0, (1 << 64) - 1), min_size=8, max_size=8),
    st.just(b"") | st.binary(min_size=16, max_size=16),
)
def test_the_short_way_of_a_fresh_sample_makes_the_same_octets(
    samples: list[bytes], stamps: list[int], key_hash: bytes
) -> None:
    short, general = _speaker(), _speaker()
    for number, (octets, ticks) in enumerate(zip(samples, stamps, strict=False), 1):
        payload = b"\0\1\0\0" + octets
        change = CacheChange(
            ChangeKind.ALIVE, short[1].guid, number, payload, source_timestamp=ticks, key_hash=key_hash
        )
        short[0].outbound.send_change(short[1], change)
        general[0].outbound._send_data(general[1], change, None)
    one, other = (_data_only(sent(participant)) for participant, _, _ in (short, general))
    assert one == other
    assert len(one) == len({number for number, *_ in one}) == len(samples)


def _data_only(datagrams: Sequence[tuple[object, bytes]]) -> list[tuple[int, bytes, object, int | None]]:
    """Number, payload, inline QoS and timestamp of each DATA, as a receiver sees them."""
    out: list[tuple[int, bytes, object, int | None]] = []
    for _, octets in datagrams:
        ticks: int | None = None
        for raw in iterate_submessages(octets):
            if raw.kind == 0x09:
                ticks = InfoTimestamp.decode(raw.flags, raw.body).timestamp
            elif raw.kind == 0x15:
                decoded = Data.decode(raw.flags, raw.body)
                out.append((decoded.writer_sn, bytes(decoded.serialized_payload), decoded.inline_qos, ticks))
    return out
