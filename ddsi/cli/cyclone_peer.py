"""A foreign peer for ``ddsi demo``: Eclipse Cyclone DDS through its Python binding, in a process without any of ours.

Run as a file, ``python -P cyclone_peer.py DOMAIN COUNT SECONDS``: it reads COUNT blue squares and writes COUNT red
circles, and prints one line for each.  The interface comes from CYCLONEDDS_URI.
"""

# The binding's annotations mean something at run time only.
# mypy: ignore-errors
# pyright: basic, reportInvalidTypeForm=false, reportInvalidTypeArguments=false, reportArgumentType=false
# pyright: reportAttributeAccessIssue=false

import sys
import time
from dataclasses import dataclass

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.annotations import final, key
from cyclonedds.idl.types import bounded_str, int32
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

PERIOD_S = 0.1


@dataclass
@final
class ShapeType(IdlStruct, typename="ShapeType"):
    color: bounded_str[128]
    key("color")
    x: int32
    y: int32
    shapesize: int32


def main(domain: int, count: int, seconds: float) -> int:
    qos = Qos(Policy.Reliability.Reliable(duration(seconds=10)), Policy.History.KeepAll)
    participant = DomainParticipant(domain)
    writer = DataWriter(participant, Topic(participant, "Circle", ShapeType), qos)
    # The writer may know of this reader before this reader knows of it, and then it would miss the first sample.
    late = Qos(Policy.Durability.TransientLocal, base=qos)
    reader = DataReader(participant, Topic(participant, "Square", ShapeType), late)
    print("READY", flush=True)
    end = time.monotonic() + seconds
    received = written = 0
    while (received < count or written < count) and time.monotonic() < end:
        for sample in reader.take(N=100):
            if sample.sample_info.valid_data:
                received += 1
                say("received", "Square", sample)
        if written < count and writer.get_matched_subscriptions():
            sample = ShapeType("RED", 20 + 4 * written, 240 - 4 * written, 30)
            writer.write(sample)
            written += 1
            say("wrote", "Circle", sample)
        time.sleep(PERIOD_S)
    writer.wait_for_acks(duration(seconds=5))
    return 0 if received == written == count else 1


def say(verb: str, topic: str, shape: ShapeType) -> None:
    print(f"{verb} {topic:<10} {shape.color:<10} {shape.x:03d} {shape.y:03d} [{shape.shapesize}]", flush=True)


if __name__ == "__main__":
    sys.exit(main(int(sys.argv[1]), int(sys.argv[2]), float(sys.argv[3])))
