"""QoS made to fit whoever is there, judged by the rules that endpoints match by."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ddsi.cli.fitting_qos import common_partition, offered_to, requested_of
from ddsi.discovery.matching import judge
from ddsi.structure import qos_policies as p
from ddsi.structure.discovered import DiscoveredReaderData, DiscoveredWriterData
from ddsi.structure.guid import Guid
from ddsi.structure.qos import EndpointQos, Qos

XCDR1, XCDR2 = p.DataRepresentationId.XCDR1, p.DataRepresentationId.XCDR2
BOTH = p.DataRepresentation(XCDR1, XCDR2)

DURABILITIES = (p.Volatile(), p.TransientLocal(), p.Transient(), p.Persistent())
TIMES = st.sampled_from((0.5, 2.0, float("inf")))


def endpoint(qos: EndpointQos, **changes: Any) -> dict[str, Any]:
    return {"guid": Guid(bytes(15) + b"\2"), "topic_name": "T", "type_name": "T", "qos": replace(qos, **changes)}


def as_endpoint(qos: Qos, **changes: Any) -> EndpointQos:
    """What an entity with this Qos announces."""
    given = {name: value for name in qos.__slots__ if name not in ("properties", "entity_name")
             and (value := getattr(qos, name)) is not None}  # fmt: skip
    return replace(EndpointQos(**given), **changes)


partitions = st.sampled_from(
    (p.Partition(), p.Partition("a"), p.Partition("b", "c*"), p.Partition("?x"), p.Partition("*"))
)

writers = st.builds(
    EndpointQos,
    reliability=st.sampled_from((p.Reliable(), p.BestEffort())),
    durability=st.sampled_from(DURABILITIES),
    deadline=st.builds(p.Deadline, TIMES),
    liveliness=st.builds(lambda kind, lease: kind(lease), st.sampled_from((p.Automatic, p.ManualByTopic)), TIMES),
    destination_order=st.sampled_from((p.ByReceptionTimestamp(), p.BySourceTimestamp())),
    partition=partitions,
    data_representation=st.sampled_from((p.DataRepresentation(), p.DataRepresentation(XCDR2))),
)

readers = st.builds(
    EndpointQos,
    reliability=st.sampled_from((p.Reliable(), p.BestEffort())),
    durability=st.sampled_from(DURABILITIES),
    deadline=st.builds(p.Deadline, TIMES),
    latency_budget=st.sampled_from((p.LatencyBudget(0.0), p.LatencyBudget(1.0))),
    liveliness=st.builds(
        lambda kind, lease: kind(lease), st.sampled_from((p.Automatic, p.ManualByParticipant, p.ManualByTopic)), TIMES
    ),
    destination_order=st.sampled_from((p.ByReceptionTimestamp(), p.BySourceTimestamp())),
    partition=partitions,
    data_representation=st.sampled_from((BOTH, p.DataRepresentation(XCDR2, XCDR1))),
)


@settings(max_examples=200)
@given(st.lists(writers, min_size=1, max_size=4))
def test_a_reader_matches_every_writer_it_was_made_for(offered: list[EndpointQos]) -> None:
    ours = as_endpoint(requested_of(offered), partition=common_partition(offered), data_representation=BOTH)
    reader = DiscoveredReaderData(**endpoint(ours))
    for qos in offered:
        assert judge(DiscoveredWriterData(**endpoint(qos)), reader) is None


@settings(max_examples=200)
@given(st.lists(readers, min_size=1, max_size=4))
def test_a_writer_matches_every_reader_it_was_made_for(requested: list[EndpointQos]) -> None:
    ours = as_endpoint(offered_to(requested, [XCDR1, XCDR2]), partition=common_partition(requested))
    writer = DiscoveredWriterData(**endpoint(ours))
    for qos in requested:
        assert judge(writer, DiscoveredReaderData(**endpoint(qos))) is None


def test_a_reader_requests_no_less_than_all_offer() -> None:
    """Otherwise a sample could be lost, and history would not come."""
    reliable = EndpointQos(reliability=p.Reliable(), durability=p.Transient())
    assert requested_of([reliable, reliable]).reliability == p.Reliable()
    assert requested_of([reliable, reliable]).durability == p.Transient()
    assert requested_of([reliable, EndpointQos()]).reliability == p.BestEffort()
    assert requested_of([reliable, EndpointQos()]).durability == p.Volatile()


def test_ownership_is_that_of_the_first() -> None:
    exclusive = EndpointQos(ownership=p.Exclusive())
    assert requested_of([exclusive, EndpointQos()]).ownership == p.Exclusive()
    assert offered_to([exclusive], [XCDR1]).ownership == p.Exclusive()


@pytest.mark.parametrize(
    ("understood", "chosen"),
    [
        ([()], XCDR1),
        ([(XCDR2,)], XCDR2),
        ([(XCDR1, XCDR2), (XCDR2,)], XCDR2),
        ([(XCDR1,), (XCDR2,)], XCDR1),
        ([], XCDR1),
    ],
)
def test_the_representation_is_one_that_all_understand(understood: list[Any], chosen: int) -> None:
    """None that all understand: the type's own choice, which some will take."""
    requested = [EndpointQos(data_representation=p.DataRepresentation(*ids)) for ids in understood]
    assert offered_to(requested, [XCDR1, XCDR2]).data_representation == p.DataRepresentation(chosen)


def test_no_partition_is_one_too() -> None:
    assert common_partition([EndpointQos()]) == p.Partition()
    assert common_partition([EndpointQos(), EndpointQos(partition=p.Partition("a"))]) == p.Partition("", "a")
    assert common_partition([]) == p.Partition()
