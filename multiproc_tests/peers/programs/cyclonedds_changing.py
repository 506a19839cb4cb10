"""A writer or a reader over the `cyclonedds` package of PyPI, which does as lines on standard input say.

    cyclonedds_changing pub|sub DOMAIN PARTITION [--exclusive]

Lines: ``strength N``, ``write NUMBER``, ``end``; of others it says REFUSED.  Else as ``ddsi_changing``.
"""

# mypy: ignore-errors
# pyright: basic, reportArgumentType=false

import os
import select
import sys
from collections.abc import Iterator
from typing import Any

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.pub import DataWriter, Publisher
from cyclonedds.sub import DataReader, Subscriber
from cyclonedds.topic import Topic
from cyclonedds.util import duration

from .cyclonedds_shapes import ShapeType
from .protocol import say


def lines(idle: Any) -> Iterator[list[str]]:
    """What comes on standard input, in words; ``idle`` is called while nothing does."""
    rest = b""
    while True:
        idle()
        if select.select([sys.stdin], [], [], 0.01)[0]:
            octets = os.read(sys.stdin.fileno(), 4096)
            if not octets:
                return
            *whole, rest = (rest + octets).split(b"\n")
            for line in whole:
                yield line.decode().split()


class Watch:
    """Says what there is to say of the endpoint."""

    def __init__(self, entity: Any) -> None:
        self.entity = entity
        self.matched = 0

    def look(self) -> None:
        is_reader = isinstance(self.entity, DataReader)
        found = self.entity.get_matched_publications() if is_reader else self.entity.get_matched_subscriptions()
        if len(found) != self.matched:
            self.matched = len(found)
            say("MATCHED", self.matched)
        if is_reader:
            for sample in self.entity.take(16):
                if sample.sample_info.valid_data:
                    say("SAMPLE", sample.x, sample.shapesize)


def main() -> None:
    role, domain, partition, *flags = sys.argv[1:]
    policies = [Policy.Reliability.Reliable(duration(seconds=10)), Policy.History.KeepAll]
    if "--exclusive" in flags:
        policies.append(Policy.Ownership.Exclusive)
    participant = DomainParticipant(int(domain))
    topic = Topic(participant, "Square", ShapeType)
    group = Qos(Policy.Partition([partition]))
    if role == "pub":
        entity: Any = DataWriter(Publisher(participant, qos=group), topic, qos=Qos(*policies))
    else:
        entity = DataReader(Subscriber(participant, qos=group), topic, qos=Qos(*policies))
    say("READY")
    for verb, *words in lines(Watch(entity).look):
        if verb == "end":
            return
        if verb == "write":
            entity.write(ShapeType("BLUE", int(words[0]), 0, os.getpid() & 0xFFFF))
        elif verb == "strength":
            entity.set_qos(Qos(Policy.OwnershipStrength(int(words[0]))))
            say("CHANGED", verb)
        else:
            say("REFUSED", verb)


if __name__ == "__main__":
    main()
