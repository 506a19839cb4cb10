"""Hello: one participant writes a sample and reads it back.  This is the program of the README.

You will see one line, the sample.  Participants use the network that DDSI_URI names, else every interface that is up.

    python examples/01_hello.py
"""

from typing import Annotated

import trio

import ddsi
from ddsi import idl


@idl.struct(typename="ShapeType", extensibility=idl.APPENDABLE)
class ShapeType:
    color: Annotated[str, idl.key, idl.bound(128)]
    x: idl.int32
    y: idl.int32
    shapesize: idl.int32
    additional_payload_size: idl.sequence[idl.uint8] = b""


async def main() -> None:
    async with ddsi.DomainParticipant(0) as participant:
        topic = ddsi.Topic(participant, "Square", ShapeType)
        writer = ddsi.DataWriter(participant, topic, ddsi.Qos(reliability=ddsi.Reliable()))
        reader = ddsi.DataReader(participant, topic)
        await writer.wait_for_matched()
        await writer.write(ShapeType("BLUE", 10, 20, 30))
        async for sample in reader:
            print(sample.data)
            break


trio.run(main)
