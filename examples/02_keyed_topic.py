"""Keyed topic: one topic carries the state of many things, each with a life of its own.

A field marked ``idl.key`` tells the things ("instances") apart.  A writer may dispose an instance (it is gone) or
unregister it (I know no more of it); readers learn of both as samples without valid data, which hold the key.

You will see two robots report, one of them retire (disposed), and the other lose its last writer (no writers), each
line with the state that the reader knows the robot to be in.

    python examples/02_keyed_topic.py         # writer and reader in one program, as two participants
    python examples/02_keyed_topic.py read    # or each in a process of its own: first this one,
    python examples/02_keyed_topic.py write   # then this one in another terminal
"""

import sys
from typing import Annotated

import trio

import ddsi
from ddsi import idl


@idl.struct
class RobotState:
    name: Annotated[str, idl.key]
    battery: idl.float32 = 0.0


# Every sample counts, and a robot that its writer forgets is not thereby gone.
QOS = ddsi.Qos(
    reliability=ddsi.Reliable(),
    history=ddsi.KeepAll(),
    writer_data_lifecycle=ddsi.WriterDataLifecycle(autodispose_unregistered_instances=False),
)


async def write() -> None:
    async with ddsi.DomainParticipant(0) as participant:
        writer = ddsi.DataWriter(participant, ddsi.Topic(participant, "Robots", RobotState), QOS)
        await writer.wait_for_matched()
        await writer.write(RobotState("arm", 0.5))
        await writer.write(RobotState("rover", 1.0))
        await writer.write(RobotState("rover", 0.75))
        await trio.sleep(0.2)  # so that the reader has taken them: it tells the state at the time that it takes
        await writer.dispose(RobotState("arm"))  # only the key matters here
        await writer.unregister(RobotState("rover"))
        await writer.wait_for_acknowledgments()


async def read() -> None:
    async with ddsi.DomainParticipant(0) as participant:
        reader = ddsi.DataReader(participant, ddsi.Topic(participant, "Robots", RobotState), QOS)
        alive = {"arm", "rover"}
        async for sample in reader:
            robot = sample.data
            state = str(sample.info.instance_state.name).lower().replace("_", " ")
            if sample.info.valid_data:
                print(f"{robot.name:5}  battery {robot.battery:4.0%}  {state}")
            else:
                print(f"{robot.name:5}                {state}")
                alive.discard(robot.name)
            if not alive:
                break


async def main() -> None:
    async with trio.open_nursery() as nursery:
        nursery.start_soon(read)
        nursery.start_soon(write)


trio.run({"read": read, "write": write}.get("".join(sys.argv[1:]), main))
