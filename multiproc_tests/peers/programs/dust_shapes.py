"""A peer over the `dust_dds` package of PyPI (Dust DDS, in Rust, bound to Python), release 0.15.0.

Its binding knows no keys, no representation and no setting of the interface: it takes all that it finds, so run it in
a network namespace.  The reader of 0.16.0 hands out objects without attributes.
"""

# The package's own stubs contradict what it does.
# mypy: ignore-errors
# pyright: basic, reportInvalidTypeForm=false, reportArgumentType=false, reportAttributeAccessIssue=false
# pyright: reportCallIssue=false

import sys
import time
from dataclasses import dataclass
from typing import Any

import dust_dds as dust

from .protocol import Arguments, blob_octets, describe, is_released, leave_slowly, parse_arguments, say, wait_at_gate


@dataclass
class PlainShape:
    color: str
    x: dust.TypeKind.int32
    y: dust.TypeKind.int32
    shapesize: dust.TypeKind.int32


@dataclass
class Blob:
    id: dust.TypeKind.int32
    data: bytes


def make_sample(o: Arguments, number: int) -> Any:
    if o.blob_octets >= 0:
        return Blob(number, blob_octets(o.blob_octets, number))
    return PlainShape(o.colors[number % len(o.colors)], number, 2 * number, o.size)


def policies(o: Arguments) -> dict[str, Any]:
    kind = dust.ReliabilityQosPolicyKind
    blocking = dust.DurationKind.Finite(dust.Duration(10, 0))
    history = dust.HistoryQosPolicyKind
    durability = dust.DurabilityQosPolicyKind
    return {
        "reliability": dust.ReliabilityQosPolicy(kind.BestEffort if o.best_effort else kind.Reliable, blocking),
        "history": dust.HistoryQosPolicy(history.KeepLast(o.depth) if o.depth else history.KeepAll()),
        "durability": dust.DurabilityQosPolicy(durability.Volatile if o.volatile else durability.TransientLocal),
    }


def publish(o: Arguments, participant: Any, topic: Any) -> int:
    group = dust.PublisherQos(partition=dust.PartitionQosPolicy(o.partitions)) if o.partitions else None
    writer = participant.create_publisher(group).create_datawriter(topic, qos=dust.DataWriterQos(**policies(o)))
    end = time.monotonic() + o.wait_s
    while len(writer.get_matched_subscriptions()) < o.readers and time.monotonic() < end:
        time.sleep(0.01)
    matched = len(writer.get_matched_subscriptions())
    if matched < o.readers:
        say("TIMEOUT", matched, "of", o.readers, "readers")
        return 1
    say("MATCHED", matched)
    wait_at_gate(o)
    for number in range(o.count):
        sample = make_sample(o, number)
        writer.write(sample)
        say("WROTE", describe(sample))
        time.sleep(o.interval_ms / 1000)
    if not o.best_effort:
        try:
            writer.wait_for_acknowledgments(dust.Duration(int(o.wait_s), 0))
            say("ACKED")
        except Exception as error:
            say("NOT-ACKED", error)
    leave_slowly(o)
    say("DONE", o.count)
    return 0


class Taker:
    """Takes and says what a reader has."""

    def __init__(self, reader: Any) -> None:
        self.reader = reader
        self.samples = self.matched = 0

    def take_some(self) -> None:
        matched = self.reader.get_subscription_matched_status().get_current_count()
        if matched != self.matched:
            self.matched = matched
            say("MATCHED", matched)
        try:
            taken = self.reader.take(max_samples=16)
        except Exception:  # "NoData" is an exception, without a type of its own
            time.sleep(0.005)
            return
        for sample in taken:
            if sample.get_sample_info().get_valid_data():
                say("SAMPLE", describe(sample.get_data()))
                self.samples += 1


def subscribe(o: Arguments, participant: Any, topic: Any) -> int:
    group = dust.SubscriberQos(partition=dust.PartitionQosPolicy(o.partitions)) if o.partitions else None
    taker = Taker(participant.create_subscriber(group).create_datareader(topic, qos=dust.DataReaderQos(**policies(o))))
    end = time.monotonic() + o.wait_s
    while taker.samples < o.count and time.monotonic() < end:
        taker.take_some()
    if taker.samples < o.count:
        say("TIMEOUT", taker.samples, "of", o.count)
        return 1
    if o.hold:
        say("HOLDING")
    end = time.monotonic() + o.linger_ms / 1000
    while not is_released() if o.hold else time.monotonic() < end:  # what still comes is too much, and said
        taker.take_some()
    say("DONE", taker.samples)
    return 0


def main() -> int:
    o = parse_arguments()
    if not o.keyless or o.representation == 2 or o.appendable:
        say("ERROR Dust DDS has neither keys nor XCDR2 in Python: use -K")
        return 2
    factory = dust.DomainParticipantFactory.get_instance()
    participant = factory.create_participant(domain_id=o.domain)
    topic = participant.create_topic(topic_name=o.topic, type_=Blob if o.blob_octets >= 0 else PlainShape)
    status = publish(o, participant, topic) if o.is_publisher else subscribe(o, participant, topic)
    participant.delete_contained_entities()
    factory.delete_participant(participant)
    return status


if __name__ == "__main__":
    sys.exit(main())
