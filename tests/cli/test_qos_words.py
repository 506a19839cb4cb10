"""QoS in words and as JSON."""

from __future__ import annotations

import json
import math

import pytest

from ddsi.cli.qos_words import qos_json, qos_words
from ddsi.structure import qos_policies as p
from ddsi.structure.qos import EndpointQos

CASES = [
    ({}, "best-effort, volatile", {}),
    ({"reliability": p.Reliable(0.5)}, "reliable, volatile",
     {"reliability": {"kind": "Reliable", "max_blocking_time": 0.5}}),
    ({"durability": p.Persistent()}, "best-effort, persistent", {"durability": {"kind": "Persistent"}}),
    ({"history": p.KeepAll()}, "best-effort, volatile, keep-all", {"history": {"kind": "KeepAll"}}),
    ({"history": p.KeepLast(7)}, "best-effort, volatile, keep-last 7", {"history": {"kind": "KeepLast", "depth": 7}}),
    ({"deadline": p.Deadline(0.25)}, "best-effort, volatile, deadline 250 ms", {"deadline": {"period": 0.25}}),
    ({"lifespan": p.Lifespan(2)}, "best-effort, volatile, lifespan 2 s", {"lifespan": {"duration": 2}}),
    ({"latency_budget": p.LatencyBudget(math.inf)}, "best-effort, volatile, latency budget infinite",
     {"latency_budget": {"duration": "infinite"}}),
    ({"time_based_filter": p.TimeBasedFilter(1)}, "best-effort, volatile, at most every 1 s",
     {"time_based_filter": {"minimum_separation": 1}}),
    ({"liveliness": p.ManualByTopic(3)}, "best-effort, volatile, manual-by-topic liveliness 3 s",
     {"liveliness": {"kind": "ManualByTopic", "lease_duration": 3}}),
    ({"liveliness": p.ManualByParticipant()}, "best-effort, volatile, manual-by-participant liveliness",
     {"liveliness": {"kind": "ManualByParticipant", "lease_duration": "infinite"}}),
    ({"ownership": p.Exclusive(), "ownership_strength": p.OwnershipStrength(-4)},
     "best-effort, volatile, exclusive, strength -4",
     {"ownership": {"kind": "Exclusive"}, "ownership_strength": {"value": -4}}),
    ({"destination_order": p.BySourceTimestamp()}, "best-effort, volatile, by-source-timestamp",
     {"destination_order": {"kind": "BySourceTimestamp"}}),
    ({"presentation": p.Presentation(p.AccessScope.TOPIC, coherent_access=True)},
     "best-effort, volatile, topic access coherent",
     {"presentation": {"access_scope": "TOPIC", "coherent_access": True, "ordered_access": False}}),
    ({"partition": p.Partition("a", "b*")}, "best-effort, volatile, partition 'a' 'b*'",
     {"partition": {"names": ["a", "b*"]}}),
    ({"data_tags": p.DataTags(("class", "secret"), ("by", "us"))}, "best-effort, volatile, tags 'class=secret' 'by=us'",
     {"data_tags": {"tags": [["class", "secret"], ["by", "us"]]}}),
    ({"data_representation": p.DataRepresentation(2)}, "best-effort, volatile, XCDR2",
     {"data_representation": {"ids": ["XCDR2"]}}),
    ({"data_representation": p.DataRepresentation(0)}, "best-effort, volatile",
     {"data_representation": {"ids": ["XCDR1"]}}),
    ({"resource_limits": p.ResourceLimits(9, 8, 7)},
     "best-effort, volatile, at most 9 samples, at most 8 instances, at most 7 samples an instance",
     {"resource_limits": {"max_samples": 9, "max_instances": 8, "max_samples_per_instance": 7}}),
    ({"user_data": p.UserData(b"\x00\xff")}, "best-effort, volatile, user data 2 B", {"user_data": {"value": "00ff"}}),
    ({"transport_priority": p.TransportPriority(3)}, "best-effort, volatile, priority 3",
     {"transport_priority": {"value": 3}}),
    ({"entity_name": "radar"}, "best-effort, volatile", {"entity_name": "radar"}),
    ({"properties": {"a": p.Property("b", propagate=True), "c": p.BinaryProperty(b"\x01")}}, "best-effort, volatile",
     {"properties": {"a": "b", "c": "01"}}),
]  # fmt: skip


@pytest.mark.parametrize(("policies", "words", "form"), CASES)
def test_each_policy_is_said(policies: dict[str, object], words: str, form: dict[str, object]) -> None:
    """In words only what is not the default; reliability and durability always."""
    qos = EndpointQos(**policies)  # type: ignore[arg-type]
    assert qos_words(qos) == words
    always = {
        "reliability": {"kind": "BestEffort", "max_blocking_time": 0.1},
        "durability": {"kind": "Volatile"},
    }
    assert qos_json(qos) == always | form
    json.dumps(qos_json(qos), allow_nan=False)
