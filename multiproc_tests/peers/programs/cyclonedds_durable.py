"""The same over the `cyclonedds` package of PyPI.

cyclonedds_durable pub|sub DOMAIN COUNT
"""

# mypy: ignore-errors
# pyright: basic, reportArgumentType=false

import sys
import time
from typing import Any

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

from .cyclonedds_shapes import ShapeType
from .protocol import say

QOS = Qos(
    Policy.Reliability.Reliable(duration(seconds=10)),
    Policy.History.KeepAll,
    Policy.Durability.Persistent,
    Policy.DurabilityService(duration(seconds=0), Policy.History.KeepAll, -1, -1, -1),
)


def main() -> None:
    role, domain, count = sys.argv[1:]
    participant = DomainParticipant(int(domain))
    topic = Topic(participant, "Square", ShapeType)
    end: Any = DataReader(participant, topic, qos=QOS) if role == "sub" else DataWriter(participant, topic, qos=QOS)
    say("READY")
    while role == "pub" and not end.get_matched_subscriptions():
        time.sleep(0.01)
    for number in range(int(count) if role == "pub" else 0):
        end.write(ShapeType("BLUE", number, 0, 30))
        say("WROTE", number)
    while True:
        for sample in end.take(64) if role == "sub" else ():
            if sample.sample_info.valid_data:
                say("SAMPLE", sample.x)
        time.sleep(0.01)


if __name__ == "__main__":
    main()
