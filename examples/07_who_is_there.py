"""Who is there: participants, writers and readers as samples, and the writer behind a sample.

Discovery tells every participant of all others.  The builtin topics hand that to applications: a BuiltinTopicReader is
read as any other reader, and each remote participant, writer or reader is an instance whose end is told too.  Where
participants are secured, each comes with the name on its certificate, which it has proved to hold.

You will see two guests come, each with an endpoint, and go again; and of the one sample that crosses, who wrote it.

    python examples/07_who_is_there.py                      # the guests in the same program
    python examples/07_who_is_there.py keystore/enclaves    # the same, secured: in the folder of 06_secured.py
    python examples/07_who_is_there.py watch                # whoever comes and goes, until you press Ctrl-C
"""

import sys
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Annotated, Any

import trio

import ddsi
from ddsi import idl

words = sys.argv[1:]
WATCHES_ONLY = "watch" in words
ENCLAVES = [Path(word) for word in words if word != "watch"]


@idl.struct
class Temperature:
    sensor: Annotated[str, idl.key]
    celsius: idl.float64


def participant_of(name: str, identity: str) -> ddsi.DomainParticipant:
    security = ddsi.secure(ENCLAVES[0] / identity) if ENCLAVES else ddsi.Qos()
    return ddsi.DomainParticipant(0, qos=security | ddsi.Qos(entity_name=name))


def identity_in(security: ddsi.ParticipantSecurity | ddsi.EndpointSecurity) -> str:
    """What somebody calls himself is one thing, who he is another."""
    return security.subject_name if security.is_authenticated else "not authenticated"


async def tell(what: str, reader: ddsi.BuiltinTopicReader[Any], name_of: Callable[[Any], str]) -> None:
    async for sample in reader:
        sign = "+" if sample.info.valid_data else "-"  # an end: what was known last is told once more
        print(sign, f"{what:11} {name_of(sample.data):27} {identity_in(sample.data.security)}", flush=True)


async def watch(participant: ddsi.DomainParticipant) -> None:
    def endpoint(data: ddsi.PublicationBuiltinTopicData | ddsi.SubscriptionBuiltinTopicData) -> str:
        return f"{data.qos.entity_name or 'one'} of {data.topic_name}"

    participants = ddsi.BuiltinTopicReader(participant, ddsi.ParticipantBuiltinTopicData)
    publications = ddsi.BuiltinTopicReader(participant, ddsi.PublicationBuiltinTopicData)
    subscriptions = ddsi.BuiltinTopicReader(participant, ddsi.SubscriptionBuiltinTopicData)
    async with trio.open_nursery() as nursery:
        nursery.start_soon(tell, "participant", participants, lambda data: data.entity_name or "one without a name")
        nursery.start_soon(tell, "writer", publications, endpoint)
        nursery.start_soon(tell, "reader", subscriptions, endpoint)


async def publish() -> None:
    async with participant_of("station", "alice") as participant:
        topic = ddsi.Topic(participant, "Temperatures", Temperature)
        qos = ddsi.Qos(reliability=ddsi.Reliable(), entity_name="thermometer")
        writer = ddsi.DataWriter(participant, topic, qos)
        await writer.wait_for_matched()
        await writer.write(Temperature("cellar", 11.0))
        while writer.matched_subscriptions():  # stay until it was read
            await trio.sleep(0.05)


async def subscribe() -> None:
    async with participant_of("office", "bob") as participant:
        topic = ddsi.Topic(participant, "Temperatures", Temperature)
        qos = ddsi.Qos(reliability=ddsi.Reliable(), entity_name="display")
        reader = ddsi.DataReader(participant, topic, qos)
        async for sample in reader:
            publication = reader.matched_publication_data(sample.info.publication_handle)
            way = "protected" if publication.security.is_payload_protected else "for everybody to see"
            who = f"{publication.qos.entity_name}, {identity_in(publication.security)}"
            print(f"  {sample.data.celsius} degrees came {way}, from the {who}")
            await trio.sleep(0.2)  # so that there is somebody to be seen
            break


async def main() -> None:
    async with participant_of("watcher", "bob") as participant, trio.open_nursery() as nursery:
        nursery.start_soon(watch, participant)
        if WATCHES_ONLY:
            await trio.sleep_forever()
        async with trio.open_nursery() as guests:
            guests.start_soon(publish)
            guests.start_soon(subscribe)
        while {"station", "office"} & {data.entity_name for data in participant.discovered_participants()}:
            await participant.wait_for_discovery()
        await trio.sleep(0.1)  # so that the last lines are printed
        nursery.cancel_scope.cancel()


with suppress(KeyboardInterrupt):
    trio.run(main)
