"""The other side of ``ddsi_evolution.py``, over the `cyclonedds` package of PyPI; arguments and lines are the same."""

# The package's annotations mean something at run time only.
# mypy: ignore-errors
# pyright: basic, reportInvalidTypeForm=false, reportInvalidTypeArguments=false, reportArgumentType=false

import dataclasses
import json
import sys
import time
from dataclasses import dataclass
from typing import Any, Optional

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.annotations import appendable, key, member_id, mutable
from cyclonedds.idl.types import float64, int32, sequence
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

from .protocol import say

WAIT_S = 20


@dataclass
@appendable
class OldPoint(IdlStruct, typename="Point"):
    x: int32
    y: int32


@dataclass
@appendable
class NewPoint(IdlStruct, typename="Point"):
    x: int32
    y: int32
    z: int32


@dataclass
@appendable
class OldGrown(IdlStruct, typename="Grown"):
    id: int32
    key("id")
    name: str
    x: float64
    points: sequence[OldPoint]


@dataclass
@appendable
class NewGrown(IdlStruct, typename="Grown"):
    id: int32
    key("id")
    name: str
    x: float64
    points: sequence[NewPoint]
    more: sequence[int32]
    note: Optional[str]  # noqa: UP045 - the binding does not know the other form


@dataclass
@mutable
class OldChanged(IdlStruct, typename="Changed"):
    id: int32
    key("id")
    member_id("id", 0)
    name: str
    member_id("name", 1)
    x: float64
    member_id("x", 2)


@dataclass
@mutable
class NewChanged(IdlStruct, typename="Changed"):
    more: sequence[int32]
    member_id("more", 9)
    id: int32
    key("id")
    member_id("id", 0)
    note: Optional[str]  # noqa: UP045
    member_id("note", 5)
    x: float64
    member_id("x", 2)
    name: str
    member_id("name", 1)


TOPICS = {
    ("Grown", "old"): (OldGrown, 2),
    ("Grown", "new"): (NewGrown, 2),
    ("Changed", "old"): (OldChanged, 2),
    ("Changed", "new"): (NewChanged, 2),
    ("ChangedXcdr1", "old"): (OldChanged, 1),
    ("ChangedXcdr1", "new"): (NewChanged, 1),
}


def make_sample(type_: type[Any], number: int) -> Any:
    members: dict[str, Any] = {"id": number, "name": f"name {number}", "x": number / 2}
    if type_ is OldGrown:
        members["points"] = [OldPoint(number, index) for index in range(3)]
    if type_ is NewGrown:
        members["points"] = [NewPoint(number, index, 9) for index in range(3)]
    if type_ in (NewGrown, NewChanged):
        members |= {"more": [number, number + 1], "note": f"note {number}"}
    return type_(**members)


def publish(writer: DataWriter[Any], type_: type[Any], count: int) -> None:
    end = time.monotonic() + WAIT_S
    while not writer.get_matched_subscriptions() and time.monotonic() < end:
        time.sleep(0.005)
    for number in range(count):
        writer.write(make_sample(type_, number))
    writer.wait_for_acks(duration(seconds=WAIT_S))


def subscribe(reader: DataReader[Any], name: str, count: int) -> None:
    received, end = 0, time.monotonic() + WAIT_S
    while received < count and time.monotonic() < end:
        for sample in reader.take(count):
            if sample.sample_info.valid_data:
                say("SAMPLE", name, json.dumps(dataclasses.asdict(sample), default=list, sort_keys=True))
                received += 1
        time.sleep(0.005)


def main(role: str, version: str, count: int) -> None:
    participant = DomainParticipant(0)
    endpoints = []
    for (name, of_version), (type_, representation) in TOPICS.items():
        if of_version != version:
            continue
        qos = Qos(
            Policy.Reliability.Reliable(duration(seconds=10)),
            Policy.History.KeepAll,
            Policy.Durability.TransientLocal,
            Policy.DurabilityService(0, Policy.History.KeepAll, -1, -1, -1),
            Policy.DataRepresentation(
                use_cdrv0_representation=representation == 1, use_xcdrv2_representation=representation == 2
            ),
        )
        topic = Topic(participant, name, type_)
        kind = DataWriter if role == "pub" else DataReader
        endpoints.append((kind(participant, topic, qos=qos), name, type_))
    say("READY")
    for endpoint, name, type_ in endpoints:
        if role == "pub":
            publish(endpoint, type_, count)
        else:
            subscribe(endpoint, name, count)
    say("DONE")


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], int(sys.argv[3]))
