"""Content filters in whole domains, over bad networks: each reader ends with what passes, and nothing is left to say.

The writer alone: ``test_content_filtering_writer``.
"""

from __future__ import annotations

import pytest

from ddsi.behavior.content_filter import Evaluate, filter_signatures
from ddsi.messages.content_filter_info import encode_content_filter_info
from ddsi.messages.data import Data
from ddsi.messages.raw_submessage import SubmessageKind, iterate_submessages
from ddsi.serialization import ParameterId
from ddsi.simulation import Domain, LinkConditions, NodeReader, invariants
from ddsi.spi import Octets
from ddsi.structure.cache_change import CacheChange
from ddsi.structure.discovered import ContentFilterProperty
from ddsi.structure.errors import BadParameter
from ddsi.structure.locator import Locator
from ddsi.structure.qos import Qos
from ddsi.structure.qos_policies import KeepAll, Reliable, TransientLocal

WEATHER = LinkConditions(loss=0.2, duplication=0.1, reordering=0.1, jitter=0.001)
CALM = LinkConditions()
RELIABLE = Qos(reliability=Reliable(), history=KeepAll())
HISTORY = RELIABLE | Qos(durability=TransientLocal())


def every(step: int) -> ContentFilterProperty:
    """A filter that lets each ``step``-th number pass; the network cannot tell it from one about data."""
    return ContentFilterProperty(
        content_filtered_topic_name="f", related_topic_name="Square", filter_class_name="DDSSQL",
        filter_expression="number %", expression_parameters=(str(step),),
    )  # fmt: skip


def compile_filter(expression: str, parameters: tuple[str, ...]) -> Evaluate:
    if expression != "number %":
        raise BadParameter("unknown")
    step = int(parameters[0])

    def passes(change: CacheChange) -> bool:
        return change.sequence_number % step == 0

    return passes


def filtering_reader(domain: Domain, step: int, qos: Qos = RELIABLE) -> NodeReader:
    announced = every(step)
    passes = compile_filter(announced.filter_expression, announced.expression_parameters)
    return domain.node().reader("Square", qos, content_filter=(announced, passes))


def numbers(reader: NodeReader) -> list[int]:
    return [change.sequence_number for _, change in reader.taken]


def settle(domain: Domain) -> None:
    domain.run(0.5)
    assert domain.run_until(lambda: invariants.is_at_rest(domain), 60)
    assert invariants.complete(domain) == []
    assert invariants.in_order(domain) == []
    assert invariants.memory_released(domain) == []
    assert invariants.quiet(domain, 20) == [], "no endless heartbeats"


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("qos", [RELIABLE, HISTORY], ids=["volatile", "history"])
def test_each_reader_gets_what_passes_in_any_weather(seed: int, qos: Qos) -> None:
    domain = Domain(seed, conditions=WEATHER)
    writer = domain.node().writer("Square", qos, compile_filter=compile_filter)
    readers = {step: filtering_reader(domain, step, qos) for step in (2, 3, 50)}
    plain = domain.node().reader("Square", qos)
    assert domain.run_until(domain.all_matched, 10)
    for step in range(120):
        assert writer.write(20 if step % 7 else 5000) is not None
        domain.run(0.0005)
    settle(domain)
    for step, reader in readers.items():
        assert numbers(reader) == [number for number in range(1, 121) if number % step == 0]
        assert reader.local.lost.total_count == 0, "what does not pass is no loss"
    assert numbers(plain) == [*range(1, 121)]


@pytest.mark.parametrize("seed", range(3))
def test_a_late_joiner_gets_the_history_that_passes(seed: int) -> None:
    domain = Domain(seed, conditions=WEATHER)
    writer = domain.node().writer("Square", HISTORY, compile_filter=compile_filter)
    for _ in range(700):
        writer.write(20)
    reader = filtering_reader(domain, 100, HISTORY)
    assert domain.run_until(domain.all_matched, 10)
    for _ in range(100):
        writer.write(20)
    settle(domain)
    assert numbers(reader) == [*range(100, 801, 100)]


def test_parameters_that_change_are_announced_and_acted_upon() -> None:
    domain = Domain(1, conditions=WEATHER)
    writer = domain.node().writer("Square", RELIABLE, compile_filter=compile_filter)
    reader = filtering_reader(domain, 2)
    assert domain.run_until(domain.all_matched, 10)
    for _ in range(10):
        writer.write(20)
    settle(domain)
    announced = every(5)
    passes = compile_filter(announced.filter_expression, announced.expression_parameters)
    reader.node.engine.set_content_filter(reader.local, announced, passes, domain.now)
    reader.node.pump()
    domain.run(5)
    for _ in range(10):
        writer.write(20)
    assert domain.run_until(lambda: invariants.is_at_rest(domain), 60)
    assert numbers(reader) == [2, 4, 6, 8, 10, 15, 20], "5 was kept away by the former, and stays away"


def test_what_does_not_pass_is_not_on_the_wire_and_what_passes_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    """Number 12 is for all, so it is sent to all at once, and each filters for himself."""
    domain = Domain(1, conditions=CALM)
    writer = domain.node().writer("Square", RELIABLE, compile_filter=compile_filter)
    reader = filtering_reader(domain, 4)
    other = filtering_reader(domain, 3)
    assert domain.run_until(domain.all_matched, 10)
    heard: list[tuple[int, bytes, bytes | None]] = []
    engine = reader.node.engine
    receive = engine.receive_datagram

    def listen(octets: Octets, source: Locator, now: float) -> None:
        for raw in iterate_submessages(memoryview(octets), start=20):
            if raw.kind == SubmessageKind.DATA and bytes(raw.body[8:12]) == writer.guid[12:]:
                data = Data.decode(raw.flags, raw.body)
                info = data.inline_qos.get(ParameterId.CONTENT_FILTER_INFO) if data.inline_qos is not None else None
                heard.append((data.writer_sn, bytes(data.reader_id), bytes(info) if info is not None else None))
        receive(octets, source, now)

    monkeypatch.setattr(engine, "receive_datagram", listen)
    for _ in range(13):
        writer.write(20)
        domain.run(0.01)
    settle(domain)
    signature, _ = filter_signatures(every(4))
    told = encode_content_filter_info({signature: True})
    own_id = bytes(reader.guid[12:])
    assert heard == [(4, own_id, told), (8, own_id, told), (12, bytes(4), None)]
    assert numbers(reader) == [4, 8, 12]
    assert numbers(other) == [3, 6, 9, 12]
