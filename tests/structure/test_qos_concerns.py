"""Which policies mean something to which entity: DDS 1.4 §2.2.3, and what is announced of each."""

from __future__ import annotations

from dataclasses import fields

import pytest

from ddsi.structure import qos_policies as p
from ddsi.structure.qos import Qos
from ddsi.structure.qos_concerns import QosOwner, unused_policies

EVERYTHING = Qos(
    reliability=p.Reliable(), durability=p.Transient(), history=p.KeepAll(), resource_limits=p.ResourceLimits(),
    durability_service=p.DurabilityService(), deadline=p.Deadline(), latency_budget=p.LatencyBudget(),
    lifespan=p.Lifespan(), time_based_filter=p.TimeBasedFilter(), liveliness=p.Automatic(), ownership=p.Exclusive(),
    ownership_strength=p.OwnershipStrength(), destination_order=p.BySourceTimestamp(), presentation=p.Presentation(),
    partition=p.Partition(), user_data=p.UserData(), topic_data=p.TopicData(), group_data=p.GroupData(),
    data_tags=p.DataTags(), transport_priority=p.TransportPriority(), entity_factory=p.EntityFactory(),
    writer_data_lifecycle=p.WriterDataLifecycle(), reader_data_lifecycle=p.ReaderDataLifecycle(),
    data_representation=p.DataRepresentation(), type_consistency=p.TypeConsistency(), entity_name="all",
    properties={"some": "thing"},
)  # fmt: skip
OF_WRITERS = "durability_service lifespan ownership_strength transport_priority writer_data_lifecycle"
OF_READERS = "time_based_filter reader_data_lifecycle type_consistency"


@pytest.mark.parametrize(
    ("owner", "unused"),
    [
        ("writer", f"{OF_READERS} entity_factory"),
        ("reader", f"{OF_WRITERS} entity_factory"),
        ("publisher", OF_READERS),
        ("subscriber", OF_WRITERS),
        ("topic", "entity_factory"),
    ],
)
def test_each_is_told_what_concerns_others_alone(owner: QosOwner, unused: str) -> None:
    assert sorted(unused_policies(EVERYTHING, owner)) == sorted(unused.split())


def test_a_participant_has_few_policies() -> None:
    used = {item.name for item in fields(Qos)} - set(unused_policies(EVERYTHING, "participant"))
    assert used == {"user_data", "entity_factory", "entity_name", "properties"}


def test_what_was_not_set_is_not_unused() -> None:
    assert unused_policies(Qos(history=p.KeepAll()), "writer") == ()
    assert unused_policies(Qos(history=p.KeepAll()), "participant") == ("history",)
