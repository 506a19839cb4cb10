"""What a filtering writer must never do, whatever its readers say: anything that an ACKNACK or a NACK_FRAG can hold is
thrown at it, in any order, between writes, matches and the passing of time.
"""

from __future__ import annotations

from dataclasses import dataclass

from hypothesis import given, settings
from hypothesis import strategies as st

from ddsi.behavior.filtering_writer import FilteringWriter
from ddsi.behavior.reader_proxy import ReaderProxy
from ddsi.behavior.transmissions import SendData, SendFragments, SendGap, SendHeartbeat, WriterTransmission
from ddsi.structure.guid import GUID_UNKNOWN, Guid
from ddsi.structure.qos import Qos
from ddsi.structure.qos_policies import BestEffort, KeepAll, Lifespan, TransientLocal, Volatile
from tests.behavior.builders import LOCATOR, RELIABLE_QOS, filtering_writer, numbers, reader_data, reader_guid, write

# Two of one participant among them; the last is best effort.
READERS = (reader_guid(2), reader_guid(2, key=9), reader_guid(3), reader_guid(4))
DESTINATIONS = (GUID_UNKNOWN, *READERS, *(guid.participant for guid in READERS), reader_guid(8).participant)


@dataclass(frozen=True)
class Write:
    destination: Guid
    size: int


@dataclass(frozen=True)
class Match:
    reader: int


@dataclass(frozen=True)
class Unmatch:
    reader: int


@dataclass(frozen=True)
class Nack:
    """Relative to what was written, so that most of it makes sense."""

    reader: int
    behind: int
    missing: tuple[int, ...]
    final: bool


@dataclass(frozen=True)
class NackFrag:
    reader: int
    behind: int
    missing: tuple[int, ...]


@dataclass(frozen=True)
class Pass:
    seconds: float


Step = Write | Match | Unmatch | Nack | NackFrag | Pass

_readers = st.integers(0, len(READERS) - 1)
_behind = st.integers(-3, 10)
STEPS = st.one_of(
    st.builds(Write, st.sampled_from(DESTINATIONS), st.sampled_from((0, 250))),
    st.builds(Match, _readers),
    st.builds(Unmatch, _readers),
    st.builds(Nack, _readers, _behind, st.lists(st.integers(0, 255), max_size=6).map(tuple), st.booleans()),
    st.builds(NackFrag, _readers, _behind, st.lists(st.integers(0, 5), max_size=3).map(tuple)),
    st.builds(Pass, st.sampled_from((0.001, 0.01, 0.1, 2.0))),
)
LIVES = st.lists(STEPS, min_size=20, max_size=60)


class Run:
    """Lives through the steps; every transmission is looked at as it comes."""

    def __init__(self, durability: Volatile | TransientLocal) -> None:
        self.qos = RELIABLE_QOS | Qos(durability=durability)
        self.writer: FilteringWriter = filtering_writer(self.qos | Qos(lifespan=Lifespan(3.0)), fragment_octets=100)
        self.now = 0.0
        self.count = 0

    def do(self, step: Step) -> None:
        writer, now = self.writer, self.now
        match step:
            case Write(destination, size):
                write(writer, bytes(size), now, to=destination)
                self.judge(writer.unsent_changes(now))
            case Match(reader) if READERS[reader] not in writer.readers:
                best_effort = Qos(reliability=BestEffort(), history=KeepAll())
                data = reader_data(best_effort if reader == len(READERS) - 1 else self.qos, of=READERS[reader])
                self.judge(writer.matched_reader_add(data, (LOCATOR,), now))
            case Unmatch(reader):
                writer.matched_reader_remove(READERS[reader], now)
                self.judge(writer.unsent_changes(now))
            case Nack(reader, behind, missing, final) if (proxy := writer.readers.get(READERS[reader])) is not None:
                base = max(writer.cache.last_sn - behind, 0)
                requested = numbers(base, *sorted({base + offset for offset in missing} - {0}))
                self.count += 1
                self.judge(writer.receive_acknack(proxy, requested, self.count, now, final=final))
            case NackFrag(reader, behind, missing) if (proxy := writer.readers.get(READERS[reader])) is not None:
                self.count += 1
                fragments = numbers(1, *sorted({1 + offset for offset in missing}))
                number = max(writer.cache.last_sn - behind, 1)
                self.judge(writer.receive_nack_frag(proxy, number, fragments, self.count, now))
            case Pass(seconds):
                self.now += seconds
                self.judge(writer.handle_timeout(self.now))
            case _:
                return
        self.judge_history()

    def judge(self, transmissions: list[WriterTransmission]) -> None:
        for item in transmissions:
            match item:
                case SendData(change, proxy) | SendFragments(change, _, _, proxy):
                    assert proxy is not None, "to everybody"
                    assert proxy.is_relevant(change)
                    assert change.sequence_number > proxy.history_sn
                case SendGap(proxy, start, irrelevant):
                    explained = {*range(start, irrelevant.base), *irrelevant}
                    assert max(explained) < self.writer.next_unsent_sn, "a number that is still to come"
                    assert not explained & self.wanted_by(proxy), "a number that is for this reader"
                case SendHeartbeat(first, last, _, _, readers):
                    assert readers is not None
                    (proxy,) = readers
                    assert proxy.is_reliable
                    assert last == proxy.lst_seq
                    assert first == min([*self.wanted_by(proxy), last + 1])
                case _:
                    raise AssertionError(item)

    def wanted_by(self, proxy: ReaderProxy) -> set[int]:
        return {
            change.sequence_number
            for change in self.writer.cache.changes()
            if proxy.is_relevant(change) and proxy.history_sn < change.sequence_number
        }

    def judge_history(self) -> None:
        """A volatile writer keeps exactly what somebody lacks; nobody is told of numbers that were not sent."""
        writer = self.writer
        assert writer.next_unsent_sn == writer.cache.last_sn + 1
        assert all(proxy.lst_seq < writer.next_unsent_sn for proxy in writer.readers.values())
        if self.qos.durability != Volatile():
            return
        for change in writer.cache.changes():
            assert any(
                proxy.is_reliable and proxy.is_relevant(change) and proxy.acked_sn < change.sequence_number
                for proxy in writer.readers.values()
            )


@settings(deadline=None, max_examples=80)
@given(st.sampled_from((Volatile(), TransientLocal())), LIVES)
def test_nobody_gets_or_hears_what_is_another_s(durability: Volatile | TransientLocal, steps: list[Step]) -> None:
    run = Run(durability)
    for reader in range(len(READERS)):
        run.do(Match(reader))
    for step in steps:
        run.do(step)


@settings(deadline=None, max_examples=40)
@given(LIVES)
def test_what_is_left_goes_when_the_readers_go(steps: list[Step]) -> None:
    run = Run(Volatile())
    for step in steps:
        run.do(step)
    for reader in range(len(READERS)):
        run.do(Unmatch(reader))
    run.do(Pass(5.0))
    assert len(run.writer.cache) == 0
    assert not any(run.writer.has_overflow(destination) for destination in DESTINATIONS)
    assert run.writer.min_acked_sn() == run.writer.cache.last_sn
