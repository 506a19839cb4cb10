"""A writer or a reader over the `cyclonedds` package of PyPI, with any policy and one of some types, until input ends.

    cyclonedds_policies pub|sub DOMAIN TOPIC [TYPE] [POLICY]

TYPE: ``shape`` (the default), ``other`` (a keyed one of another name), ``plain``, or ``changed``: that by its name, but
with another member.
"""

# The package's annotations mean something at run time only.
# mypy: ignore-errors
# pyright: basic, reportInvalidTypeForm=false

import sys
from dataclasses import dataclass

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.annotations import appendable, key
from cyclonedds.idl.types import bounded_str, int32
from cyclonedds.pub import DataWriter, Publisher
from cyclonedds.sub import DataReader, Subscriber
from cyclonedds.topic import Topic
from cyclonedds.util import duration

from .cyclonedds_shapes import ShapeType
from .protocol import say


@dataclass
class Other(IdlStruct, typename="Other"):
    color: str
    key("color")


@dataclass
@appendable
class Plain(IdlStruct, typename="Drawing"):
    x: int32


@dataclass
@appendable
class Changed(IdlStruct, typename="Drawing"):
    x: bounded_str[8]


TYPES = {"shape": ShapeType, "other": Other, "plain": Plain, "changed": Changed}
POLICIES = {
    "best-effort": Policy.Reliability.BestEffort,
    "reliable": Policy.Reliability.Reliable(duration(seconds=1)),
    "transient": Policy.Durability.Transient,
    "deadline": Policy.Deadline(duration(seconds=1)),
    "budget": Policy.LatencyBudget(duration(seconds=1)),
    "exclusive": Policy.Ownership.Exclusive,
    "manual": Policy.Liveliness.ManualByTopic(duration(seconds=5)),
    "by-source": Policy.DestinationOrder.BySourceTimestamp,
}
GROUP_POLICIES = {
    "coherent": Policy.PresentationAccessScope.Topic(coherent_access=True, ordered_access=False),
    "partition": Policy.Partition(["red"]),
}


def main() -> None:
    role, domain, topic_name, *words = sys.argv[1:]
    type_ = next((TYPES[word] for word in words if word in TYPES), ShapeType)
    qos = Qos(*(POLICIES[word] for word in words if word in POLICIES))
    group_qos = Qos(*(GROUP_POLICIES[word] for word in words if word in GROUP_POLICIES))
    participant = DomainParticipant(int(domain))
    topic = Topic(participant, topic_name, type_)
    if role == "pub":
        group = Publisher(participant, qos=group_qos)
        endpoint = DataWriter(group, topic, qos=qos)
    else:
        group = Subscriber(participant, qos=group_qos)
        endpoint = DataReader(group, topic, qos=qos)
    say("HOLDING", endpoint.guid)
    sys.stdin.read()


if __name__ == "__main__":
    main()
