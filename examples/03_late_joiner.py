"""Late joiner: a reader that comes after the samples were written still gets them.

With transient-local durability a writer keeps its history (here: the latest three samples of each sensor) for readers
that match it later.  A reader gets it that asks for it by the same policy; it may ask for less than is offered, not for
more.

You will see five samples written before anybody reads; then a volatile reader that gets none of them, and a
transient-local one that gets the latest three; and last the sample that is written once both are there, which both get.

    python examples/03_late_joiner.py         # all in one program, as three participants
    python examples/03_late_joiner.py write   # or: a writer that stays for ten seconds,
    python examples/03_late_joiner.py read    # and within them a transient-local reader in another terminal
"""

import sys
from typing import Annotated

import trio

import ddsi
from ddsi import idl


@idl.struct
class Temperature:
    sensor: Annotated[str, idl.key]
    celsius: idl.float64


LASTING = ddsi.Qos(reliability=ddsi.Reliable(), durability=ddsi.TransientLocal(), history=ddsi.KeepLast(3))
VOLATILE = ddsi.Qos(reliability=ddsi.Reliable(), history=ddsi.KeepLast(3))


def topic_of(participant: ddsi.DomainParticipant) -> ddsi.Topic[Temperature]:
    return ddsi.Topic(participant, "Temperatures", Temperature)


def show(name: str, reader: ddsi.DataReader[Temperature]) -> None:
    values = [f"{sample.data.celsius:.1f}" for sample in reader.take() if sample.info.valid_data]
    print(f"{name:9} reader: {', '.join(values) or 'nothing'}")


async def write_history(writer: ddsi.DataWriter[Temperature]) -> None:
    for step in range(5):
        await writer.write(Temperature("cellar", 11 + step / 2))
    print("written before anybody reads: 11.0 to 13.0")


async def main() -> None:
    async with ddsi.DomainParticipant(0) as early:
        writer = ddsi.DataWriter(early, topic_of(early), LASTING)
        await write_history(writer)
        async with ddsi.DomainParticipant(0) as late, ddsi.DomainParticipant(0) as later:
            volatile = ddsi.DataReader(late, topic_of(late), VOLATILE)
            lasting = ddsi.DataReader(later, topic_of(later), LASTING)
            await writer.wait_for_matched(2)
            for reader in (volatile, lasting):
                await reader.wait_for_matched()
                await reader.wait_for_historical_data()
            show("volatile", volatile)
            show("lasting", lasting)
            await writer.write(Temperature("cellar", 20.5))
            await writer.wait_for_acknowledgments()
            show("volatile", volatile)
            show("lasting", lasting)


async def write() -> None:
    async with ddsi.DomainParticipant(0) as participant:
        await write_history(ddsi.DataWriter(participant, topic_of(participant), LASTING))
        await trio.sleep(10)


async def read() -> None:
    async with ddsi.DomainParticipant(0) as participant:
        reader = ddsi.DataReader(participant, topic_of(participant), LASTING)
        await reader.wait_for_matched()
        await reader.wait_for_historical_data()
        show("lasting", reader)


trio.run({"read": read, "write": write}.get("".join(sys.argv[1:]), main))
