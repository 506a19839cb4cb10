"""StatelessReader: whatever comes is handed over, and no number that anybody sends can change that."""

from __future__ import annotations

import math

from ddsi.behavior.defrag import DefragBudget, Defragmenter, Keep
from ddsi.behavior.stateful_reader import RemoteWriter
from ddsi.behavior.stateless_reader import StatelessReader
from ddsi.structure.qos import Qos, reader_qos
from ddsi.structure.qos_policies import BestEffort
from ddsi.structure.sequence_number import NumberSet

from .builders import LOCATOR, Sink, change, reader_guid, writer_data

HUGE = (1 << 62) - 1


def stateless() -> tuple[StatelessReader, Sink]:
    sink = Sink(1 << 30)
    qos = reader_qos(Qos(reliability=BestEffort()))
    reader = StatelessReader(reader_guid(2), qos, sink, reorder_max_samples=100, reorder_max_octets=1 << 20)
    return reader, sink


def test_numbers_may_come_in_any_order_and_twice() -> None:
    reader, sink = stateless()
    proxy = reader.matched_writer_add(writer_data(), (LOCATOR,), 0.0)
    for number in (5, 3, 3, HUGE, 1, 2):
        assert reader.receive_data(proxy, change(number), 0.0) == 0
    assert sink.numbers == [5, 3, 3, HUGE, 1, 2]


def test_heartbeats_and_gaps_change_nothing_and_nothing_is_asked_for() -> None:
    reader, sink = stateless()
    proxy = reader.matched_writer_add(writer_data(), (LOCATOR,), 0.0)
    assert reader.receive_heartbeat(proxy, HUGE - 1, HUGE, 1, 0.0, final=False) == 0
    reader.receive_gap(proxy, 1, NumberSet(HUGE), 0.0)
    assert reader.fragment_received(proxy, 1, 0.0)
    reader.receive_data(proxy, change(1), 0.0)
    assert sink.numbers == [1]
    assert proxy.schedule.due == math.inf
    assert reader.handle_timeout(proxy, None, 1e9) == []


def test_a_forged_number_does_not_void_fragments_that_have_come() -> None:
    reader, _ = stateless()
    defragmenter = Defragmenter(DefragBudget(1 << 20), max_samples=100, keep=Keep.NEWEST)
    remote = RemoteWriter(writer_data(), defragmenter)
    remote.readers.append((reader, reader.matched_writer_add(remote.data, (LOCATOR,), 0.0)))
    remote.readers_changed()
    defragmenter.add(3, bytes(4), sample_size=20, fragment_size=10, first=1, count=1, fragments=bytes(10), now=0.0)
    remote.forget_settled(HUGE)
    assert list(defragmenter.partial_for(reader.guid.entity_id)) == [3]
    assert defragmenter.keep is Keep.NEWEST
