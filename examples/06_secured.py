"""Secured: a publisher and a subscriber that prove who they are, may do what they were given, and share it with nobody.

A participant is secured by the folder of its identity: certificate, private key, and what the authorities signed about
the domain and its rights.  Nothing else in the program changes.  These two commands make such folders, one for alice,
who may publish Temperatures, and one for bob, who may subscribe to it (`pip install 'ddsi[security]'`):

    ddsi keystore create keystore --identity alice --publish Temperatures
    ddsi keystore enclave keystore bob --subscribe Temperatures

Run this where you ran them.  You will see three temperatures, which went encrypted from alice to bob; and then what bob
is told when he tries to publish: the document, the line, and the right that he lacks.

    python examples/06_secured.py              # both in one program
    python examples/06_secured.py subscribe    # or each in a process of its own: first this one,
    python examples/06_secured.py publish      # then this one in another terminal
    python examples/06_secured.py intrude      # and bob, who tries to publish
"""

import sys
from pathlib import Path
from typing import Annotated

import trio

import ddsi
from ddsi import idl

ENCLAVES = Path("keystore", "enclaves")
QOS = ddsi.Qos(reliability=ddsi.Reliable(), history=ddsi.KeepAll())


@idl.struct
class Temperature:
    sensor: Annotated[str, idl.key]
    celsius: idl.float64


def participant_of(identity: str) -> ddsi.DomainParticipant:
    return ddsi.DomainParticipant(0, qos=ddsi.secure(ENCLAVES / identity))


def topic_of(participant: ddsi.DomainParticipant) -> ddsi.Topic[Temperature]:
    return ddsi.Topic(participant, "Temperatures", Temperature)


async def publish(identity: str = "alice") -> None:
    async with participant_of(identity) as participant:
        try:
            writer = ddsi.DataWriter(participant, topic_of(participant), QOS)
        except ddsi.NotAllowedBySecurity as refusal:
            print(f"{identity} may not publish: {refusal}")
            return
        await writer.wait_for_matched()  # with somebody who has proved to be allowed to read it
        for celsius in (11.0, 11.5, 12.0):
            await writer.write(Temperature("cellar", celsius))
        await writer.wait_for_acknowledgments()


async def subscribe() -> None:
    async with participant_of("bob") as participant, trio.open_nursery() as nursery:
        nursery.start_soon(tell_refusals, participant)
        reader = ddsi.DataReader(participant, topic_of(participant), QOS)
        async for sample in reader:
            if not sample.info.valid_data:  # alice has gone
                break
            print(f"bob received {sample.data.celsius:.1f} of the {sample.data.sensor}")
        nursery.cancel_scope.cancel()


async def tell_refusals(participant: ddsi.DomainParticipant) -> None:
    """Whoever is there and cannot prove to be allowed; here, nobody."""
    async for event in participant.events():
        if isinstance(event, ddsi.SecurityRefused):
            print(f"refused {event.remote}: {event.reason}")


async def intrude() -> None:
    await publish("bob")


async def main() -> None:
    async with trio.open_nursery() as nursery:
        nursery.start_soon(subscribe)
        nursery.start_soon(publish)
    await intrude()


if not ENCLAVES.is_dir():
    sys.exit(
        "There is no folder named keystore here.  These two commands make it:\n"
        "    ddsi keystore create keystore --identity alice --publish Temperatures\n"
        "    ddsi keystore enclave keystore bob --subscribe Temperatures"
    )
parts = {"": main, "subscribe": subscribe, "publish": publish, "intrude": intrude}
part = parts.get(" ".join(sys.argv[1:]))
if part is None:
    sys.exit("usage: 06_secured.py [subscribe | publish | intrude]")
trio.run(part)
