"""Without trio: a plain script and asyncio's tasks, on the same topic.

`ddsi.blocking` is for scripts and threads, `ddsi.aio` for asyncio; both offer the entities of `ddsi` under the same
names.  Here the script publishes and a listener prints what comes back, while a task of asyncio, in another thread as
it might be in another process, answers.

You will see the script's questions answered, each line printed by the listener's own thread:

    2 + 2 = 4
    3 + 3 = 6
    5 + 5 = 10

    python examples/08_without_trio.py
"""

import asyncio
import threading
from typing import Annotated

import ddsi
from ddsi import aio, blocking, idl

RELIABLE = ddsi.Qos(reliability=ddsi.Reliable(), durability=ddsi.TransientLocal(), history=ddsi.KeepAll())


@idl.struct
class Question:
    number: Annotated[idl.int32, idl.key]


@idl.struct
class Answer:
    number: Annotated[idl.int32, idl.key]
    doubled: idl.int32


async def answer() -> None:
    """An asyncio program: `await`, `async for`, and cancellation as everywhere in asyncio."""
    async with aio.DomainParticipant(0) as participant:
        questions = aio.DataReader(participant, aio.Topic(participant, "Question", Question), RELIABLE)
        answers = aio.DataWriter(participant, aio.Topic(participant, "Answer", Answer), RELIABLE)
        async with asyncio.timeout(20):
            async for question in questions:
                if not question.info.valid_data:  # whoever asked has left
                    break
                await answers.write(Answer(question.data.number, 2 * question.data.number))


class Printer(blocking.Listener):
    """Its methods are called in a thread of its own; they may take their time, and call whatever they like."""

    def __init__(self) -> None:
        self.numbers: set[int] = set()
        self.has_all = threading.Event()

    def on_data_available(self, reader: blocking.DataReader[Answer]) -> None:
        for sample in reader.take():
            if sample.info.valid_data:
                print(f"{sample.data.number} + {sample.data.number} = {sample.data.doubled}")
                self.numbers.add(sample.data.number)
        if len(self.numbers) == 3:
            self.has_all.set()


def main() -> None:
    """A plain script: calls that wait, `with`, `for`."""
    answering = threading.Thread(target=asyncio.run, args=(answer(),))
    answering.start()
    printer = Printer()
    with blocking.DomainParticipant(0) as participant:
        questions = blocking.DataWriter(participant, blocking.Topic(participant, "Question", Question), RELIABLE)
        topic = blocking.Topic(participant, "Answer", Answer)
        blocking.DataReader(participant, topic, RELIABLE, listener=printer)
        for number in (2, 3, 5):
            questions.write(Question(number))
        printer.has_all.wait(20)
        for number in (2, 3, 5):
            questions.dispose(Question(number))
    answering.join()


main()
