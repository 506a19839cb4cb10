"""A reader's history against a small model of the specification, by whatever hypothesis makes applications do.

The model is written from DDS 1.4 §2.2.2.5.1 (figure 2.11 and the definitions of states, generation counts and ranks):
it keeps every sample as a row of a list and computes each answer anew by definition.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TypedDict

from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, rule

from ddsi.behavior.reader_history_cache import ReaderHistoryCache
from ddsi.structure.cache_change import CacheChange, ChangeKind
from ddsi.structure.qos import Qos, reader_qos
from ddsi.structure.qos_policies import KeepAll, KeepLast, Reliable
from ddsi.structure.sample_info import InstanceState, SampleInfo, SampleState, ViewState
from tests.behavior.builders import guid

ALIVE, DISPOSED = InstanceState.ALIVE, InstanceState.NOT_ALIVE_DISPOSED
NO_WRITERS = InstanceState.NOT_ALIVE_NO_WRITERS
WRITERS = st.sampled_from([1, 2, 3])
KEYS = st.sampled_from([b"a", b"b", b"c"])
MASKS = st.tuples(
    st.sampled_from([1, 2, 3, 3]), st.sampled_from([1, 2, 3, 3]), st.sampled_from([1, 2, 4, 6, 7, 7])
)  # sample, view and instance states
MOST = st.sampled_from([None, 1, 2, 5])


@dataclass
class Row:
    """A sample in the model.  ``number``: of the change that brought it."""

    key: bytes
    number: int
    has_data: bool
    disposed_generation: int
    no_writers_generation: int
    is_read: bool = False

    @property
    def generation(self) -> int:
        return self.disposed_generation + self.no_writers_generation


@dataclass
class ModelInstance:
    state: InstanceState = ALIVE
    is_new: bool = True
    disposed_generation: int = 0
    no_writers_generation: int = 0
    writers: set[int] = field(default_factory=set)


@dataclass(frozen=True)
class Answer:
    """A sample as it is handed out: the fields of SampleInfo, and which change it was."""

    number: int
    handle: bytes
    valid_data: bool
    sample_state: SampleState
    view_state: ViewState
    instance_state: InstanceState
    disposed_generation_count: int
    no_writers_generation_count: int
    sample_rank: int
    generation_rank: int
    absolute_generation_rank: int

    @classmethod
    def of(cls, info: SampleInfo, change: CacheChange) -> Answer:
        return cls(
            change.sequence_number, info.instance_handle, info.valid_data,
            info.sample_state, info.view_state, info.instance_state,
            info.disposed_generation_count, info.no_writers_generation_count,
            info.sample_rank, info.generation_rank, info.absolute_generation_rank,
        )  # fmt: skip


class Model:
    """``depth``: of KEEP_LAST; 0 for KEEP_ALL."""

    def __init__(self, depth: int) -> None:
        self.depth = depth
        self.rows: list[Row] = []
        self.instances: dict[bytes, ModelInstance] = {}

    def of(self, key: bytes) -> list[Row]:
        return [row for row in self.rows if row.key == key]

    # --- figure 2.11 -------------------------------------------------------------------------------------

    def write(self, number: int, writer: int, key: bytes) -> None:
        instance = self.instances.setdefault(key, ModelInstance())
        if instance.state is DISPOSED:
            instance.disposed_generation += 1
        elif instance.state is NO_WRITERS:
            instance.no_writers_generation += 1
        if instance.state is not ALIVE:
            instance.state, instance.is_new = ALIVE, True
        instance.writers.add(writer)
        with_data = [row for row in self.of(key) if row.has_data]
        if self.depth and len(with_data) == self.depth:
            self.rows.remove(with_data[0])
        self._add(number, key, has_data=True)

    def dispose(self, number: int, key: bytes) -> None:
        if key in self.instances and self.instances[key].state is not DISPOSED:
            self._end(number, key, DISPOSED)

    def unregister(self, number: int, writer: int, key: bytes) -> None:
        """By the writer itself, or because it was lost."""
        instance = self.instances.get(key)
        if instance is None:
            return
        instance.writers.discard(writer)
        if not instance.writers and instance.state is ALIVE:
            self._end(number, key, NO_WRITERS)
        self._reclaim(key)

    def _end(self, number: int, key: bytes, state: InstanceState) -> None:
        """Seen as a sample without data, unless one that nobody has read stands at the end already; KEEP_LAST keeps
        one of them in all."""
        self.instances[key].state = state
        rows = self.of(key)
        if rows and not rows[-1].has_data and not rows[-1].is_read:
            return
        if self.depth:
            self.rows = [row for row in self.rows if row.key != key or row.has_data]
        self._add(number, key, has_data=False)

    def _add(self, number: int, key: bytes, *, has_data: bool) -> None:
        instance = self.instances[key]
        self.rows.append(Row(key, number, has_data, instance.disposed_generation, instance.no_writers_generation))

    def _reclaim(self, key: bytes) -> None:
        """Nobody writes it, and nothing of it is left: it is as if it had never been."""
        instance = self.instances[key]
        if instance.state is not ALIVE and not instance.writers and not self.of(key):
            del self.instances[key]

    # --- access ------------------------------------------------------------------------------------------

    def select(self, most: int | None, masks: tuple[int, int, int], key: bytes | None) -> list[Row]:
        samples, views, states = masks
        chosen = [
            row
            for row in self.rows
            if (key is None or row.key == key)
            and samples & (SampleState.READ if row.is_read else SampleState.NOT_READ)
            and views & (ViewState.NEW if self.instances[row.key].is_new else ViewState.NOT_NEW)
            and states & self.instances[row.key].state
        ]
        chosen = chosen if most is None else chosen[:most]
        keys = list(dict.fromkeys(row.key for row in chosen))
        return [row for key in keys for row in chosen if row.key == key]  # §2.2.2.5.3.8: one instance after the other

    def access(self, chosen: list[Row], *, takes: bool) -> list[Answer]:
        answers = [self._answer(row, chosen[place:]) for place, row in enumerate(chosen)]
        for row in chosen:
            self.instances[row.key].is_new = False
            row.is_read = True
        if takes:
            self.rows = [row for row in self.rows if not any(row is taken for taken in chosen)]
            for key in {row.key for row in chosen}:
                self._reclaim(key)
        return answers

    def _answer(self, row: Row, from_here: list[Row]) -> Answer:
        instance = self.instances[row.key]
        related = [other for other in from_here if other.key == row.key]
        most_recent = instance.disposed_generation + instance.no_writers_generation
        return Answer(
            row.number, row.key, row.has_data,
            SampleState.READ if row.is_read else SampleState.NOT_READ,
            ViewState.NEW if instance.is_new else ViewState.NOT_NEW,
            instance.state, row.disposed_generation, row.no_writers_generation,
            sample_rank=len(related) - 1,
            generation_rank=related[-1].generation - row.generation,
            absolute_generation_rank=most_recent - row.generation,
        )  # fmt: skip


class HistoryMachine(RuleBasedStateMachine):
    """The same calls to both."""

    def __init__(self) -> None:
        super().__init__()
        self.number = 0

    @initialize(depth=st.sampled_from([0, 1, 2, 3]))
    def begin(self, depth: int) -> None:
        history = KeepLast(depth) if depth else KeepAll()
        qos = reader_qos(Qos(history=history, reliability=Reliable()))
        self.cache = ReaderHistoryCache(qos, max_octets=1 << 20, max_instances=100)
        self.model = Model(depth)

    def _put(self, kind: ChangeKind, writer: int, key: bytes) -> int:
        self.number += 1
        payload = bytes(8)
        assert self.cache.add(CacheChange(kind, guid(writer), self.number, payload, key), float(self.number))
        return self.number

    @rule(writer=WRITERS, key=KEYS)
    def write(self, writer: int, key: bytes) -> None:
        self.model.write(self._put(ChangeKind.ALIVE, writer, key), writer, key)

    @rule(writer=WRITERS, key=KEYS)
    def dispose(self, writer: int, key: bytes) -> None:
        self.model.dispose(self._put(ChangeKind.NOT_ALIVE_DISPOSED, writer, key), key)

    @rule(writer=WRITERS, key=KEYS)
    def unregister(self, writer: int, key: bytes) -> None:
        self.model.unregister(self._put(ChangeKind.NOT_ALIVE_UNREGISTERED, writer, key), writer, key)

    @rule(writer=WRITERS, key=KEYS)
    def dispose_and_unregister(self, writer: int, key: bytes) -> None:
        number = self._put(ChangeKind.NOT_ALIVE_DISPOSED_UNREGISTERED, writer, key)
        self.model.dispose(number, key)
        self.model.unregister(number, writer, key)

    @rule(writer=WRITERS)
    def lose(self, writer: int) -> None:
        """Its liveliness is lost, or it is deleted."""
        self.cache.writer_lost(guid(writer), float(self.number))
        for key in list(self.model.instances):
            self.model.unregister(0, writer, key)

    @rule(most=MOST, masks=MASKS, key=st.none() | KEYS)
    def read(self, most: int | None, masks: tuple[int, int, int], key: bytes | None) -> None:
        expected = self.model.access(self.model.select(most, masks, key), takes=False)
        found = self.cache.read(most, **_states(masks), instance=key)
        assert [Answer.of(*one) for one in found] == expected

    @rule(most=MOST, masks=MASKS, key=st.none() | KEYS)
    def take(self, most: int | None, masks: tuple[int, int, int], key: bytes | None) -> None:
        expected = self.model.access(self.model.select(most, masks, key), takes=True)
        found = self.cache.take(most, **_states(masks), instance=key)
        assert [Answer.of(*one) for one in found] == expected

    @rule()
    def take_the_oldest(self) -> None:
        expected = self.model.access(self.model.rows[:1], takes=True)
        found = self.cache.take_next()
        assert [Answer.of(*one) for one in ([found] if found else [])] == expected

    @rule(masks=MASKS, previous=st.none() | KEYS | st.just(b"aa"))
    def next_instance(self, masks: tuple[int, int, int], previous: bytes | None) -> None:
        keys = {row.key for row in self.model.select(None, masks, None) if previous is None or row.key > previous}
        assert self.cache.next_instance(previous, **_states(masks)) == min(keys, default=None)

    @invariant()
    def nothing_is_left_over(self) -> None:
        if self.number:
            assert len(self.cache) == len(self.model.rows)
            assert self.cache.instances.keys() == self.model.instances.keys()
            assert {key: one.state for key, one in self.cache.instances.items()} == {
                key: one.state for key, one in self.model.instances.items()
            }


class _States(TypedDict):
    sample_states: int
    view_states: int
    instance_states: int


def _states(masks: tuple[int, int, int]) -> _States:
    return {"sample_states": masks[0], "view_states": masks[1], "instance_states": masks[2]}


HistoryMachine.TestCase.settings = settings(max_examples=150, stateful_step_count=40, deadline=None)
TestHistory = HistoryMachine.TestCase
