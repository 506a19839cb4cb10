"""A lossy link: a datagram is lost on purpose, and you watch how the writer and the reader notice and repair it.

Nothing here touches a network: two participants live in a simulated one, with its own clock, where the seed decides
what chance does.  So it prints the same each time, and takes no time at all.

You will see a sequence diagram with one column for each participant.  The first sample arrives.  The link breaks, and
the second is lost.  It heals, the writer's HEARTBEAT says "I have sent up to 2", the reader's ACKNACK says "I lack 2",
and the writer sends it again; the third arrives as the first did.  Each arrow is a datagram.

    python examples/04_lossy_link.py          # this story
    python examples/04_lossy_link.py 0.4 7    # chance instead: four datagrams of ten are lost, by seed 7; try others
"""

import sys

from ddsi import KeepAll, Qos, Reliable
from ddsi.simulation import GOOD_WEATHER, Domain, LinkConditions
from ddsi.trace.describe import Describer
from ddsi.trace.event import Category, TraceEvent
from ddsi.trace.sequence_diagram import sequence_diagram

RELIABLE = Qos(reliability=Reliable(), history=KeepAll())
SHOWN = {Category.MESSAGE, Category.LINK, Category.REMARK}


def main(loss: float | None, seed: int) -> None:
    events: list[TraceEvent] = []
    domain = Domain(seed, trace=events.append)
    sender, receiver = domain.node(name="sender"), domain.node(name="receiver")
    writer = sender.writer("Square", RELIABLE)
    reader = receiver.reader("Square", RELIABLE)

    # Discovery goes over the same network; what it says is another story.
    domain.run_until(domain.all_matched, 10)
    domain.run(1)
    describer = Describer()
    for event in events:
        describer.names.learn_event(event)
    events.clear()

    if loss is None:
        writer.write()
        domain.run(0.02)
        sender.remark("the link breaks")
        domain.network.conditions = LinkConditions(loss=1.0)
        writer.write()
        domain.run(0.01)
        sender.remark("the link is whole again")
        domain.network.conditions = GOOD_WEATHER
        domain.run(0.2)
        writer.write()
    else:
        domain.network.conditions = LinkConditions(loss=loss)
        for _ in range(5):
            writer.write()
            domain.run(0.01)
    arrived = domain.run_until(lambda: len(reader.taken) == len(writer.written), 60)
    domain.run(0.1)

    for line in sequence_diagram(events, categories=SHOWN, describer=describer):
        print(line)
    numbers = [change.sequence_number for _, change in reader.taken]
    print(f"\nwritten {list(writer.written)}, received {numbers}, after {domain.now:.3f} s of virtual time")
    assert arrived, "the reader lacks something"


if __name__ == "__main__":
    chosen = sys.argv[1:]
    main(float(chosen[0]) if chosen else None, int(chosen[1]) if len(chosen) > 1 else 4)
