"""Cyclone: the same roles as ``ours``, with the ``cyclonedds`` package of PyPI (Cyclone DDS in C, bound to Python).

Its users wait in a WaitSet and take what is there; so does this, in batches, which it is quickest with.
"""

# The package's annotations (bounded_str[128]) mean something at run time only.
# mypy: ignore-errors
# pyright: basic, reportInvalidTypeForm=false, reportInvalidTypeArguments=false, reportArgumentType=false

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

from cyclonedds.core import InstanceState, Policy, Qos, ReadCondition, SampleState, ViewState, WaitSet
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.annotations import final, key
from cyclonedds.idl.types import bounded_str, int32, sequence, uint8
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

from .memory import Growth, resident_mib
from .protocol import PAYLOAD_BYTE, play, say_ready, summarise_round_trips

QOS = Qos(Policy.Reliability.Reliable(duration(seconds=30)), Policy.History.KeepAll)
_ANY = ViewState.Any | InstanceState.Any | SampleState.Any
_BATCH = 256
_WARM_UP = 100
_SETTLE_S = 0.2
_PATIENCE = duration(seconds=30)


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
class Octets(IdlStruct, typename="Octets"):
    x: int32
    octets: sequence[uint8]


def kind_of(octets: int) -> type[Any]:
    return Octets if octets else ShapeType


def maker_of(octets: int) -> Callable[[int], Any]:
    """Makes the sample of a number; ``octets`` 0 stands for a ShapeType."""
    if octets:
        payload = PAYLOAD_BYTE * octets
        return lambda number: Octets(number, payload)
    return lambda number: ShapeType("BLUE", number, 20, 30)


# --- throughput ------------------------------------------------------------------------------------------


def samples_of(participant: DomainParticipant, reader: DataReader[Any], batch: int) -> Iterator[Any]:
    """The wait-set loop.  It ends when nothing comes for long."""
    waitset = WaitSet(participant)
    waitset.attach(ReadCondition(reader, _ANY))
    while waitset.wait(_PATIENCE):
        for sample in reader.take(batch):
            if sample.sample_info.valid_data:
                yield sample


def receive(domain: int, octets: int, count: int) -> dict[str, float]:
    participant = DomainParticipant(domain)
    reader = DataReader(participant, Topic(participant, "Throughput", kind_of(octets)), QOS)
    say_ready()
    received = 0
    start = processor = 0.0
    for sample in samples_of(participant, reader, _BATCH):
        if not received:
            start, processor = time.perf_counter(), time.process_time()
        received += 1
        if sample.x == count - 1:
            break
    seconds = time.perf_counter() - start
    processor = time.process_time() - processor
    if received != count:
        raise RuntimeError(f"received {received} samples of {count}")
    return {"per_second": (count - 1) / seconds, "processor_us": processor / count * 1e6}


def send(domain: int, octets: int, count: int) -> dict[str, float]:
    make = maker_of(octets)
    participant = DomainParticipant(domain)
    writer = DataWriter(participant, Topic(participant, "Throughput", kind_of(octets)), QOS)
    wait_until(writer.get_matched_subscriptions)
    time.sleep(_SETTLE_S)
    processor = time.process_time()
    for number in range(count):
        writer.write(make(number))
    if not writer.wait_for_acks(_PATIENCE):
        raise RuntimeError("not everything was acknowledged")
    return {"processor_us": (time.process_time() - processor) / count * 1e6}


def wait_until(matched: Callable[[], list[int]]) -> None:
    """Looked at often enough not to count beside the time that a match takes."""
    end = time.monotonic() + 30
    while not matched():
        if time.monotonic() > end:
            raise RuntimeError("no match")
        time.sleep(0.0002)


# --- round trip ------------------------------------------------------------------------------------------


def echo(domain: int, count: int) -> None:
    participant = DomainParticipant(domain)
    reader = DataReader(participant, Topic(participant, "Ping", ShapeType), QOS)
    writer = DataWriter(participant, Topic(participant, "Pong", ShapeType), QOS)
    say_ready()
    for sample in samples_of(participant, reader, _BATCH):
        writer.write(sample)


def ping(domain: int, count: int) -> dict[str, float]:
    participant = DomainParticipant(domain)
    writer = DataWriter(participant, Topic(participant, "Ping", ShapeType), QOS)
    reader = DataReader(participant, Topic(participant, "Pong", ShapeType), QOS)
    wait_until(writer.get_matched_subscriptions)
    wait_until(reader.get_matched_publications)
    time.sleep(_SETTLE_S)
    replies = samples_of(participant, reader, _BATCH)
    seconds: list[float] = []
    processor = 0.0
    for number in range(_WARM_UP + count):
        if number == _WARM_UP:
            processor = time.process_time()
        start = time.perf_counter()
        writer.write(ShapeType("BLUE", number, 20, 30))
        sample = next(replies)
        seconds.append(time.perf_counter() - start)
        if sample.x != number:
            raise RuntimeError(f"sent {number}, and {sample.x} came back")
    return summarise_round_trips(seconds[_WARM_UP:], time.process_time() - processor)


# --- matching, footprint ---------------------------------------------------------------------------------


def await_company(domain: int) -> None:
    participant = DomainParticipant(domain)
    reader = DataReader(participant, Topic(participant, "There", ShapeType), QOS)
    writer = DataWriter(participant, Topic(participant, "Back", ShapeType), QOS)
    time.sleep(_SETTLE_S)
    say_ready()
    while True:
        time.sleep(60)
        del reader, writer


def join(domain: int) -> dict[str, float]:
    start = time.perf_counter()
    participant = DomainParticipant(domain)
    writer = DataWriter(participant, Topic(participant, "There", ShapeType), QOS)
    reader = DataReader(participant, Topic(participant, "Back", ShapeType), QOS)
    wait_until(writer.get_matched_subscriptions)
    wait_until(reader.get_matched_publications)
    return {"ms": (time.perf_counter() - start) * 1e3}


def idle(domain: int) -> dict[str, float]:
    participant = DomainParticipant(domain)
    time.sleep(1)
    used = resident_mib()
    del participant
    return {"mib": used}


CROWD_TOPICS = 100


def crowd(domain: int, endpoints: int) -> None:
    participant = DomainParticipant(domain)
    topics = [Topic(participant, f"Crowd{number}", ShapeType) for number in range(min(endpoints, CROWD_TOPICS))]
    there = []
    for number in range(endpoints):
        topic = topics[number // 2 % len(topics)]
        there.append(DataReader(participant, topic, QOS) if number % 2 else DataWriter(participant, topic, QOS))
    say_ready()
    while there:
        time.sleep(60)


def watch(domain: int) -> dict[str, float]:
    participant = DomainParticipant(domain)
    time.sleep(1)
    before = resident_mib()
    say_ready()
    growth = Growth()
    while not growth.is_over(resident_mib() - before):
        time.sleep(Growth.INTERVAL_S)
    del participant
    return {"mib": growth.latest}


if __name__ == "__main__":
    play(
        {
            "receive": receive,
            "send": send,
            "echo": echo,
            "ping": ping,
            "await_company": await_company,
            "join": join,
            "idle": idle,
            "crowd": crowd,
            "watch": watch,
        }
    )
