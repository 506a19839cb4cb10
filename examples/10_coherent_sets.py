"""Coherent sets: what was written together is seen together, over topics, or not at all.

A robot publishes where it is and which way it looks on two topics, always both in one set; the last time something
goes wrong in the middle, and the set is withdrawn.  Who asks for coherent access never sees a place without a heading.

You will see four poses, each of both topics, and not the fifth.

    python examples/10_coherent_sets.py
"""

from typing import Annotated

import trio

import ddsi
from ddsi import idl


@idl.struct
class Place:
    robot: Annotated[str, idl.key]
    x: idl.float64
    y: idl.float64


@idl.struct
class Heading:
    robot: Annotated[str, idl.key]
    degrees: idl.float64


# All writers of a publisher take part in its sets; with ordered access all readers of a subscriber follow one order.
TOGETHER = ddsi.Qos(presentation=ddsi.Presentation(ddsi.AccessScope.GROUP, coherent_access=True, ordered_access=True))
ENDPOINT = ddsi.Qos(reliability=ddsi.Reliable(), history=ddsi.KeepAll())


async def publish(publisher: ddsi.Publisher) -> None:
    participant = publisher.participant
    places = ddsi.DataWriter(publisher, ddsi.Topic(participant, "Place", Place), ENDPOINT)
    headings = ddsi.DataWriter(publisher, ddsi.Topic(participant, "Heading", Heading), ENDPOINT)
    await places.wait_for_matched()
    await headings.wait_for_matched()
    for step in range(4):
        with publisher.coherent_changes():
            await places.write(Place("R2", step, 2 * step))
            await trio.sleep(0.01)  # what is under way meanwhile is not seen
            await headings.write(Heading("R2", 90 * step))
    try:
        with publisher.coherent_changes():
            await places.write(Place("R2", -1, -1))
            raise RuntimeError("the compass does not answer")
    except RuntimeError as error:
        print(f"withdrawn: {error}", flush=True)
    await places.wait_for_acknowledgments(timeout=5)
    await headings.wait_for_acknowledgments(timeout=5)


async def main() -> None:
    async with ddsi.DomainParticipant(0) as robot, ddsi.DomainParticipant(0) as station:
        subscriber = ddsi.Subscriber(station, TOGETHER)
        ddsi.DataReader(subscriber, ddsi.Topic(station, "Place", Place), ENDPOINT)
        ddsi.DataReader(subscriber, ddsi.Topic(station, "Heading", Heading), ENDPOINT)
        async with trio.open_nursery() as nursery:
            nursery.start_soon(publish, ddsi.Publisher(robot, TOGETHER))
            seen = 0
            while seen < 4:
                await subscriber.wait()
                with subscriber.access():  # while it lasts nothing else becomes visible
                    samples = [reader.take()[0].data for reader in subscriber.get_datareaders()]
                for place, heading in zip(samples[::2], samples[1::2], strict=True):
                    print(f"at ({place.x:g}, {place.y:g}), looking to {heading.degrees:g} degrees", flush=True)
                    seen += 1


trio.run(main)
