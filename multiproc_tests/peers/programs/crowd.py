"""One of a crowd: a participant with a writer and a reader of one topic, which says when it has found all the others.

``python -m multiproc_tests.peers.programs.crowd COUNT`` says ``READY cpu`` when it is there, ``MATCHED cpu`` when its
writer and its reader are matched with those of COUNT participants, its own among them, and holds until something, or
the end, comes on standard input.  Then it says ``DONE cpu matched``.  ``cpu``: seconds of the processor that it used.
"""

from __future__ import annotations

import sys
import time

import trio

import ddsi
from ddsi import idl

QOS = ddsi.Qos(reliability=ddsi.Reliable(), durability=ddsi.TransientLocal())


@idl.struct
class Greeting:
    number: idl.int32


def say(*words: object) -> None:
    print(*words, flush=True)


async def main(count: int) -> None:
    async with ddsi.DomainParticipant(1) as participant:
        topic = ddsi.Topic(participant, "Crowd", Greeting)
        writer = ddsi.DataWriter(participant, topic, QOS)
        reader = ddsi.DataReader(participant, topic, QOS)
        say("READY", f"{time.process_time():.2f}")
        await writer.wait_for_matched(count)
        await reader.wait_for_matched(count)
        say("MATCHED", f"{time.process_time():.2f}")
        await trio.lowlevel.wait_readable(sys.stdin.fileno())
        say("DONE", f"{time.process_time():.2f}", writer.status(ddsi.PublicationMatched).current_count)


if __name__ == "__main__":
    trio.run(main, int(sys.argv[1]))
