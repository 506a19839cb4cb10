"""Our own side of topics whose types have grown: writes or reads the old or the new version of each.

Arguments: the role, ``old`` or ``new``, and how many samples of each topic.  The network comes from DDSI_URI.
``cyclonedds_evolution.py`` is the same over that package.
"""

from __future__ import annotations

import dataclasses
import json
import sys
from typing import Annotated, Any

import trio

import ddsi
from ddsi import idl

from .protocol import say

WAIT_S = 20.0


@idl.struct(typename="Point")
class OldPoint:
    x: idl.int32
    y: idl.int32


@idl.struct(typename="Point")
class NewPoint:
    x: idl.int32
    y: idl.int32
    z: idl.int32


@idl.struct(typename="Grown", extensibility=idl.APPENDABLE)
class OldGrown:
    id: Annotated[idl.int32, idl.key]
    name: str
    x: idl.float64
    points: idl.sequence[OldPoint]


@idl.struct(typename="Grown", extensibility=idl.APPENDABLE)
class NewGrown:
    id: Annotated[idl.int32, idl.key]
    name: str
    x: idl.float64
    points: idl.sequence[NewPoint]
    more: idl.sequence[idl.int32]
    note: str | None


@idl.struct(typename="Changed", extensibility=idl.MUTABLE)
class OldChanged:
    id: Annotated[idl.int32, idl.key, idl.id(0)]
    name: Annotated[str, idl.id(1)]
    x: Annotated[idl.float64, idl.id(2)]


@idl.struct(typename="Changed", extensibility=idl.MUTABLE)
class NewChanged:
    more: Annotated[idl.sequence[idl.int32], idl.id(9)]
    id: Annotated[idl.int32, idl.key, idl.id(0)]
    note: Annotated[str | None, idl.id(5)]
    x: Annotated[idl.float64, idl.id(2)]
    name: Annotated[str, idl.id(1)]


TOPICS = {
    ("Grown", "old"): (OldGrown, ddsi.XCDR2),
    ("Grown", "new"): (NewGrown, ddsi.XCDR2),
    ("Changed", "old"): (OldChanged, ddsi.XCDR2),
    ("Changed", "new"): (NewChanged, ddsi.XCDR2),
    ("ChangedXcdr1", "old"): (OldChanged, ddsi.XCDR1),
    ("ChangedXcdr1", "new"): (NewChanged, ddsi.XCDR1),
}


def make_sample(type_: type[Any], number: int) -> Any:
    """What only the new version has is told apart from every default."""
    members: dict[str, Any] = {"id": number, "name": f"name {number}", "x": number / 2}
    if type_ is OldGrown:
        members["points"] = [OldPoint(number, index) for index in range(3)]
    if type_ is NewGrown:
        members["points"] = [NewPoint(number, index, 9) for index in range(3)]
    if type_ in (NewGrown, NewChanged):
        members |= {"more": [number, number + 1], "note": f"note {number}"}
    return type_(**members)


def as_json(sample: Any) -> str:
    return json.dumps(dataclasses.asdict(sample), default=list, sort_keys=True)


async def publish(writer: ddsi.DataWriter[Any], type_: type[Any], count: int) -> None:
    await writer.wait_for_matched(timeout=WAIT_S)
    for number in range(count):
        await writer.write(make_sample(type_, number))
    await writer.wait_for_acknowledgments(WAIT_S)


async def subscribe(reader: ddsi.DataReader[Any], name: str, count: int) -> None:
    received = 0
    async for sample in reader:
        if sample.info.valid_data:
            say("SAMPLE", name, as_json(sample.data))
            received += 1
        if received == count:
            return


async def main(role: str, version: str, count: int) -> None:
    async with ddsi.DomainParticipant(0) as participant, trio.open_nursery() as nursery:
        for (name, of_version), (type_, representation) in TOPICS.items():
            if of_version != version:
                continue
            topic: ddsi.Topic[Any] = ddsi.Topic(participant, name, type_)
            qos = ddsi.Qos(
                reliability=ddsi.Reliable(),
                history=ddsi.KeepAll(),
                durability=ddsi.TransientLocal(),  # a writer may know its reader before the reader knows it
                data_representation=ddsi.DataRepresentation(representation),
            )
            if role == "pub":
                nursery.start_soon(publish, ddsi.DataWriter(participant, topic, qos), type_, count)
            else:
                nursery.start_soon(subscribe, ddsi.DataReader(participant, topic, qos), name, count)
        say("READY")
    say("DONE")


if __name__ == "__main__":
    sys.exit(trio.run(main, sys.argv[1], sys.argv[2], int(sys.argv[3])))
