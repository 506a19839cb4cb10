"""An unknown type: read and write a topic of which nothing is known but the name.

Who announces a topic can be asked what its type is made of.  The answer becomes a class like any other: its samples
have members, are compared and printed, and are refused by the member's path where a value does not fit.

You will see the IDL of a type that only the other participant has, a sample of it as the stranger reads it, and then
what the owner reads of the stranger's.

    python examples/11_unknown_type.py                # owner and stranger in the same program
    python examples/11_unknown_type.py owner          # each in a process of its own: first this,
    python examples/11_unknown_type.py stranger       # then this in another terminal; the stranger's code has no type
"""

import sys
from typing import Annotated, Any

import trio

import ddsi
from ddsi import idl

RELIABLE = ddsi.Qos(reliability=ddsi.Reliable(), durability=ddsi.TransientLocal())


async def owner() -> None:
    @idl.struct(typename="weather::Wind", extensibility=idl.FINAL)
    class Wind:
        speed: idl.float64
        gusts: idl.sequence[idl.float32]

    @idl.struct(typename="weather::Report", extensibility=idl.APPENDABLE)
    class Report:
        station: Annotated[str, idl.key, idl.bound(16)]
        wind: Wind
        remark: str | None = None

    async with ddsi.DomainParticipant(0) as participant:
        topic = ddsi.Topic(participant, "Weather", Report, RELIABLE)
        writer, reader = ddsi.DataWriter(participant, topic), ddsi.DataReader(participant, topic)
        await writer.write(Report("Oslo", Wind(3.5, [4.0, 7.5])))
        async for sample in reader:
            if sample.data.station == "Bergen":
                print(f"the owner reads {sample.data.remark} from {sample.data.station}", flush=True)
                return


async def stranger() -> None:
    async with ddsi.DomainParticipant(0) as participant:
        report_type: Any = await participant.discover_type("Weather", timeout=None)
        print(idl.to_idl(report_type), flush=True)
        topic = ddsi.Topic(participant, "Weather", report_type, RELIABLE)
        reader, writer = ddsi.DataReader(participant, topic), ddsi.DataWriter(participant, topic)
        async for sample in reader:
            report = sample.data
            print("the stranger reads", report, flush=True)
            break
        report.station, report.wind.speed, report.remark = "Bergen", 12.0, "rain"
        await writer.wait_for_matched(2)  # the reader above, and the owner's
        await writer.write(report)
        await writer.wait_for_acknowledgments(5)


async def main() -> None:
    roles = {"owner": owner, "stranger": stranger}
    chosen = [roles[word] for word in sys.argv[1:]] or list(roles.values())
    async with trio.open_nursery() as nursery:
        for role in chosen:
            nursery.start_soon(role)


trio.run(main)
