"""DDS for plain scripts and threads: the entities of ``ddsi``, with calls that wait.

The same engine serves them, in one thread of its own that starts with the first participant and ends with the last.
Any thread may call anything; nothing of an application runs in the engine's thread but the queries of conditions.
DESIGN: ``ddsi/portal/engine_thread.py``.

    with ddsi.blocking.DomainParticipant(0) as participant:
        reader = ddsi.blocking.DataReader(participant, ddsi.blocking.Topic(participant, "Square", ShapeType))
        for sample in reader:
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
from .listener import Listener

__all__ = [
    "BuiltinTopicReader",
    "ContentFilteredTopic",
    "DataReader",
    "DataWriter",
    "DomainParticipant",
    "EventStream",
    "GuardCondition",
    "Listener",
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
