"""Numbers that jump absurdly wedge nobody: what is promised in docs/architecture.md, "Absurd numbers".

Alice writes and Bob reads, without security.  An intruder who reads everything sends what he likes: in his own name,
which changes nothing between the two; and in the name of one of them, from which they recover.
"""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ddsi.messages.acknack import AckNack, NackFrag
from ddsi.messages.data import Data
from ddsi.messages.data_frag import DataFrag
from ddsi.messages.gap import Gap
from ddsi.messages.heartbeat import Heartbeat, HeartbeatFrag
from ddsi.messages.interpreter import InfoDestination
from ddsi.simulation import Domain
from ddsi.simulation.network import Port
from ddsi.structure import builtin_entity_ids as ids
from ddsi.structure.guid import EntityId, GuidPrefix
from ddsi.structure.locator import Locator
from ddsi.structure.qos import Qos
from ddsi.structure.qos_policies import BestEffort, KeepAll, Reliable, TransientLocal
from ddsi.structure.sequence_number import NumberSet

RELIABLE = Qos(reliability=Reliable(), history=KeepAll())
HISTORY = RELIABLE | Qos(durability=TransientLocal())
FAR = (1 << 62) - 1  # the highest number that is not malformed
INTRUDER = GuidPrefix(b"\x01\xdd" + b"\x66" * 10)


class Scene:
    def __init__(self, qos: Qos = RELIABLE) -> None:
        self.domain = Domain(3)
        alice, bob = self.domain.node(), self.domain.node()
        self.alice, self.bob = alice, bob
        self.writer, self.reader = alice.writer("Square", qos), bob.reader("Square", qos)
        self.port = Port(Locator.udp_v4("10.9.9.9", 7999), INTRUDER, lambda *_: None)
        self.domain.network.open(self.port)
        assert self.domain.run_until(self.domain.all_matched, 5)
        self.talk(3)
        assert self.received == [1, 2, 3]

    @property
    def received(self) -> list[int]:
        """The numbers of what the application was given, in order."""
        return [change.sequence_number for info, change in self.reader.taken if info.valid_data]

    def talk(self, count: int) -> None:
        """Samples, a tenth of a second apart, and a while for repairs."""
        for _ in range(count):
            assert self.writer.write(20) is not None
            self.domain.run(0.1)
        self.domain.run(0.5)

    def say(self, prefix: GuidPrefix, *submessages: bytes) -> None:
        """To both, in the name of ``prefix``."""
        for node in (self.alice, self.bob):
            octets = b"RTPS\2\4\1\xdd" + prefix + InfoDestination(node.guid.prefix).encode() + b"".join(submessages)
            for port in (node.port, node._user_port):
                self.domain.network.send(self.port, [port.locator], octets)
        self.domain.run(0.01)

    def positions(self) -> list[object]:
        """Everything that numbers decide, of every pair of the two."""
        found: list[object] = []
        for node in (self.alice, self.bob):
            for reader in node.engine.local_readers.values():
                for proxy in reader.behavior.writers.values():
                    found.append((reader.guid, proxy.guid, proxy.next_sn, proxy.last_seq, len(proxy.reorder)))
            for writer in node.engine.local_writers.values():
                for reader_proxy in writer.behavior.readers.values():
                    found.append((writer.guid, reader_proxy.guid, reader_proxy.acked_sn, reader_proxy.lst_seq))
        return found


# --- lies of any kind -----------------------------------------------------------------------------------------------

READER_ID, WRITER_ID = EntityId(b"\0\0\1\4"), EntityId(b"\0\0\1\3")  # the entities of both, as they are made first
WRITER_IDS = st.sampled_from([WRITER_ID, ids.SEDP_PUBLICATIONS_WRITER, ids.PARTICIPANT_MESSAGE_WRITER])
READER_IDS = st.sampled_from([READER_ID, ids.SEDP_PUBLICATIONS_READER, EntityId.UNKNOWN])
numbers = st.integers(1, 9) | st.sampled_from([255, 256, 257, 1 << 31, 1 << 32, (1 << 32) + 1, 1 << 61, FAR])
counts = st.integers(0, 9) | st.sampled_from([(1 << 31) - 1, 1 << 31, (1 << 32) - 1])
sets = st.builds(NumberSet, numbers, st.just(256), st.integers(0, (1 << 256) - 1))
fragment_sets = st.builds(
    NumberSet, st.sampled_from([1, 2, (1 << 32) - 1]), st.just(256), st.integers(1, (1 << 256) - 1)
)


@st.composite
def heartbeats(draw: st.DrawFn) -> bytes:
    first, last = sorted((draw(numbers), draw(numbers)))
    return Heartbeat(
        draw(READER_IDS), draw(WRITER_IDS), first, last, draw(counts), draw(st.booleans()), draw(st.booleans())
    ).encode()


lies = st.one_of(
    heartbeats(),
    st.builds(
        lambda r, w, start, irrelevant: Gap(r, w, start, irrelevant).encode(), READER_IDS, WRITER_IDS, numbers, sets
    ),
    st.builds(
        lambda state, count, final: AckNack(READER_ID, WRITER_ID, state, count, final).encode(),
        sets, counts, st.booleans(),
    ),
    st.builds(
        lambda number, state, count: NackFrag(READER_ID, WRITER_ID, number, state, count).encode(),
        numbers, fragment_sets, counts,
    ),
    st.builds(
        lambda w, number, last, count: HeartbeatFrag(EntityId.UNKNOWN, w, number, last, count).encode(),
        WRITER_IDS, numbers, st.sampled_from([1, (1 << 32) - 1]), counts,
    ),
    st.builds(
        lambda number, size: DataFrag(EntityId.UNKNOWN, WRITER_ID, number, 1, 1, 100, size, None, bytes(100)).encode(),
        numbers, st.sampled_from([101, 65_000, 1 << 28]),
    ),
)  # fmt: skip


@settings(max_examples=30)
@given(st.lists(lies, min_size=1, max_size=12))
def test_what_a_stranger_says_in_his_own_name_changes_nothing(said: list[bytes]) -> None:
    """Whatever entity ids he borrows: it is the whole Guid that counts."""
    scene = Scene()
    before = scene.positions()
    scene.say(INTRUDER, *said)
    assert scene.positions() == before
    scene.talk(2)
    assert scene.received == [1, 2, 3, 4, 5]
    assert scene.reader.local.lost.total_count == 0


@settings(max_examples=30)
@given(st.lists(lies, min_size=1, max_size=8), st.lists(lies, max_size=4))
def test_from_lies_in_their_own_names_both_recover(of_alice: list[bytes], of_bob: list[bytes]) -> None:
    """Once the lies end and the two talk on.  Nothing comes twice, and nothing that Alice did not write."""
    scene = Scene()
    scene.say(scene.alice.guid.prefix, *of_alice)
    scene.say(scene.bob.guid.prefix, *of_bob)
    scene.talk(40)
    before = len(scene.received)
    scene.talk(3)
    assert scene.received[before:] == [44, 45, 46]
    assert scene.received == sorted(set(scene.received))


# --- each alone, and what exactly is promised -----------------------------------------------------------------------


def _heartbeat(first: int, last: int, count: int = 1000) -> bytes:
    return Heartbeat(EntityId.UNKNOWN, WRITER_ID, first, last, count).encode()


def test_a_heartbeat_of_everything_costs_a_question_and_no_sample() -> None:
    scene = Scene()
    asked: list[bytes] = []
    scene.domain.network.watch = lambda owner, octets: asked.append(octets) if owner == scene.bob.guid.prefix else None
    scene.say(scene.alice.guid.prefix, _heartbeat(1, FAR))
    scene.domain.run(10)
    assert sum(map(len, asked)) < 10_000, "it asks for 256 numbers, less and less often"
    proxy = next(iter(scene.reader.local.behavior.writers.values()))
    assert proxy.last_seq == 3, "then what there is, and believes the true HEARTBEAT"
    scene.talk(3)
    assert scene.received == [1, 2, 3, 4, 5, 6]


def test_samples_far_ahead_hold_nothing_up_and_give_way_to_nearer_ones() -> None:
    scene = Scene()
    most = scene.bob.engine.config.max_reorder_samples
    for number in range(most):
        forged = Data(EntityId.UNKNOWN, WRITER_ID, FAR - number, None, b"\0\1\0\0" + bytes(4)).encode()
        scene.say(scene.alice.guid.prefix, forged)
    proxy = next(iter(scene.reader.local.behavior.writers.values()))
    assert len(proxy.reorder) == most
    scene.talk(3)
    assert scene.received == [1, 2, 3, 4, 5, 6]
    nearer = Data(EntityId.UNKNOWN, WRITER_ID, 9, None, b"\0\1\0\0" + bytes(4)).encode()
    scene.say(scene.alice.guid.prefix, nearer)
    assert 9 in proxy.reorder
    assert len(proxy.reorder) == most


@pytest.mark.parametrize("qos", [RELIABLE, HISTORY], ids=["volatile", "transient-local"])
def test_after_a_gap_over_everything_the_numbers_are_begun_anew(qos: Qos) -> None:
    """A GAP is to be believed.  But two true HEARTBEATs contradict it, and then everything of Alice is learnt again.

    What she writes in between is lost to a volatile reader, as to any that is matched anew; history comes once more.
    """
    scene = Scene(qos)
    scene.say(scene.alice.guid.prefix, Gap(EntityId.UNKNOWN, WRITER_ID, 1, NumberSet(FAR)).encode())
    scene.talk(20)
    missing = set(range(1, 24)) - set(scene.received)
    assert 23 not in missing
    assert len(missing) < 15 if qos is RELIABLE else not missing
    since = scene.received[3:]
    assert since == sorted(set(since))


def test_an_acknowledgment_of_everything_is_not_believed() -> None:
    """Nor does it end the HEARTBEATs that tell Bob what he lacks."""
    scene = Scene()
    forged = AckNack(READER_ID, WRITER_ID, NumberSet(FAR), 1000, False).encode()
    scene.say(scene.bob.guid.prefix, forged)
    proxy = next(iter(scene.writer.local.behavior.readers.values()))
    assert proxy.acked_sn == 3
    scene.talk(3)
    assert scene.received == [1, 2, 3, 4, 5, 6]


def test_counts_that_are_far_ahead_silence_a_heartbeat_for_half_a_second_at_most() -> None:
    scene = Scene()
    scene.say(scene.alice.guid.prefix, _heartbeat(1, 3, count=(1 << 31) - 1))
    proxy = next(iter(scene.reader.local.behavior.writers.values()))
    assert not proxy.accepts_heartbeat(5, scene.domain.now + 0.4)
    assert proxy.accepts_heartbeat(5, scene.domain.now + 0.6)


def test_a_best_effort_reader_follows_again_after_sixteen_samples() -> None:
    scene = Scene(Qos(reliability=BestEffort(), history=KeepAll()))
    forged = Data(EntityId.UNKNOWN, WRITER_ID, FAR - 1, None, b"\0\1\0\0" + bytes(4)).encode()
    scene.say(scene.alice.guid.prefix, forged)
    scene.talk(20)
    assert scene.received[-1] == 23
    assert set(range(4, 24)) - set(scene.received) <= set(range(4, 20))
