"""DDS for asyncio: the entities of ``ddsi``, awaited in asyncio's tasks.

The same engine serves them, in one thread of its own that starts with the first participant and ends with the last.
Cancelling a task cancels what it waits for in that thread.  Creating and closing entities crosses over without
``await``, as it takes no longer than the crossing.  DESIGN: ``ddsi/portal/engine_thread.py``.

    async with ddsi.aio.DomainParticipant(0) as participant:
        reader = ddsi.aio.DataReader(participant, ddsi.aio.Topic(participant, "Square", ShapeType))
        async for sample in reader:
            print(sample.data)
"""

from ..portal.conditions import GuardCondition, QueryCondition, ReadCondition, StatusCondition
from .entities import (
    BuiltinTopicReader,
    ContentFilteredTopic,
    DataReader,
    DataWriter,
    DomainParticipant,
    EventStream,
    MultiTopic,
    MultiTopicReader,
    Publisher,
    Subscriber,
    Topic,
    WaitSet,
)

__all__ = [
    "BuiltinTopicReader",
    "ContentFilteredTopic",
    "DataReader",
    "DataWriter",
    "DomainParticipant",
    "EventStream",
    "GuardCondition",
    "MultiTopic",
    "MultiTopicReader",
    "Publisher",
    "QueryCondition",
    "ReadCondition",
    "StatusCondition",
    "Subscriber",
    "Topic",
    "WaitSet",
]
