"""A topic that no other program knows: Track, of nested types, over the `cyclonedds` package of PyPI.

    cyclonedds_tracks pub|sub|other DOMAIN

``pub`` writes tracks and disposes the last, ``sub`` says what it reads, ``other`` has a writer of the same topic with
another type.  Each ends when something comes on standard input.  The interface comes from CYCLONEDDS_URI.
"""

# The package's annotations (case[...], array[...]) mean something at run time only.
# mypy: ignore-errors
# pyright: basic, reportInvalidTypeForm=false, reportInvalidTypeArguments=false, reportArgumentType=false
# pyright: reportGeneralTypeIssues=false, reportCallIssue=false, reportIndexIssue=false, reportUndefinedVariable=false

import sys
import time
from dataclasses import dataclass
from typing import Any, Optional

from cyclonedds.core import InstanceState, Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlEnum, IdlStruct, IdlUnion
from cyclonedds.idl.annotations import appendable, final, key
from cyclonedds.idl.types import array, bounded_str, case, default, float64, int32, sequence, uint8
from cyclonedds.pub import DataWriter, Publisher
from cyclonedds.sub import DataReader, Subscriber
from cyclonedds.topic import Topic
from cyclonedds.util import duration

from .protocol import is_released, say


class Kind(IdlEnum, typename="radar.Kind", default="SHIP"):
    SHIP = 0
    PLANE = 1


@dataclass
@final
class Point(IdlStruct, typename="radar.Point"):
    x: float64
    y: float64


class Detail(IdlUnion, discriminator=int32, typename="radar.Detail"):
    name: case[[1, 2], str]
    blob: default[sequence[uint8]]


@dataclass
@appendable
class Track(IdlStruct, typename="radar.Track"):
    id: int32
    key("id")
    kind: Kind
    path: sequence[Point]
    detail: Detail
    label: bounded_str[16]
    grid: array[int32, 4]
    note: Optional[str]  # noqa: UP045 (the package does not take the other spelling)


@dataclass
@final
class Other(IdlStruct, typename="radar.Other"):
    value: int32


def qos() -> Qos:
    return Qos(
        Policy.Reliability.Reliable(duration(seconds=10)),
        Policy.Durability.TransientLocal,
        Policy.History.KeepAll,
        Policy.DurabilityService(0, Policy.History.KeepAll, -1, -1, -1),
        Policy.WriterDataLifecycle(autodispose=False),
    )


def partition() -> Qos:
    return Qos(Policy.Partition(["sea"]))


def wait_for_release() -> None:
    while not is_released():
        time.sleep(0.01)


def publish(participant: DomainParticipant) -> None:
    writer: Any = DataWriter(Publisher(participant, qos=partition()), Topic(participant, "Track", Track), qos=qos())
    details = (Detail(blob=[1, 2, 255]), Detail(name="two"))
    for number in range(2):
        path = [Point(1.5, number), Point(-2.0, 0.25)][: number + 1]
        writer.write(Track(number, Kind(number), path, details[number], "l", [1, 2, 3, 4], "n" if number else None))
    say("HOLDING")
    wait_for_release()
    writer.dispose(Track(1, Kind.SHIP, [], details[0], "", [0, 0, 0, 0], None))
    time.sleep(1)


def subscribe(participant: DomainParticipant) -> None:
    reader: Any = DataReader(Subscriber(participant, qos=partition()), Topic(participant, "Track", Track), qos=qos())
    say("HOLDING")
    while not is_released():
        for sample in reader.take(16):
            if sample.sample_info.valid_data:
                say("SAMPLE", sample)
            if sample.sample_info.instance_state == InstanceState.NotAliveDisposed:  # of the sample before it too
                say("DISPOSED")
        time.sleep(0.01)


def main() -> int:
    role, domain = sys.argv[1], int(sys.argv[2])
    participant = DomainParticipant(domain)
    if role == "pub":
        publish(participant)
    elif role == "sub":
        subscribe(participant)
    else:
        writer = DataWriter(participant, Topic(participant, "Track", Other))
        say("HOLDING")
        wait_for_release()
        del writer
    return 0


if __name__ == "__main__":
    sys.exit(main())
