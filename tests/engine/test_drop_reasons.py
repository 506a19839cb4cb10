"""Whatever is not acted upon is counted under the reason that it has, once."""

from __future__ import annotations

import pytest

from ddsi.messages.acknack import AckNack, NackFrag
from ddsi.messages.data import Data
from ddsi.messages.data_frag import DataFrag
from ddsi.messages.gap import Gap
from ddsi.messages.heartbeat import Heartbeat
from ddsi.messages.interpreter import InfoDestination, InfoReply, Pad
from ddsi.simulation.endpoints import SIMULATED_KEYS
from ddsi.structure.builtin_entity_ids import (
    PARTICIPANT_STATELESS_MESSAGE_READER,
    PARTICIPANT_STATELESS_MESSAGE_WRITER,
)
from ddsi.structure.guid import EntityId, GuidPrefix
from ddsi.structure.qos import Qos, reader_qos
from ddsi.structure.qos_policies import BestEffort, KeepAll, ResourceLimits
from ddsi.structure.sequence_number import NumberSet
from ddsi.trace.reasons import DropReason as Reason
from ddsi.trace.sink import MemorySink
from tests.engine.wire import Stranger, engine
from tests.engine.worst import OUR_WRITER, READER, WRITER, listener
from tests.fuzz.session import Session

ALL = EntityId.UNKNOWN
NOBODY = EntityId(b"\0\0\x77\4")


def data(number: int, reader: EntityId = ALL) -> bytes:
    return Data(reader, WRITER, number, None, b"\0\1\0\0" + b"\1\0\0\0" + bytes(16)).encode()


def fragment(number: int) -> bytes:
    return DataFrag(ALL, WRITER, number, 1, 1, 100, 1000, None, bytes(100)).encode()


def heartbeat(last: int, count: int, reader: EntityId = ALL) -> bytes:
    return Heartbeat(reader, WRITER, 1, last, count, final=True).encode()


def acknack(base: int, count: int, *, final: bool = True) -> bytes:
    return AckNack(READER, OUR_WRITER, NumberSet(base), count, final).encode()


def nack_frag(count: int) -> bytes:
    return NackFrag(READER, OUR_WRITER, 1, NumberSet(1, 1, 1), count).encode()


CASES: dict[str, tuple[list[bytes], Reason | None]] = {
    "what is in order": ([data(1), heartbeat(1, 2), acknack(2, 1)], None),
    "a sample again": ([data(1), data(1)], Reason.DUPLICATE),
    "a sample again, that waits for another": ([data(2), data(2)], Reason.DUPLICATE),
    "a fragment of what is here": ([data(1), fragment(1)], Reason.DUPLICATE),
    "a heartbeat again": ([heartbeat(1, 2), heartbeat(1, 2)], Reason.STALE_COUNT),
    "an older heartbeat": ([heartbeat(1, 5), heartbeat(1, 4)], Reason.STALE_COUNT),
    "an ACKNACK again": ([acknack(2, 1), acknack(2, 1)], Reason.STALE_COUNT),
    "a NACK_FRAG again": ([nack_frag(1), nack_frag(1)], Reason.STALE_COUNT),
    "an acknowledgment of what was never written": ([acknack(10_000, 1)], Reason.INVALID_SEQUENCE),
    "a preemptive ACKNACK too soon": ([acknack(1, 0, final=False)] * 2, Reason.RATE_LIMITED),
    "a gap for a reader that is not here": ([Gap(NOBODY, WRITER, 1, NumberSet(2)).encode()], Reason.UNKNOWN_ENDPOINT),
    "a heartbeat for a reader that is not here": ([heartbeat(1, 2, NOBODY)], Reason.UNKNOWN_ENDPOINT),
    "a sample for a reader that is not here": ([data(1, NOBODY)], Reason.UNKNOWN_ENDPOINT),
    "a message for another": ([InfoDestination(GuidPrefix(b"another one ")).encode(), data(1)], Reason.NOT_FOR_US),
    "a kind that is not in the table": ([b"\x55\1\4\0" + bytes(4)], Reason.UNSUPPORTED),
    "a kind of a vendor's": ([b"\x80\1\4\0" + bytes(4)], None),
    "padding, and where to answer": ([Pad(4).encode(), InfoReply(()).encode()], None),
    "a number that nobody reaches": ([heartbeat(1 << 62, 2)], Reason.MALFORMED_MESSAGE),
}


@pytest.mark.parametrize("name", CASES)
def test_it_is_counted_under_its_reason(name: str) -> None:
    submessages, reason = CASES[name]
    participant, _, _ = listener()
    participant.receive_datagram(Stranger().message(*submessages), Stranger().address, 1.0)
    assert participant.drops == ({} if reason is None else {reason: 1})


def test_a_buffer_that_is_full_is_counted() -> None:
    participant, _, _ = listener()
    most = participant.config.max_reorder_samples
    for number in range(2, most + 12):
        participant.receive_datagram(Stranger().message(data(number)), Stranger().address, 1.0)
    assert participant.drops == {Reason.TABLE_FULL_REORDER: 10}


@pytest.mark.parametrize(
    ("limits", "reason"),
    [
        (ResourceLimits(max_instances=1), Reason.TABLE_FULL_INSTANCES),
        (ResourceLimits(max_samples=1), Reason.READER_FULL),
    ],
)
def test_a_best_effort_reader_that_is_full_is_counted(limits: ResourceLimits, reason: Reason) -> None:
    participant, stranger = engine(), Stranger()
    qos = Qos(reliability=BestEffort(), history=KeepAll(), resource_limits=limits)
    participant.create_reader("In", "T", reader_qos(qos), 0.0, is_keyed=False, keys=SIMULATED_KEYS)
    stranger.introduce(participant)
    participant.receive_datagram(stranger.sedp_writer(1, "In"), stranger.address, 0.0)
    samples = [Data(ALL, WRITER, number, None, b"\0\1\0\0" + bytes([number, 0, 0, 0])).encode() for number in (1, 2)]
    participant.receive_datagram(stranger.message(*samples), stranger.address, 1.0)
    assert participant.drops == {reason: 1}


def test_a_trace_says_whose_it_was() -> None:
    participant, _, _ = listener()
    sink = MemorySink()
    participant.recorder._sink = sink
    participant.recorder.is_on = True
    participant.receive_datagram(Stranger().message(data(1), data(1)), Stranger().address, 1.0)
    (event,) = (event for event in sink.events if event.NAME == "dropped")
    assert (event.reason, event.remote, event.detail) == (  # type: ignore[attr-defined]
        Reason.DUPLICATE,
        Stranger().endpoint(1, is_writer=True),
        "#1",
    )


@pytest.mark.parametrize(
    ("payload", "reason"),
    [
        (b"\0\1\0\0" + bytes(200), Reason.REJECTED_BY_SECURITY),  # of another source than its sender
        (b"\0\1\0\0" + bytes(8), Reason.REJECTED_BY_SECURITY),  # malformed
        (b"\0\1\0\0" + b"\x77" * 200, Reason.NOT_FOR_US),
    ],
)
def test_a_message_of_security_that_is_not_read_is_counted(payload: bytes, reason: Reason) -> None:
    session = Session.make()
    engine = session.bob.engine
    engine.drops.clear()
    ids = (PARTICIPANT_STATELESS_MESSAGE_READER, PARTICIPANT_STATELESS_MESSAGE_WRITER)
    octets = session.of_alice[0][:20] + Data(*ids, 99, None, payload).encode()
    engine.receive_datagram(octets, session.alice.port.locator, engine.now)
    assert engine.drops == {reason: 1}
