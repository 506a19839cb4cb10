"""Content filters in secured domains: what passes arrives, and nothing that is protected shows in clear."""

from __future__ import annotations

from pathlib import Path

import pytest

from ddsi.behavior.content_filter import Evaluate, filter_signatures
from ddsi.simulation import Domain, NodeReader
from ddsi.structure.cache_change import CacheChange
from ddsi.structure.discovered import ContentFilterProperty
from ddsi.structure.qos import Qos
from ddsi.structure.qos_policies import KeepAll, Reliable, TransientLocal

from .keystores import GOVERNANCES, make_identities
from .watch import Watch

RELIABLE = Qos(reliability=Reliable(), history=KeepAll(), durability=TransientLocal())
EXPRESSION = "number is a multiple of %0"


def compile_filter(expression: str, parameters: tuple[str, ...]) -> Evaluate:
    step = int(parameters[0])

    def passes(change: CacheChange) -> bool:
        return change.sequence_number % step == 0

    return passes


def multiples_of(step: int) -> ContentFilterProperty:
    return ContentFilterProperty(
        content_filtered_topic_name="f", related_topic_name="Square", filter_class_name="DDSSQL",
        filter_expression=EXPRESSION, expression_parameters=(str(step),),
    )  # fmt: skip


@pytest.mark.parametrize("governance", GOVERNANCES)
def test_filters_work_and_show_nothing_that_is_protected(governance: str, tmp_path: Path) -> None:
    """A writer whose payloads are protected sends everything: what does not leave would tell what is inside."""
    identities = make_identities(tmp_path, governance)
    watch = Watch()
    domain = Domain(1, trace=watch)
    here, there = (domain.node(properties=properties) for properties in identities[:2])
    writer = here.writer("Square", RELIABLE, compile_filter=compile_filter)
    readers: dict[int, NodeReader] = {}
    for step in (2, 3):
        announced = multiples_of(step)
        passes = compile_filter(EXPRESSION, announced.expression_parameters)
        readers[step] = there.reader("Square", RELIABLE, content_filter=(announced, passes))
    assert domain.run_until(lambda: len(writer.local.behavior.readers) == 2, 10)
    for _ in range(12):
        writer.write(100)
        domain.run(0.01)
    assert domain.run_until(lambda: len(readers[2].taken) == 6 and len(readers[3].taken) == 4, 10)
    for step, reader in readers.items():
        assert [change.sequence_number for _, change in reader.taken] == [*range(step, 13, step)]

    draft = GOVERNANCES[governance]
    filters_at_writer = [proxy.content_filter is not None for proxy in writer.local.behavior.readers.values()]
    assert filters_at_writer == [draft.data == "NONE"] * 2
    hides_discovery = "ENCRYPT" in draft.discovery or "ENCRYPT" in draft.rtps
    assert watch.holds(EXPRESSION.encode()) is not hides_discovery
    signatures = [filter_signatures(multiples_of(step))[0] for step in readers]
    hides_submessages = "ENCRYPT" in draft.metadata or "ENCRYPT" in draft.rtps
    tells = draft.data == "NONE" and not hides_submessages
    assert [watch.holds(signature) for signature in signatures] == [tells, tells]
