"""A peer over the `cyclonedds` package of PyPI (Cyclone DDS 11 in C, bound to Python).

The interface comes from CYCLONEDDS_URI.  No security: the package is built without.
"""

# The package's annotations (bounded_str[128], byte) mean something at run time only.
# mypy: ignore-errors
# pyright: basic, reportInvalidTypeForm=false, reportInvalidTypeArguments=false, reportArgumentType=false

import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from cyclonedds.core import InstanceState, Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.annotations import appendable, final, key
from cyclonedds.idl.types import bounded_str, byte, float64, int32, int64, sequence
from cyclonedds.pub import DataWriter, Publisher
from cyclonedds.sub import DataReader, Subscriber
from cyclonedds.topic import Topic
from cyclonedds.util import duration

from .protocol import (
    Arguments,
    blob_octets,
    describe,
    is_released,
    leave_slowly,
    open_fields,
    parse_arguments,
    say,
    wait_at_gate,
)


@dataclass
@final
class ShapeType(IdlStruct, typename="ShapeType"):
    color: bounded_str[128]
    key("color")
    x: int32
    y: int32
    shapesize: int32


@dataclass
@final
class PlainShape(IdlStruct, typename="PlainShape"):
    color: bounded_str[128]
    x: int32
    y: int32
    shapesize: int32


@dataclass
@appendable
class OpenShape(IdlStruct, typename="OpenShape"):
    color: bounded_str[128]
    key("color")
    tint: byte
    angle: float64
    stamp: int64
    x: int32
    y: int32
    shapesize: int32


@dataclass
@final
class Blob(IdlStruct, typename="Blob"):
    id: int32
    data: sequence[byte]


@dataclass
@final
class KeyedBlob(IdlStruct, typename="KeyedBlob"):
    id: int32
    key("id")
    data: sequence[byte]


def kind_of(o: Arguments) -> type[Any]:
    if o.blob_octets >= 0:
        return Blob if o.keyless else KeyedBlob
    if o.appendable:
        return OpenShape
    return PlainShape if o.keyless else ShapeType


def make_sample(o: Arguments, number: int) -> Any:
    kind, color = kind_of(o), o.colors[number % len(o.colors)]
    if o.blob_octets >= 0:
        return kind(number, blob_octets(o.blob_octets, number))
    if o.appendable:
        return kind(color, *open_fields(number), number, 2 * number, o.size)
    return kind(color, number, 2 * number, o.size)


def key_of(sample: Any) -> Any:
    return sample.id if hasattr(sample, "data") else sample.color


def endpoint_qos(o: Arguments) -> Qos:
    history = Policy.History.KeepLast(o.depth) if o.depth else Policy.History.KeepAll
    policies = [
        Policy.Reliability.BestEffort if o.best_effort else Policy.Reliability.Reliable(duration(seconds=10)),
        Policy.Durability.Volatile if o.volatile else Policy.Durability.TransientLocal,
        history,
        # What late joiners get is the durability service; it would keep one sample of each instance.
        Policy.DurabilityService(0, history, -1, -1, -1),
        Policy.WriterDataLifecycle(autodispose=False),
    ]
    if o.max_samples:
        policies.append(Policy.ResourceLimits(max_samples=o.max_samples))
    if o.representation:
        policies.append(
            Policy.DataRepresentation(
                use_cdrv0_representation=o.representation == 1, use_xcdrv2_representation=o.representation == 2
            )
        )
    return Qos(*policies)


def group_qos(o: Arguments) -> Qos:
    return Qos(Policy.Partition(o.partitions)) if o.partitions else Qos()


def wait_until(is_done: Callable[[], bool], seconds: float) -> bool:
    end = time.monotonic() + seconds
    while not is_done():
        if time.monotonic() > end:
            return False
        time.sleep(0.005)
    return True


def publish(o: Arguments, participant: DomainParticipant, topic: Topic[Any]) -> int:
    writer = DataWriter(Publisher(participant, qos=group_qos(o)), topic, qos=endpoint_qos(o))
    if not wait_until(lambda: len(writer.get_matched_subscriptions()) >= o.readers, o.wait_s):
        say("TIMEOUT", len(writer.get_matched_subscriptions()), "of", o.readers, "readers")
        return 1
    say("MATCHED", len(writer.get_matched_subscriptions()))
    wait_at_gate(o)
    sample = None
    for number in range(o.count):
        sample = make_sample(o, number)
        writer.write(sample)
        say("WROTE", describe(sample))
        time.sleep(o.interval_ms / 1000)
    if o.dispose:
        writer.dispose(sample)
        say("DISPOSED", key_of(sample))
    if o.unregister:
        writer.unregister_instance(sample)
        say("UNREGISTERED", key_of(sample))
    if not o.best_effort:
        say("ACKED" if writer.wait_for_acks(duration(seconds=o.wait_s)) else "NOT-ACKED")
    leave_slowly(o)
    say("DONE", o.count)
    return 0


class Taker:
    """Takes and says what a reader has, and knows when it was everything that is expected."""

    def __init__(self, o: Arguments, reader: DataReader[Any]) -> None:
        self.options = o
        self.reader = reader
        self.samples = self.matched = 0
        self.has_disposed = self.has_no_writers = False
        self.keys: dict[int, Any] = {}
        self.disposed: set[int] = set()

    def is_complete(self) -> bool:
        o = self.options
        return (
            self.samples >= o.count
            and (self.has_disposed or not o.dispose)
            and (self.has_no_writers or not o.unregister)
        )

    def take_some(self) -> None:
        if len(self.reader.get_matched_publications()) != self.matched:
            self.matched = len(self.reader.get_matched_publications())
            say("MATCHED", self.matched)
        taken = self.reader.take(1 if self.options.read_pause_ms else 16)
        for sample in taken:
            self._say(sample)
        time.sleep(self.options.read_pause_ms / 1000 if taken else 0.005)

    def _say(self, sample: Any) -> None:
        info = sample.sample_info
        if info.valid_data:
            self.keys[info.instance_handle] = key_of(sample)
            say("SAMPLE", describe(sample))
            self.samples += 1
        key = self.keys.get(info.instance_handle, "?")
        if info.instance_state == InstanceState.NotAliveDisposed:
            # Samples that are taken after the dispose bear its state as well: it is said once for an instance.
            if info.instance_handle not in self.disposed:
                say("DISPOSED", key)
            self.disposed.add(info.instance_handle)
            self.has_disposed = True
        elif info.instance_state == InstanceState.NotAliveNoWriters and not info.valid_data:
            say("NO-WRITERS", key)
            self.has_no_writers = True


def subscribe(o: Arguments, participant: DomainParticipant, topic: Topic[Any]) -> int:
    taker = Taker(o, DataReader(Subscriber(participant, qos=group_qos(o)), topic, qos=endpoint_qos(o)))
    end = time.monotonic() + o.wait_s
    while not taker.is_complete() and time.monotonic() < end:
        taker.take_some()
    if not taker.is_complete():
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
    participant = DomainParticipant(o.domain)
    say("GUID", participant.guid.hex)
    topic = Topic(participant, o.topic, kind_of(o))
    return publish(o, participant, topic) if o.is_publisher else subscribe(o, participant, topic)


if __name__ == "__main__":
    sys.exit(main())
