"""A writer that was lost and is back: what it repeats is not delivered twice, and what it holds is not lost."""

from __future__ import annotations

import pytest

from ddsi.engine import Participant
from ddsi.messages.acknack import AckNack
from ddsi.messages.data import Data
from ddsi.messages.heartbeat import Heartbeat
from ddsi.messages.receiver import MessageReceiver
from ddsi.simulation import Domain, LinkConditions, Node
from ddsi.structure.guid import EntityId
from ddsi.structure.qos import Qos, reader_qos
from ddsi.structure.qos_policies import KeepAll, KeepLast, Reliable, TransientLocal, Volatile
from ddsi.structure.sample_info import InstanceState

from .wire import Stranger, engine, sent

LATE = Qos(reliability=Reliable(), history=KeepAll(), durability=TransientLocal())
LEASE = 20.0


def pair(qos: Qos = LATE, *, takes: bool = True) -> tuple[Domain, Node, Node]:
    domain = Domain()
    a, b = domain.node(), domain.node()
    a.writer("Square", qos)
    b.reader("Square", qos, takes=takes)
    assert domain.run_until(domain.all_matched, 5)
    return domain, a, b


def numbers(a: Node, b: Node) -> list[int]:
    """Everything that the reader was ever given, in the order in which it was given."""
    return [number for session in b.readers[0].sessions[a.writers[0].guid] for number in session.numbers]


def lose(domain: Domain, a: Node, b: Node, *, one_way: bool) -> None:
    """The reader's side forgets the writer's; one way, the writer's side goes on hearing the reader's."""
    if one_way:
        domain.network.set_link(a.host, b.host, LinkConditions(loss=1.0))
    else:
        domain.network.partition([a.host], [b.host])
    domain.run(LEASE + 5)
    assert a.guid.prefix not in b.engine.participants
    assert (b.guid.prefix in a.engine.participants) is one_way


def heal(domain: Domain, a: Node, b: Node) -> None:
    domain.network.heal()
    domain.network.set_link(a.host, b.host, LinkConditions())
    assert domain.run_until(domain.all_matched, 10)
    domain.run(2)


@pytest.mark.parametrize("one_way", [True, False])
def test_history_that_was_delivered_is_not_delivered_again(one_way: bool) -> None:
    domain, a, b = pair()
    writer = a.writers[0]
    for _ in range(5):
        writer.write()
    domain.run(1)
    lose(domain, a, b, one_way=one_way)
    for _ in range(3):
        writer.write()
    heal(domain, a, b)
    writer.write()
    domain.run(1)
    assert numbers(a, b) == [1, 2, 3, 4, 5, 6, 7, 8, 9]


@pytest.mark.parametrize("one_way", [True, False])
def test_what_waited_for_a_lost_number_comes_in_order_when_that_does(one_way: bool) -> None:
    """3 is lost and 4 is here when the cable is pulled: 4 is not delivered before 3, and neither twice."""
    domain, a, b = pair()
    writer = a.writers[0]
    for _ in range(2):
        writer.write()
    domain.run(1)
    domain.network.set_link(a.host, b.host, LinkConditions(loss=1.0))
    writer.write()
    domain.run(0.001)
    domain.network.set_link(a.host, b.host, LinkConditions())
    writer.write()
    domain.run(0.0009)  # 4 arrives, and there is no time to ask for 3
    lose(domain, a, b, one_way=one_way)
    heal(domain, a, b)
    assert numbers(a, b) == [1, 2, 3, 4]


def test_one_that_is_lost_again_and_again_repeats_nothing() -> None:
    domain, a, b = pair()
    for _ in range(4):
        a.writers[0].write()
        domain.run(1)
        lose(domain, a, b, one_way=True)
        heal(domain, a, b)
    assert numbers(a, b) == [1, 2, 3, 4]


def test_of_volatile_data_only_what_comes_after_the_return_is_promised() -> None:
    domain, a, b = pair(LATE | Qos(durability=Volatile()))
    writer = a.writers[0]
    writer.write()
    domain.run(1)
    lose(domain, a, b, one_way=False)
    writer.write()
    heal(domain, a, b)
    writer.write()
    domain.run(1)
    assert numbers(a, b) == [1, 3]


def test_an_instance_lives_again_with_its_writer() -> None:
    """Its end was told; that its writer is back is told by its state, without the same sample once more."""
    domain, a, b = pair(LATE | Qos(history=KeepLast(1)), takes=False)
    reader = b.readers[0]
    a.writers[0].write()
    domain.run(1)
    ((_, change),) = reader.take()
    lose(domain, a, b, one_way=True)
    instance = reader.history.instances[change.key]
    states = [instance.state]
    heal(domain, a, b)
    states.append(instance.state)
    assert states == [InstanceState.NOT_ALIVE_NO_WRITERS, InstanceState.ALIVE]
    assert [info.valid_data for info, _ in reader.take()] == [False]
    assert instance.no_writers_generation_count == 1


# --- writers that never lost the reader ------------------------------------------------------------------


def application_data(stranger: Stranger, number: int) -> bytes:
    writer_id = stranger.endpoint(1, is_writer=True).entity_id
    return stranger.message(Data(EntityId.UNKNOWN, writer_id, number, None, b"\0\1\0\0octets\0\0").encode())


def heartbeat(stranger: Stranger, last: int, count: int) -> bytes:
    writer_id = stranger.endpoint(1, is_writer=True).entity_id
    return stranger.message(Heartbeat(EntityId.UNKNOWN, writer_id, 1, last, count, final=False).encode())


def requested(engine: Participant) -> list[int]:
    """The lowest number that each ACKNACK to an application's writer wants."""
    return [
        submessage.reader_sn_state.base
        for _, octets in sent(engine)
        for submessage, _ in MessageReceiver(octets)
        if isinstance(submessage, AckNack) and not submessage.writer_id.is_builtin
    ]


def test_one_that_does_not_repeat_what_was_acknowledged_holds_nothing_up() -> None:
    """It is asked a few times, as it may have begun anew; then the reader goes on where it was."""
    ours, stranger = engine(), Stranger()
    reader = ours.create_reader("Square", "T", reader_qos(LATE), 0.0, is_keyed=False)
    assert reader.history is not None
    for now in (0.0, 30.0):
        ours.handle_timeout(now)
        stranger.introduce(ours, now)
        ours.receive_datagram(Stranger().sedp_writer(qos=LATE), stranger.address, now)
        if now == 0.0:
            ours.receive_datagram(heartbeat(stranger, 0, 1), stranger.address, now)
            for number in (1, 2, 3):
                ours.receive_datagram(application_data(stranger, number), stranger.address, now)
            assert len(reader.history.take()) == 3
    for round_, now in enumerate((30.1, 30.3, 30.5, 30.7, 30.9, 31.1)):
        ours.receive_datagram(heartbeat(stranger, 5, 2 + round_), stranger.address, now)
        for number in (4, 5):
            ours.receive_datagram(application_data(stranger, number), stranger.address, now)
        ours.handle_timeout(now + 0.1)
    assert [change.sequence_number for info, change in reader.history.take() if info.valid_data] == [4, 5]
    asked = requested(ours)
    assert (asked[0], asked[-1]) == (1, 6)


def test_heartbeats_that_samples_have_overtaken_are_no_restart() -> None:
    """A network that reorders: what they say was true when they were sent."""
    ours, stranger = engine(), Stranger()
    reader = ours.create_reader("Square", "T", reader_qos(LATE), 0.0, is_keyed=False)
    assert reader.history is not None
    stranger.introduce(ours)
    ours.receive_datagram(stranger.sedp_writer(qos=LATE), stranger.address, 0.0)
    ours.receive_datagram(heartbeat(stranger, 0, 1), stranger.address, 0.0)
    ours.receive_datagram(application_data(stranger, 1), stranger.address, 0.0)
    for number in range(2, 12):
        now = 0.01 * number
        ours.receive_datagram(application_data(stranger, number), stranger.address, now)
        ours.receive_datagram(heartbeat(stranger, number - 2, number), stranger.address, now)
    assert [change.sequence_number for _, change in reader.history.take()] == list(range(1, 12))
    assert reader.matched.current_count == 1
    assert reader.matched.total_count == 1


def test_one_that_counts_anew_is_a_restart() -> None:
    """Its HEARTBEATs know nothing of what it sent, and nothing comes that would."""
    ours, stranger = engine(), Stranger()
    reader = ours.create_reader("Square", "T", reader_qos(LATE), 0.0, is_keyed=False)
    stranger.introduce(ours)
    ours.receive_datagram(stranger.sedp_writer(qos=LATE), stranger.address, 0.0)
    ours.receive_datagram(heartbeat(stranger, 0, 1), stranger.address, 0.0)
    for number in (1, 2, 3):
        ours.receive_datagram(application_data(stranger, number), stranger.address, 0.0)
    for count in (2, 3, 4):
        assert reader.matched.current_count == 1
        ours.receive_datagram(heartbeat(stranger, 0, count), stranger.address, 1.0 + count)
    assert reader.matched.current_count == 0
